"""A serial port that is a pseudo-terminal, with lines as microcontrollers print them."""

import math
import os
import threading
import time
import tty
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import palpate
import pytest
from click.testing import CliRunner
from palpate import DeviceNotFound, DeviceRefused, ProtocolError, Sample, Source, Status, Stream
from palpate.cli import main
from palpate.recording.foreign import recorded
from serial_lines import Sent

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
        ("1.5,2.5\n-1e-3,+2\r\n", {}, [(1.5, 2.5), (-0.001, 2.0)]),
        ("1500\t2500\n1,5\t2,5\n", {"unit": "fF", "decimal": "comma"}, [(1.5, 2.5), (0.0015, 0.0025)]),
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
    samples, source = read(port, "booting...\nC1=1 C2=2\n\n#\nwhat\nC1=OL C2=3\nC1=4 C2=5\n", 3)
    assert [s.status for s in samples] == [0, Status.LOST, 0]
    assert [s.seq for s in samples] == [0, 1, 2]
    assert source.counters["errors"] == 1


def test_what_has_no_end_is_given_up_and_counted_once() -> None:
    sent = Sent(b"end\nC1=1 C2=2\n" + b"9" * 1500 + b"\xff" + b"9" * 1500 + b"\xff" + b" 1\nC1=3 C2=4\n")
    assert sent.pairs == [(1, 2), (3, 4)]
    assert sent.source.counters["errors"] == 1


@pytest.mark.parametrize(("sent", "what"), [("", "sends nothing"), ("\0\0\0", "sends 3 bytes, but no line end")])
def test_silence_is_said(port: Port, monkeypatch: pytest.MonkeyPatch, sent: str, what: str) -> None:
    monkeypatch.setattr("palpate.sources.serial.port._SILENCE_S", 0.3)
    said: list[str] = []
    with palpate.open(f"serial:{port.link}", baud=9600) as source:
        port.write(sent)
        source.notify = lambda text: (said.append(text), source.interrupt())  # type: ignore[assignment,func-returns-value]
        assert list(source) == []
    assert said == [f"{port.link} {what}: check the baud rate, 9600"]


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("ets Jul 29 2019\n" + "1234,6.92,4.69\n" * 30, "The first: 'ets Jul 29 2019'. Another: '1234,6.92,4.69'."),
        ("1234,6.92,4.69\n" * 30, "'serial:{port}?columns=t_ms,hard,soft'"),
        ("x\x8e\xff,\x01\n" * 30, "not text: check the baud rate, 115200"),
        ("hello\n", "1 line was not read. The first: 'hello'. Reason: it is not made of numbers"),
    ],
)
def test_lines_without_a_match_end_it(port: Port, monkeypatch: pytest.MonkeyPatch, text: str, what: str) -> None:
    monkeypatch.setattr("palpate.sources.serial.strange._FEW_S", 0.1)
    monkeypatch.setattr("palpate.sources.serial.strange._LONG_S", 1.0 if text == "hello\n" else 60.0)
    with palpate.open(f"serial:{port.link}") as source:
        os.write(port.end, b"\n" + text.encode("latin-1"))
        with pytest.raises(ProtocolError) as error:
            list(source)
    assert what.format(port=port.link) in str(error.value)


