"""A serial port that is a pseudo-terminal: options, unplugging, a second program."""

import os
import threading
import tty
from collections.abc import Iterator
from pathlib import Path

import palpate
import pytest
from command_lines import run
from palpate import Stream
from palpate.errors import DeviceNotFound, DeviceRefused
from palpate.recording.reading import recorded
from palpate.source_events import GapCause
from recording_bench import SampleReader

pytest.importorskip("pty")


class Port:
    """The microcontroller's end, and the name of the computer's."""

    def __init__(self, link: Path) -> None:
        self.link = link
        self.plug()

    def plug(self) -> None:
        self.end, self._other = os.openpty()
        tty.setraw(self._other)
        self.link.symlink_to(os.ttyname(self._other))

    def unplug(self) -> None:
        self.link.unlink()
        os.close(self.end)
        os.close(self._other)

    def write(self, text: str) -> None:
        os.write(self.end, text.encode())


@pytest.fixture
def port(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Port]:
    monkeypatch.setattr("palpate.sources.serial.SETTLE_S", 0.3)
    made = Port(tmp_path / "tty")
    yield made
    made.unplug()


def test_the_description_waits_for_the_first_lines(port: Port) -> None:
    line = "t_hard_us={0}000,t_soft_us={0}500,hard_raw=8388608,soft_raw=8400000\n"
    with palpate.open(f"serial:{port.link}") as source:
        port.write("\n" + line.format(1) + line.format(2))
        assert (source.describe()["stamps"], source.describe()["columns"][0]) == (
            "converter",
            "t_hard us",
        )
        first, second = (sample for _, sample in zip(range(2), SampleReader(source), strict=False))
        assert (second.t_hard_ns - first.t_hard_ns, first.t_soft_ns - first.t_hard_ns) == (
            1_000_000,
            500_000,
        )
    with palpate.open(f"serial:{port.link}") as source:
        assert source.describe()["stamps"] == "host"
        port.write("\n" + line.format(1) + line.format(2))
        late = next(SampleReader(source))
        assert late.t_soft_ns == late.t_hard_ns  # as described: the arrival
    with palpate.open(f"serial:{port.link}?columns=t_ms,hard,soft") as source:
        assert source.describe()["stamps"] == "converter"


def test_options_in_the_name(port: Port, tmp_path: Path) -> None:
    uri = f"serial:{port.link}?pattern=h=(?P<hard>\\d+) s=(?P<soft>\\d+)&unit=fF&baud=9600"
    with Stream(uri, record=tmp_path / "run.csv") as stream:
        port.write("\nh=1000 s=2000\n")
        sample = next(iter(stream)).sample
    assert (sample.hard, sample.soft, stream.source.describe()["baud"]) == (1.0, 2.0, 9600)
    again = recorded(tmp_path / "run.csv")
    settings = stream.tracker.settings["host_stamps"], again.host_stamps, again.full_scale_pF
    assert settings == (True, True, float("inf"))


def test_unplugged_and_back(port: Port) -> None:
    said: list[str] = []
    with palpate.open(f"serial:{port.link}") as source:
        source.notify = said.append
        samples = SampleReader(source)
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
    assert (after.seq, after.hard, after.soft) == (5, 3, 4)
    assert source.counters == {"errors": 0, "lost": 0, "reconnects": 1}
    assert [seq for seq, _ in samples.gaps] == [5]
    assert samples.causes == [GapCause.DISCONNECTED]
    assert "was unplugged. Waiting" in said[1]
    assert after.t_hard_ns > first[-1].t_hard_ns + 300_000_000


def test_unplugged_for_good(port: Port) -> None:
    with palpate.open(f"serial:{port.link}?replug=0.2") as source:
        samples = SampleReader(source)
        port.write("\nC1=1 C2=2\n")
        next(samples)
        port.unplug()
        with pytest.raises(DeviceNotFound, match="was unplugged: plug it in again"):
            next(samples)
    port.plug()


def test_it_stops_while_the_port_is_silent_or_away(port: Port) -> None:
    for away in (False, True):
        with Stream(f"serial:{port.link}") as stream:
            if away:
                port.unplug()
            threading.Timer(0.2, stream.stop).start()
            assert list(stream) == []
        if away:
            port.plug()


def test_a_port_that_cannot_be_opened(port: Port) -> None:
    """Of two readers each would get a part of each line: `6.92` becomes `6.9`, which is a number, too."""
    with pytest.raises(DeviceNotFound, match="`palpate devices` lists the ports"):
        palpate.open("serial:/dev/ttyNothing7")
    with (
        palpate.open(f"serial:{port.link}"),
        pytest.raises(DeviceRefused, match="another program reads it"),
    ):
        palpate.open(f"serial:{port.link}")
    palpate.open(f"serial:{port.link}").close()  # free again


def test_without_reset_the_modem_lines_stay_inactive(
    port: Port, monkeypatch: pytest.MonkeyPatch
) -> None:
    import serial

    seen = []
    monkeypatch.setattr(serial.Serial, "open", lambda made: seen.append((made.dtr, made.rts)))
    for reset in ("yes", "no"):
        palpate.open(f"serial:{port.link}?reset={reset}").close()
    assert seen == [(True, True), (False, False)]


def test_record_ends_by_the_clock_without_a_sample(
    port: Port, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("palpate.cli.record._GRACE_S", 0.1)
    done = run("record", f"serial:{port.link}", "-o", tmp_path / "run.csv", "--seconds", "0.2")
    assert (done.exit_code, "0 rows" in done.stderr) == (5, True)
    assert "no line came: check the board, and the baud rate, 115200" in done.stderr
    timer = threading.Timer(0.2, port.write, ["\n" + "C1=1 C2=2\n" * 3])
    timer.start()
    done = run(
        "record",
        f"serial:{port.link}?pattern=(?P<hard>.);(?P<soft>.)",
        "-o",
        tmp_path / "b.csv",
        "--seconds",
        "1",
    )
    assert (
        "lines not read: 3. The last: 'C1=1 C2=2'. Reason: it does not match the pattern as a whole"
        in done.stderr
    )
