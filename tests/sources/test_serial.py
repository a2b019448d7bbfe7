"""A serial port that is a pseudo-terminal, with lines as microcontrollers print them."""

import math
import os
import random
import re
import threading
import tty
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import palpate
import pytest
from fuzz_parsers import ChunkedLines, ChunkedPort
from palpate import DeviceNotFound, DeviceRefused, Sample, Source, Status, Stream
from palpate.recording.foreign import recorded
from palpate.sources.lines import PATTERN

pytest.importorskip("pty")


class Port:
    """The microcontroller's end, and the name of the computer's."""

    def __init__(self, link: Path) -> None:
        self.link = link
        self.plug()

    def plug(self) -> None:
        self.end, other = os.openpty()
        tty.setraw(other)
        self._other = other
        self.link.unlink(missing_ok=True)
        self.link.symlink_to(os.ttyname(other))

    def unplug(self) -> None:
        self.link.unlink()
        os.close(self.end)
        os.close(self._other)

    def write(self, text: str) -> None:
        os.write(self.end, text.encode())


@pytest.fixture
def port(tmp_path: Path) -> Iterator[Port]:
    made = Port(tmp_path / "tty")
    yield made
    made.unplug()


def read(port: Port, text: str, count: int, **options: Any) -> tuple[list[Sample], Source]:
    """Open, let the text come, and read so many samples."""
    with palpate.open(f"serial:{port.link}", **options) as source:
        port.write("end of a line\n" + text)
        samples = [sample for _, sample in zip(range(count), source, strict=False)]
        source.interrupt()
        return samples, source


@pytest.mark.parametrize(
    ("text", "options", "expected"),
    [
        ("1.5,2.5\n-1e-3;+2\r\n", {}, [(1.5, 2.5), (-0.001, 2.0)]),
        (" 0.123456  pF    22.47  pF\n1 2\n", {}, [(0.123456, 22.47), (1, 2)]),
        ("1500\t2500\n1,5 2,5\n", {"unit": "fF"}, [(1.5, 2.5), (0.0015, 0.0025)]),
        (
            "A33593.00\nB32917.00\nA1\nB2\n",
            {"pattern": r"A(?P<hard>[\d.]+)|B(?P<soft>[\d.]+)", "unit": "fF"},
            [(33.593, 32.917), (0.001, 0.002)],
        ),
    ],
)
def test_dialects(port: Port, text: str, options: dict[str, Any], expected: list[tuple[float, float]]) -> None:
    samples, source = read(port, text, len(expected), **options)
    assert [(s.hard, s.soft) for s in samples] == [pytest.approx(pair, rel=1e-12) for pair in expected]
    assert [s.seq for s in samples] == list(range(len(expected)))
    assert {(s.hard_raw, s.soft_raw, s.status) for s in samples} == {(-1, -1, 0)}
    assert all(0 <= s.t_hard_ns <= s.t_soft_ns for s in samples)
    assert source.counters["errors"] == 0


def test_lines_that_do_not_fit_and_overloads_are_counted(port: Port) -> None:
    samples, source = read(port, "booting...\n1 2\n\n#\nOL 3\n4 5\n", 3)
    assert [s.status for s in samples] == [0, Status.LOST, 0]
    assert [s.seq for s in samples] == [0, 1, 2]
    assert source.counters["errors"] == 2


def test_what_has_no_end_is_given_up_and_counted_once() -> None:
    source = ChunkedLines("chunks")
    source._port = ChunkedPort(b"end\n1 2\n" + b"9" * 1500 + b"\xff" + b"9" * 1500 + b"\xff" + b" 1\n3 4\n")
    assert [(s.hard, s.soft) for s in source] == [(1, 2), (3, 4)]
    assert source.counters["errors"] == 1


