"""One hostile client: the measurement is the same with it and without, in pairs, rows and memory."""

import math
import time
from contextlib import ExitStack, suppress
from pathlib import Path
from random import Random

import palpate
import pytest
from attacks import KINDS, Target, allow_files, fresh
from effort import NIGHTLY, draws
from live_attacks import RATES, Attacked, Measured, attacked, row
from live_sessions import play
from palpate.live.access.gatekeeper import new_token
from palpate.live.access.limits import PATIENCE_S
from tally import Tally

SECONDS = 60.0 if NIGHTLY else 2.0
_WORST = ["seen", "plans", "pings, nothing read", "empty fragments", "connections", "big cookie", "endless chunks"]
CASES = [(kind, rate) for kind in KINDS for rate in RATES] if NIGHTLY else [(kind, RATES[-1]) for kind in _WORST]
_TRIES = 3
"""A busy machine is late by itself; what an attack does, it does each time."""


def worse(it: Measured, alone: Measured) -> str:
    """Return what an attack has done to the measurement, or nothing. A tenth of the pairs: the scatter of two servers."""
    scatter = 0.1 * it.pairs + 3
    found = {
        "late": it.late - alone.late / alone.pairs * it.pairs > scatter,
        "lost": it.lost - alone.lost / alone.pairs * it.pairs > scatter,
        "not written": it.unwritten > 0 or not it.clean,
        "memory": it.grown_MB > alone.grown_MB + 20,
        "loop": it.block_ms > alone.block_ms + 100,
        "printed": len(it.errors.splitlines()) > 3 or "Traceback" in it.errors,
    }
    return ", ".join(name for name, holds in found.items() if holds)


@pytest.mark.parametrize(("kind", "rate"), CASES)
def test_an_attack_changes_nothing(kind: str, rate: int, tally: Tally) -> None:
    for _ in range(_TRIES):
        it, alone = attacked(kind, rate, SECONDS)
        if not worse(it, alone):
            break
    tally.say(row(kind, rate, it, alone))
    assert not worse(it, alone), (row(kind, rate, it, alone), it.errors)


def test_half_open_connections_keep_no_page_out(tmp_path: Path) -> None:
    """1,100 of them: a page opens beside, and they are gone in 15 s."""
    allow_files(4000)
    with Attacked(38, tmp_path / "run", new_token()) as server, ExitStack() as opened:
        target = Target(server.address, 100, 60)
        fresh(target)
        alone = min(fresh(target) for _ in range(3))
        took = math.inf
        for _ in range(_TRIES):
            sockets = [opened.enter_context(target.connect()) for _ in range(1100)]
            if (took := fresh(target)) < 1 + 2 * alone:
                break
        assert took < 1 + 2 * alone
        begun = time.monotonic()
        for client in sockets:
            client.settimeout(60)
            with suppress(ConnectionResetError):
                assert client.recv(1) == b""
        assert time.monotonic() - begun < 2 * PATIENCE_S + 5


def test_a_request_that_comes_slowly_is_closed(tmp_path: Path) -> None:
    with Attacked(38, tmp_path / "run", new_token()) as server:
        target, begun = Target(server.address, 100, 60), time.monotonic()
        with target.connect() as client:
            client.sendall(b"GET / HTTP/1.1\r\n")
            client.settimeout(60)
            assert client.recv(100) == b""
            assert PATIENCE_S / 2 < time.monotonic() - begun < PATIENCE_S + 10


def test_any_session(tmp_path: Path) -> None:
    """Random sequences of frames, commands, requests, pauses and closes: the recording is complete, nothing is printed."""
    with Attacked(38, tmp_path / "run", new_token()) as server:
        target = Target(server.address, 1e6, 60)
        for seed in range(draws(40, 800, at_least=10)):
            play(target, Random(seed))
        assert fresh(target) < 60
        figures, errors = server.end()
    assert errors == ""
    assert figures["read"] == figures["rows"]
    assert palpate.check(tmp_path / "run" / "run.csv").clean
    assert {path.suffix for path in (tmp_path / "run").iterdir()} <= {".csv", ".json", ""}
    assert [path.name for path in tmp_path.iterdir()] == ["run"]
