"""`palpate.sources.conformance.check_source`: our own sources pass it, and each of many wrong sources is found by name."""

import itertools
import math
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from iio_kernel import Kernel
from kit_bench import CENTRED, Bus
from kit_bench import pins as ramps
from palpate import Sample, Source, Status, open
from palpate.ad7746.bus import VirtualClock
from palpate.ad7746.simulator.chip import SimulatedChip
from palpate.sources import Codes, Gap, GapCause, SampleSource, TroubleEnded
from palpate.sources.conformance import check_source
from project import FOUR

PATIENCE = 10.0
PERIOD_NS = 2_000_000


class Board(SampleSource):
    """A board as it has to be: 500 pairs a second, until it is interrupted."""

    live = True

    def __init__(self) -> None:
        self.stopped = threading.Event()

    def pair(self, seq: int, t_ns: int) -> Any:
        code = 2**26 + seq
        return Sample(seq, t_ns, t_ns + 1000, code, -1, CODES.pF(code), 2.0)

    def samples(self) -> Iterator[Any]:
        """Yield pairs at their times."""
        begun = time.monotonic_ns()
        for seq in itertools.count():
            due = (seq + 1) * PERIOD_NS
            if self.stopped.wait(max(begun + due - time.monotonic_ns(), 0) / 1e9):
                return
            yield self.pair(seq, due)

    def describe(self) -> Any:
        return {"name": "board", "period_s": PERIOD_NS / 1e9, "codes": CODES._asdict()}

    def interrupt(self) -> None:
        self.stopped.set()


CODES = Codes(zero=2**26, per_pF=3e7, largest=2**27)


def test_a_right_source() -> None:
    samples = check_source(Board(), samples=50, patience=PATIENCE)
    assert [sample.seq for sample in samples] == list(range(50))


def wrong(**changed: Any) -> Callable[[], Source]:
    """Return a board with other methods and attributes."""
    return type("Wrong", (Board,), changed)


def replaced(**fields: Any) -> Callable[[], Source]:
    """Return a board with other fields in its samples; a function gets the number and the time."""

    def pair(self: Board, seq: int, t_ns: int) -> Any:
        changed = {
            name: field(seq, t_ns) if callable(field) else field for name, field in fields.items()
        }
        return Board.pair(self, seq, t_ns)._replace(**changed)

    return wrong(pair=pair)


def described(**changed: Any) -> Callable[[], Source]:
    return wrong(describe=lambda self: {**Board.describe(self), **changed})


def never_ending(self: Board) -> Iterator[Any]:
    for seq in itertools.count():
        time.sleep(PERIOD_NS / 1e9)
        yield self.pair(seq, (seq + 1) * PERIOD_NS)


