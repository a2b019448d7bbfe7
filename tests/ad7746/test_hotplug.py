"""Boards that come and go: noticed within a second, without opening one. On each carrier of `usb_carriers`."""

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import closing

import palpate
import pytest
from kit_bench import Bench
from palpate.ad7746.evalkit import find
from palpate.ad7746.evalkit.find import Board, boards
from palpate.sources.board import WatchedKit

LIMIT_S = 30.0  # of a loaded machine; the notice itself takes POLL_S


@pytest.fixture
def bench() -> Iterator[Bench]:
    with Bench() as bench:
        yield bench


def look_of(bench: Bench) -> Callable[[], set[Board]] | None:
    """Return None where there is a system to look at."""
    return None if bench.carrier.real else lambda: set(boards(bench.carrier.backend()))


def wait_for(condition: Callable[[], object]) -> None:
    deadline = time.monotonic() + LIMIT_S
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.005)


def test_a_second_board_is_named_and_disturbs_nothing(bench: Bench) -> None:
    kit = bench.open_kit()
    source = WatchedKit(kit, {"replug": 10.0}, bench.carrier.clock, look_of(bench))
    notes: list[str] = []
    source.notify = notes.append
    with source:
        measuring, samples = kit.board, iter(source)
        next(samples)
        other = bench.another()
        wait_for(lambda: notes)
        [second] = [b for b in boards(bench.carrier.backend()) if b != measuring]
        next(samples)
        bench.carrier.unplug(other)
        wait_for(lambda: len(notes) == 2)
        goes_on = f"; usb:{measuring} goes on measuring."
        assert notes == [f"usb:{second} was plugged in{goes_on}", f"usb:{second} was unplugged{goes_on}"]
        assert not other.chip.conversions
        if not bench.carrier.real:  # in real time a busy machine may lose a pair itself
            assert (source.counters["lost"], source.counters["errors"]) == (0, 0)
            assert bench.carrier.backend().opened == 1
    wait_for(lambda: "palpate-hotplug" not in [thread.name for thread in threading.enumerate()])


def test_the_board_that_measures(bench: Bench) -> None:
    """The driver says that it is gone, once, with its name; the watch says where it is back."""
    kit = bench.open_kit()
    source = WatchedKit(kit, {"replug": 1e6}, bench.carrier.clock, look_of(bench))
    notes: list[str] = []
    source.notify = notes.append
    with source:
        samples, first = iter(source), kit.board
        next(samples)
        bench.carrier.unplug(bench.kit)
        reading = threading.Thread(target=lambda: next(samples))
        reading.start()
        wait_for(lambda: notes)
        time.sleep(1.5 * find.POLL_S)
        [gone] = notes
        assert gone.startswith(f"usb:{first}, ")
        assert "was unplugged" in gone
        bench.carrier.plug(bench.kit)
        reading.join(LIMIT_S)
        wait_for(lambda: len(notes) == 3)
        assert kit.board != first
        assert f"usb:{kit.board} was plugged in." in notes
        assert sum("is back after" in note for note in notes) == 1


def test_usb_is_watched(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where it is open by name; a backend of a program's own is not, since a second thread would use it."""
    monkeypatch.setattr(find, "system_backend", bench.carrier.backend)
    for options in ({}, {"backend": bench.carrier.backend()}):
        with closing(palpate.open("usb:", **options)) as source:
            assert isinstance(source, WatchedKit) == (not options)
