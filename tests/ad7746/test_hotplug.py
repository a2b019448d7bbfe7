"""Boards that come and go: noticed within a second, without opening one. On each carrier of `usb_carriers`."""

import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path
from types import SimpleNamespace

import palpate
import pytest
from kit_bench import Bench
from palpate import ProtocolError
from palpate.ad7746.evalkit import board, hotplug
from palpate.ad7746.evalkit.find import Board, boards
from palpate.ad7746.evalkit.hotplug import Hotplug, looking
from palpate.sources.watched import WatchedKit
from tally import Tally

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


class Notes:
    """What a watch says."""

    def __init__(self, look: hotplug.Look | None) -> None:
        self.came: list[Board] = []
        self.went: list[Board] = []
        self.watch = Hotplug(self._add, look, poll_s=0.01)

    def _add(self, before: set[Board], now: set[Board]) -> None:
        self.came += sorted(now - before)
        self.went += sorted(before - now)


def test_boards_come_and_go(bench: Bench) -> None:
    notes = Notes(look_of(bench))
    other = bench.another()
    wait_for(lambda: notes.came)
    assert [each.ports for each in notes.came] == [(2,)]
    bench.carrier.unplug(other)
    wait_for(lambda: notes.went)
    assert notes.went == notes.came
    bench.carrier.plug(other, 2)  # again, with another address
    wait_for(lambda: len(notes.came) == 2)
    assert notes.came[1].ports == (2,)
    assert notes.came[1] != notes.came[0]
    notes.watch.close()
    bench.carrier.unplug(other)
    time.sleep(0.05)
    assert len(notes.went) == 1
    wait_for(lambda: "palpate-hotplug" not in [thread.name for thread in threading.enumerate()])


def test_it_is_noticed_within_a_second(bench: Bench, tally: Tally) -> None:
    heard: list[float] = []
    look = look_of(bench)
    watch = Hotplug(lambda before, now: heard.append(time.monotonic()), look)
    begun = time.monotonic()
    bench.another()
    wait_for(lambda: heard)
    watch.close()
    tally.say(f"{type(bench.carrier).__name__}, a board that is plugged in: noticed after {heard[0] - begun:.2f} s")
    assert hotplug.POLL_S <= 0.5


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


def test_usb_is_watched(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where it is open by name; a backend of a program's own is not, since a second thread would use it."""
    monkeypatch.setattr(board, "system_backend", bench.carrier.backend)
    with closing(palpate.open("usb:")) as source:
        assert isinstance(source, WatchedKit)
    with closing(palpate.open("usb:", backend=bench.carrier.backend())) as source:
        assert not isinstance(source, WatchedKit)
    if bench.carrier.real and sys.platform == "linux":
        assert isinstance(looking().__self__, hotplug._Sysfs)  # type: ignore[attr-defined]


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
        time.sleep(2 * hotplug.POLL_S)
        assert len(notes) == 1
        assert notes[0].startswith(f"usb:{first}, ")
        assert "was unplugged" in notes[0]
        bench.carrier.plug(bench.kit)
        reading.join(LIMIT_S)
        wait_for(lambda: len(notes) == 3)
        assert kit.board != first
        assert f"usb:{kit.board} was plugged in." in notes
        assert sum("is back after" in note for note in notes) == 1


def test_a_look_or_a_listener_that_fails_does_not_end_the_watch() -> None:
    there = {Board(1, 2, (1,))}
    heard: list[set[Board]] = []
    trouble: list[Exception] = []

    def look() -> set[Board]:
        if trouble:
            raise trouble.pop()
        return set(there)

    def hear(before: set[Board], now: set[Board]) -> None:
        heard.append(now)
        raise RuntimeError("the terminal is gone")

    watch = Hotplug(hear, look, poll_s=0.001)
    trouble += [OSError("no sysfs now"), ProtocolError("no libusb now")]
    wait_for(lambda: not trouble)
    for address in (3, 4):
        there.add(Board(1, address, (address,)))
        wait_for(lambda: len(heard) == address - 2)  # noqa: B023  it is called in this turn
    watch.close()
    watch.close()


def test_a_watch_may_be_closed_by_what_it_calls() -> None:
    there: set[Board] = set()
    watch = Hotplug(lambda before, now: watch.close(), lambda: set(there), poll_s=0.001)
    there.add(Board(1, 2, ()))
    wait_for(lambda: not watch._thread.is_alive())


def test_other_systems_are_asked_through_libusb(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(hotplug, "sys", SimpleNamespace(platform="darwin"))
    monkeypatch.setattr(hotplug, "system_backend", bench.carrier.backend)
    assert looking()() == set(boards(bench.carrier.backend()))
    assert len(looking()()) == 1


def device(folder: Path, name: str, **files: str) -> None:
    (folder / name).mkdir(parents=True)
    for file, text in files.items():
        (folder / name / file).write_text(text + "\n")


@pytest.mark.skipif(sys.platform != "linux", reason="sysfs is Linux's")
def test_sysfs_is_read_only_after_a_change(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, tally: Tally) -> None:
    kit = {"idVendor": "0456", "idProduct": "b481", "busnum": "3"}
    device(tmp_path, "usb3", idVendor="1d6b", idProduct="0002", busnum="3", devnum="1")
    device(tmp_path, "3-1:1.0")
    device(tmp_path, "3-2", idVendor="8087", idProduct="0024", busnum="3", devnum="2")
    device(tmp_path, "3-2.4.1", **kit, devnum="17")
    device(tmp_path, "3-9")  # about to vanish: no files
    look = looking(tmp_path)
    assert look() == {Board(3, 17, (2, 4, 1))}
    with monkeypatch.context() as patch:
        patch.setattr(Path, "read_text", None)
        assert look() == {Board(3, 17, (2, 4, 1))}
        begun = time.thread_time()
        for _ in range(1000):
            look()
        used = (time.thread_time() - begun) / 1000
    tally.say(f"a look for boards: {used * 1e6:.0f} us, {used / hotplug.POLL_S:.4%} of a processor")
    assert used < 0.001 * hotplug.POLL_S
    for file in ("idVendor", "idProduct", "busnum", "devnum"):
        (tmp_path / "3-2.4.1" / file).unlink()
    (tmp_path / "3-2.4.1").rmdir()
    assert look() == set()
    assert looking(tmp_path / "nowhere")() == set()