WRONG: dict[str, tuple[Callable[[], Any], str]] = {
    "no source": (dict, "an object of type dict"),
    "seq repeats": (
        replaced(seq=lambda seq, _: seq // 2),
        "seq: got 0, allowed: above the one before",
    ),
    "time goes back": (replaced(t_soft_ns=lambda _, t: -t), "t_soft_ns: goes back"),
    "times in us": (
        replaced(t_hard_ns=lambda _, t: t // 1000),
        "period_s: got 0.002, allowed: 2e-06",
    ),
    "nan, status OK": (replaced(soft=math.nan), "status: got 0 for .* nan pF"),
    "lost with a value": (replaced(status=8), "LOST .* only then"),
    "value and code differ": (replaced(hard=1.0), "hard: got 1.0, allowed: the pF of its code"),
    "an AD7746's codes": (wrong(describe=lambda _: {}), "hard_raw: got .* allowed: -1 to 16777215"),
    "describe raises": (wrong(describe=lambda _: dict[str, Any]()["serial"]), "describe.*KeyError"),
    "period of a channel": (
        described(period_s=PERIOD_NS / 2e9),
        "period_s: got 0.001, allowed: 0.002",
    ),
    "stamps": (described(stamps="mine"), "stamps: got 'mine'"),
    "interrupt ignored": (
        wrong(interrupt=lambda _: None, samples=never_ending),
        "interrupt: the iteration still runs",
    ),
    "silent": (wrong(samples=lambda self: iter(self.stopped.wait, True)), "no sample came"),
    "single samples": (
        wrong(__iter__=lambda self: self.samples()),
        "got an object of type Sample, .* derive from palpate.sources.SampleSource, and rename",
    ),
    "texts": (
        wrong(__iter__=lambda _: iter(["a text"])),
        "the iteration: got an object of type str",
    ),
    "gaps beside": (wrong(gaps=()), "gaps: is not read; yield palpate.sources.Gap"),
    "troubles beside": (wrong(troubles={}), "troubles: is not read; yield palpate.sources.Trouble"),
    "conditions beside": (wrong(conditions=()), "conditions: is not read; yield palpate.sources.C"),
    "blocks beside": (
        wrong(read_block=None),
        "read_block: is not read; yield the blocks in __iter__",
    ),
    "a gap without a text": (
        wrong(samples=lambda _: iter([Gap(GapCause.OTHER, "")])),
        "a gap: got no text, allowed: what happened",
    ),
    "a gap with another cause": (
        wrong(samples=lambda _: iter([Gap("moved", "moved")])),  # type: ignore[arg-type]
        "cause of a gap: got 'moved', allowed: one of palpate.sources.GapCause",
    ),
    "a trouble of another kind": (
        wrong(samples=lambda _: iter([TroubleEnded("hint")])),  # type: ignore[arg-type]
        "kind of a trouble: got 'hint', allowed: one of palpate.sources.TroubleKind",
    ),
    "counters is a method": (
        wrong(counters=lambda _: {"errors": 0}),
        "counters: got an object of type method, allowed: a property with a mapping",
    ),
    "a counter is no number": (
        wrong(counters={"errors": "none"}),
        "counters: got 'none' for errors, allowed: a whole number",
    ),
}


@pytest.mark.parametrize("name", WRONG)
def test_a_wrong_source_is_found(name: str) -> None:
    made, finding = WRONG[name]
    with pytest.raises(AssertionError, match=finding):
        check_source(made(), samples=40, seconds=0.5 if name == "silent" else 30.0, patience=2.0)


@pytest.mark.parametrize(
    ("name", "options"),
    [
        ("sim:dropouts?seed=2", {}),
        ("sim:soft-steady?speed=2", {}),
        ("sim:soft-steady?fault=unplug:0.5@1", {}),
        (str(FOUR), {}),
        (str(FOUR), {"speed": 20}),
    ],
)
def test_our_own(name: str, options: dict[str, Any]) -> None:
    found = check_source(open(name, **options), samples=100, patience=PATIENCE)
    assert len(found) >= 20  # a busy machine gives fewer of a short scenario


def test_i2c() -> None:
    clock = VirtualClock()
    bus = Bus(SimulatedChip(ramps), clock)
    source = open("i2c:/dev/i2c-1?hard_input=2", open_bus=bus, clock=clock)
    source.live = False  # it has another clock than the test
    assert len(check_source(source, patience=PATIENCE)) == 100
    assert (source.describe()["configuration"]["hard"]["capdac"], bus.opened) == (
        CENTRED.soft.capdac,
        0,
    )


@pytest.mark.parametrize("picofarads", [(1.0, -1.0), (6.9, 4.7)])
def test_iio(
    picofarads: tuple[float, float], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    kernel = Kernel(tmp_path, picofarads).install(monkeypatch)
    source = open(f"iio:{tmp_path}", clock_ns=kernel.clock_ns)
    source.live = False
    samples = check_source(source, patience=PATIENCE)
    assert {sample.status for sample in samples} == {Status.OK if picofarads[0] < 4 else Status(3)}
