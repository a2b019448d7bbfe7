"""Names of sources, their options, and what each gives."""

import re
import threading
import time
from pathlib import Path
from typing import Any

import palpate
import pytest
from palpate.ad7746 import registers
from palpate.ad7746.bus import VirtualClock
from palpate.ad7746.simulator.usb_backend import SimulatedUsb
from palpate.errors import DeviceNotFound, RecordingError
from palpate.sources.playback import FileSource
from project import FOUR
from recording_bench import SampleReader


@pytest.mark.parametrize(
    ("uri", "options", "message"),
    [
        (
            "moon:",
            {},
            "source: got moon:, allowed: demo:, i2c:, iio:, lsl:, serial:, sim:, usb: or a path",
        ),
        ("sim:moon", {}, "sim: got scenario 'moon', allowed: soft-steady"),
        ("sim:all?sed=1", {}, "sim: got option 'sed', allowed: capf, excitation, level, chop"),
        ("sim:all?seed=x", {}, "seed: got 'x', allowed: a whole number from 0 to"),
        ("sim:all?speed=0", {}, "speed: got '0', allowed: a number above 0 to 1000"),
        ("sim:all?speed=nan", {}, "speed: got 'nan'"),
        ("sim:all?capf=8", {}, "capf: got '8', allowed: a whole number from 0 to 7"),
        ("sim:all?capf", {}, "source: got 'capf', allowed: NAME=VALUE, each name once"),
        ("sim:all?capf=1&capf=2", {}, "source: got 'capf=2', allowed: NAME=VALUE, each name once"),
        ("sim:all?capf=1", {"capf": 2}, "source: got capf twice"),
        (
            "sim:all?fault=fire@3",
            {},
            "fault: got 'fire@3', allowed: KIND[:AMOUNT]@SECONDS, KIND one of no-answer",
        ),
        ("sim:all?fault=stall:x@3", {}, "fault: got amount 'x'"),
        ("sim:all?fault=stall@soon", {}, "fault's time: got 'soon'"),
        (
            "sim:tap",
            {"excitation": "C"},
            "excitation: got 'C', allowed: A, B, AB, or two of them: HARD,SOFT as B,A",
        ),
        (
            "sim:tap",
            {"hard_input": 2, "soft_input": 2},
            "soft_input: got 2, as hard_input, allowed: the other one",
        ),
        ("sim:tap", {"wiring": "wrong"}, "wiring: got 'wrong', allowed: guide, exca"),
        ("usb:left", {}, "usb: got address 'left', allowed: BUS/ADDRESS"),
        ("usb:?seed=1", {}, "usb: got option 'seed', allowed: capf, excitation, level, chop"),
        ("i2c:", {}, "i2c: got no address"),
        ("iio:x", {"hard_input": 3}, "hard_input: got 3, allowed: a whole number from 1 to 2"),
        ("serial:", {}, "serial: got no port, allowed: serial:PORT"),
        ("serial:x?reset=maybe", {}, "reset: got 'maybe', allowed: 1, 0, true, false, yes, no"),
        ("serial:x?columns=hard", {}, "allowed: names of all cells in order"),
        ("serial:x?columns=hard,soft,hard", {}, "hard is there twice"),
        ("serial:x?columns=hard,soft,t_hard_us", {}, "both times t_hard and t_soft"),
        ("serial:x?columns=t_ms,hard_V,soft", {}, "what is 'hard_V'"),
        (
            "serial:x?columns=hard,soft&pattern=(?P<hard>.)(?P<soft>.)",
            {},
            "columns: got a pattern, too",
        ),
        ("serial:x?pattern=(", {}, "allowed: a regular expression"),
        ("serial:x?pattern=(?P<hard>.)", {}, "allowed: groups"),
        ("serial:x?unit=kF", {}, "unit: got 'kF', allowed: aF, fF, pF"),
        (
            "serial:x?unit=-1",
            {},
            "unit (aF, fF, pF, nF, uF, µF, μF, mF, F, or pF of one count): got '-1'",
        ),
        ("serial:x?baud=49", {}, "allowed: a whole number from 50 to 4000000"),
        ("lsl:", {}, "lsl: got no stream, allowed: lsl:NAME or"),
        ("lsl:?unit=pf", {}, "unit: got 'pf', allowed: aF"),
        ('lsl:a"b', {}, "name: got 'a\"b', allowed: no text with double quotes"),
        ("run.csv", {"speed": 0}, "speed: got 0"),
        (
            "run.csv",
            {"seed": 1},
            "file: got option 'seed', allowed: columns, unit, time_unit, rate, decimal",
        ),
    ],
)
def test_what_is_refused(uri: str, options: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=re.escape(message)):
        palpate.open(uri, **options)


def test_paths(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("usb2:run.csv").write_text(FOUR.read_text())
    for uri in (str(FOUR), "usb2:run.csv"):
        with palpate.open(uri) as source:
            assert isinstance(source, FileSource)
            assert len(list(SampleReader(source))) == 1411
    for uri in ("nowhere.csv", str(tmp_path), r"C:\nowhere.csv"):
        with pytest.raises(RecordingError, match="cannot be read"):
            palpate.open(uri)


def test_a_file_at_its_own_pace() -> None:
    with palpate.open(str(FOUR), speed=1000) as source:
        begun = time.monotonic()
        assert (source.live, len(list(SampleReader(source)))) == (True, 1411)
        assert time.monotonic() - begun > 0.03
    with palpate.open(str(FOUR), speed=0.001) as slow:
        samples = SampleReader(slow)
        assert next(samples).seq == 0
        threading.Timer(0.1, slow.interrupt).start()
        assert list(samples) == []


def test_a_simulated_board_is_the_same_again() -> None:
    runs = []
    for seed in (1, 1, 2):
        with palpate.open("sim:soft-steady", seed=seed, capf=2) as source:
            assert not source.live
            runs.append(list(SampleReader(source)))
            described = source.describe()
    assert runs[0] == runs[1] != runs[2]
    expected = {
        "scenario": "soft-steady",
        "seed": 2,
        "speed": "as fast as possible",
        "wiring": "guide",
    }
    assert described["simulated"] == expected
    assert described["configuration"]["capf"] == 2
    assert described["full_scale_pF"] == registers.SATURATED_PF
    assert runs[0][-1].t_soft_ns == pytest.approx(10.4e9, abs=0.2e9)


def test_no_board() -> None:
    with pytest.raises(DeviceNotFound, match="no AD7746 evaluation kit"):
        palpate.open("usb:", backend=SimulatedUsb(VirtualClock()))
    with pytest.raises(DeviceNotFound, match="/dev/i2c-99"):
        palpate.open("i2c:/dev/i2c-99")