def test_silence_is_said(port: Port, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("palpate.sources.lines._SILENCE_S", 0.05)
    said: list[str] = []
    with palpate.open(f"serial:{port.link}", baud=9600) as source:
        source.notify = lambda text: (said.append(text), source.interrupt())  # type: ignore[assignment,func-returns-value]
        assert list(source) == []
    assert said == [f"{port.link} sends nothing: check the baud rate, 9600"]


def test_half_a_pair_is_a_lost_sample(port: Port) -> None:
    pattern = r"A(?P<hard>[\d.]+)|B(?P<soft>[\d.]+)"
    samples, source = read(port, "B0\nA1\nA2\nB3\nB4\nA5\nB6\n", 3, pattern=pattern)
    assert [(s.seq, s.status) for s in samples] == [(0, Status.LOST), (1, 0), (2, 0)]
    assert samples[0].hard == 1
    assert math.isnan(samples[0].soft)
    assert [(s.hard, s.soft) for s in samples[1:]] == [(2, 3), (5, 6)]
    assert source.counters == {"errors": 2, "lost": 1, "reconnects": 0}


def test_options_in_the_name(port: Port, tmp_path: Path) -> None:
    uri = f"serial:{port.link}?pattern=h=(?P<hard>\\d+) s=(?P<soft>\\d+)&unit=fF&baud=9600"
    with Stream(uri, record=tmp_path / "run.csv") as stream:
        port.write("\nh=1000 s=2000\n")
        estimate = next(iter(stream))
    assert (estimate.sample.hard, estimate.sample.soft) == (1.0, 2.0)
    assert stream.source.describe()["baud"] == 9600
    assert stream.source.describe()["stamps"] == "host"
    assert stream.tracker.settings["host_stamps"] is True
    assert recorded(tmp_path / "run.csv").host_stamps
    assert palpate.read(tmp_path / "run.csv").hard.tolist() == [1.0]
    assert palpate.read(tmp_path / "run.csv").full_scale_pF == float("inf")


def test_unplugged_and_back(port: Port) -> None:
    said: list[str] = []
    with palpate.open(f"serial:{port.link}") as source:
        source.notify = said.append
        samples = iter(source)
        port.write("\n" + "1 2\n" * 5)
        first = [next(samples) for _ in range(5)]
        port.unplug()

        heard = threading.Event()

        def back() -> None:
            port.plug()
            while not heard.wait(0.05):  # what comes before the port is opened is thrown away
                port.write("3 4\n3 4\n")

        timer = threading.Timer(0.3, back)
        timer.start()
        after = next(samples)
        heard.set()
        timer.join()
    assert first[-1].seq == 4
    assert (after.hard, after.soft) == (3, 4)
    assert after.seq == 5 + source.counters["lost"]
    assert source.counters["reconnects"] == 1
    assert ["was unplugged. Waiting" in said[0], "is back" in said[1]] == [True, True]


def test_unplugged_for_good(tmp_path: Path) -> None:
    port = Port(tmp_path / "tty")
    with palpate.open(f"serial:{port.link}?replug=0.2") as source:
        samples = iter(source)
        port.write("\n1 2\n")
        next(samples)
        port.unplug()
        with pytest.raises(DeviceNotFound, match="was unplugged: plug it in again"):
            next(samples)


def test_it_stops_while_the_port_is_silent_or_away(port: Port) -> None:
    for away in (False, True):
        with Stream(f"serial:{port.link}") as stream:
            if away:
                port.unplug()
            threading.Timer(0.2, stream.stop).start()
            assert list(stream) == []
        if away:
            port.plug()


def test_no_such_port(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(DeviceNotFound, match="there is no such port"):
        palpate.open("serial:/dev/ttyNothing7")
    import serial

    def refuse(*_: Any, **__: Any) -> None:
        raise serial.SerialException("[Errno 13] Permission denied")

    monkeypatch.setattr(serial, "Serial", refuse)
    with pytest.raises(DeviceRefused, match="usermod -aG dialout"):
        palpate.open("serial:/dev/ttyACM0")


def test_the_pattern_finds_what_one_that_backtracks_finds() -> None:
    """Against the plain pattern, which takes time with the third power of the length."""
    number = r"[-+]?\d+(?:[.,]\d+)?(?:[eE][-+]?\d+)?|[-+]?OV?LD?|nan"
    plain = re.compile(rf"(?P<hard>{number})\s*[a-zA-Z]*[\s,;|]+(?P<soft>{number})")
    parts = ["1", "22", "2.5", "1,5", "-3e-2", "e55", "OL", "-OVLD", "nan", " ", "  ", ",", ";", "|", "\t", "pF", "x", "-",
             "+", ".", "E", ":", "=", "µF", "1.2.3"]  # fmt: skip
    rng = random.Random(20)
    found = 0
    for _ in range(20_000):
        line = "".join(rng.choices(parts, k=rng.randint(2, 9)))
        expected, match = plain.search(line), re.search(PATTERN, line)
        assert (expected and expected.groupdict()) == (match and match.groupdict()), line
        found += match is not None
    assert 2000 < found < 18_000


def test_a_long_line_is_an_error_however_it_arrives() -> None:
    source = ChunkedLines("x")
    source._port = ChunkedPort(b"\n" + b"1" * 5000 + b" 2\n3 4\n")
    assert [(sample.hard, sample.soft) for sample in source] == [(3.0, 4.0)]
    assert source.counters["errors"] == 1