def test_lines_without_a_value_are_said_once(port: Port, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("palpate.sources.serial.source._NO_VALUE_S", 0.2)
    said: list[str] = []
    with palpate.open(f"serial:{port.link}") as source:
        source.notify = said.append
        samples = iter(source)
        port.write("\n")
        for line in ("C1=nan C2=OL", "C1=1 C2=2", "C1=nan C2=OL"):
            for _ in range(4):
                port.write(f"{line}\n")
                next(samples)
                time.sleep(0.1)
    words = [text for text in said if "no pair with both values for 0.2 s" in text]
    assert len(words) == 2  # of each time once
    assert "check the probe's connection" in words[0]


def test_an_end_of_understanding_ends_it_later(port: Port, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("palpate.sources.serial.strange._LONG_S", 0.3)
    with palpate.open(f"serial:{port.link}?replug=0.1") as source:
        port.write("\nC1=1 C2=2\n")
        samples = iter(source)
        assert next(samples).hard == 1
        port.write("C1:1 C2:2,\n" * 19)
        threading.Timer(0.8, port.write, ["hello\n"]).start()
        with pytest.raises(ProtocolError, match="20 lines in a row were not read"):
            next(samples)
    assert source.counters["errors"] == 20


def test_the_description_waits_for_the_first_lines(port: Port, monkeypatch: pytest.MonkeyPatch) -> None:
    line = "t_hard_us={0}000,t_soft_us={0}500,hard_raw=8388608,soft_raw=8400000\n"
    with palpate.open(f"serial:{port.link}") as source:
        port.write("\n" + line.format(1) + line.format(2))
        described = source.describe()
        assert [described["stamps"], described["columns"][0]] == ["converter", "t_hard us"]
        first, second = (sample for _, sample in zip(range(2), source, strict=False))
        assert (second.t_hard_ns - first.t_hard_ns, first.t_soft_ns - first.t_hard_ns) == (1_000_000, 500_000)
        assert source.describe() is described
    monkeypatch.setattr("palpate.sources.serial.source._SETTLE_S", 0.05)
    with palpate.open(f"serial:{port.link}") as source:
        assert source.describe()["stamps"] == "host"
        port.write("\n" + line.format(1) + line.format(2))
        late = next(iter(source))
        assert late.t_soft_ns == late.t_hard_ns  # as described: those of the arrival
    with palpate.open(f"serial:{port.link}?columns=t_ms,hard,soft") as source:
        assert source.describe()["stamps"] == "converter"


def test_half_a_pair_is_a_lost_sample(port: Port) -> None:
    pattern = r"A(?P<hard>[\d.]+)|B(?P<soft>[\d.]+)"
    samples, source = read(port, "B9\nA1\nA2\nB3\nB4\nA5\nB6\n", 3, pattern=pattern)
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
        port.write("\n" + "C1=1 C2=2\n" * 5)
        first = [next(samples) for _ in range(5)]
        port.unplug()

        heard = threading.Event()

        def back() -> None:
            port.plug()
            while not heard.wait(0.05):  # what comes before the port is opened is thrown away
                port.write("C1=3 C2=4\nC1=3 C2=4\n")

        timer = threading.Timer(0.3, back)
        timer.start()
        after = next(samples)
        heard.set()
        timer.join()
    assert first[-1].seq == 4
    assert (after.hard, after.soft) == (3, 4)
    assert after.seq == 5 + source.counters["lost"]
    assert source.counters["reconnects"] == 1
    assert ["was unplugged. Waiting" in said[1], "is back" in said[2]] == [True, True]
    [gap] = source.gaps
    assert gap.seq == after.seq
    assert "was unplugged for" in gap.text
    assert after.t_hard_ns > first[-1].t_hard_ns + 300_000_000


def test_unplugged_for_good(tmp_path: Path) -> None:
    port = Port(tmp_path / "tty")
    with palpate.open(f"serial:{port.link}?replug=0.2") as source:
        samples = iter(source)
        port.write("\nC1=1 C2=2\n")
        next(samples)
        port.unplug()
        with pytest.raises(DeviceNotFound, match="was unplugged: plug it in again"):
            next(samples)


def test_it_stops_while_the_port_is_silent_or_away(port: Port, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("palpate.sources.serial.source._SETTLE_S", 0.05)
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


def test_a_long_line_is_an_error_however_it_arrives() -> None:
    sent = Sent(b"\nC1=1 C2=2\n" + b"1" * 5000 + b" 2\nC1=3 C2=4\n")
    assert sent.pairs == [(1.0, 2.0), (3.0, 4.0)]
    assert sent.source.counters["errors"] == 1


def test_two_readers_of_a_port_are_refused(port: Port) -> None:
    """Each would get a part of each line: `6.92` becomes `6.9`, which is a number, too."""
    with palpate.open(f"serial:{port.link}"), pytest.raises(palpate.DeviceRefused, match="another program reads it"):
        palpate.open(f"serial:{port.link}")
    palpate.open(f"serial:{port.link}").close()  # free again


def test_without_reset_the_modem_lines_stay_inactive(port: Port, monkeypatch: pytest.MonkeyPatch) -> None:
    import serial

    seen = []
    plain = serial.Serial.open

    def noted(made: Any) -> None:
        seen.append((made.dtr, made.rts))
        plain(made)

    monkeypatch.setattr(serial.Serial, "open", noted)
    for reset in ("yes", "no"):
        palpate.open(f"serial:{port.link}?reset={reset}").close()
    assert seen == [(True, True), (False, False)]


def test_record_ends_by_the_clock_without_a_sample(port: Port, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("palpate.sources.serial.source._SETTLE_S", 0.05)
    monkeypatch.setattr("palpate.cli.record._GRACE_S", 0.1)
    done = CliRunner().invoke(
        main, ["record", f"serial:{port.link}", "-o", str(tmp_path / "run.csv"), "--seconds", "0.2"]
    )
    assert (done.exit_code, "0 rows" in done.stderr) == (5, True)
