"""What palpate sends: descriptions, samples, estimates, marks; and what it refuses to send."""

import json
import math
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import islice, pairwise
from pathlib import Path
from typing import Any

import numpy as np
import palpate
import pylsl
import pytest
from command_lines import document, run
from lsl_sender import Listener, Sender, take_all
from palpate import Stream
from palpate.samples import block_of, feed
from palpate.stream import Batch, lsl_outlets
from palpate.stream.lsl_outlets import Outlets
from recording_bench import SampleReader, Scripted, four, soon, with_gaps

MANY = 5000
"""Marks: more than a connection takes at once."""


@contextmanager
def listening(name: str) -> Iterator[dict[str, Listener]]:
    """Begin to listen to the three streams of a name; at the end take what came."""
    found = {key: Listener(f"{name}{key}") for key in ("", "-estimates", "-marks")}
    yield found
    take_all(*found.values())


def marks(listener: Listener) -> list[tuple[str, str]]:
    return [(text.partition(" ")[0], text.partition(" ")[2]) for [text] in listener.rows]


def test_descriptions(name: str) -> None:
    stream = Stream("sim:stiff-steady?speed=1")
    with Outlets(stream, name) as outlets, listening(name) as found:
        assert outlets
    stream.close()
    forms = {
        "Capacitance": pylsl.cf_double64,
        "Estimate": pylsl.cf_double64,
        "Markers": pylsl.cf_string,
    }
    for (key, listener), (kind, form) in zip(found.items(), forms.items(), strict=True):
        told = (listener.info.type(), listener.info.nominal_srate(), listener.info.channel_format())
        assert told == (kind, 0.0, form)
        assert listener.info.source_id() == f"palpate {name}{key} {socket.gethostname()}"
    samples = found[""].info
    assert samples.get_channel_labels() == [
        "hard_pF",
        "soft_pF",
        "soft_offset_s",
        "seq",
        "status",
        "gaps",
    ]
    assert samples.get_channel_units() == ["pF", "pF", "s", "none", "none", "none"]
    assert samples.get_channel_types() == [
        "Capacitance",
        "Capacitance",
        "Time",
        "Misc",
        "Misc",
        "Misc",
    ]
    assert found["-estimates"].info.get_channel_labels() == [
        "ratio",
        "standard_error",
        "contact",
        "touch",
        "alarm",
    ]
    device = stream.source.describe()
    acquisition = samples.desc().child("acquisition")
    said = {key: device[key] for key in ("period_s", "full_scale_pF", "stamps")} | {
        "version": palpate.__version__
    }
    assert {key: acquisition.child_value(key) for key in said} == {
        key: str(value) for key, value in said.items()
    }


class Lab(Scripted):
    """Four touches, with samples that are lost, without a value, saturated, and a gap between the second and the third."""

    def __init__(self) -> None:
        samples = four()
        samples[40] = samples[40]._replace(hard=math.nan, hard_raw=-1, status=8)
        samples[41] = samples[41]._replace(
            hard=math.nan, hard_raw=-1, soft=math.nan, soft_raw=-1, status=8
        )
        middle = next(each.seq for each in samples if each.t_hard_ns > 19e9)
        self.gap_seq = middle
        super().__init__(
            with_gaps(samples, {middle: "unplugged for 1.5 s"}),
            live=True,
            full_scale_pF=4.0957,
            period_s=0.026,
        )
        self.begun_ns = time.monotonic_ns()

    @property
    def zero_ns(self) -> int:
        return self.begun_ns


def sent_from(stream: Stream, outlets: Outlets) -> tuple[list[Any], list[Any]]:
    """Send a whole measurement; return its samples, and the rows of its tracker."""
    samples = []
    rows = []
    with stream:
        for batch in stream.batches():
            samples += batch.samples.tolist()
            rows += batch.rows.tolist()
    return samples, rows


def test_each_sample_is_sent_once_with_its_stamp_and_each_mark_at_its_sample(name: str) -> None:
    """A touch is sent with all digits, and again when it is revised."""
    source = Lab()
    stream = Stream(source, capacity=4096)
    with Outlets(stream, name) as outlets, listening(name) as found:
        outlets.mark("note", "specimen 70 OO")
        sent, rows = sent_from(stream, outlets)
        outlets.mark("tare")
        nothing = block_of([])
        outlets.batch(
            Batch(nothing, feed(stream.tracker, nothing), [], 5, [(1, stream.touches[0])])
        )
    samples = found[""]
    estimates = found["-estimates"]
    assert len(sent) == len(source.script) - 1
    # A double has 2**-30 s at a time of 10**7 s since the start of the computer.
    assert samples.stamps == pytest.approx(
        [(source.zero_ns + s[1]) / 1e9 for s in sent], abs=1e-9, rel=0
    )
    expected = [[s[5], s[6], (s[2] - s[1]) / 1e9, s[0], s[7], s[0] >= source.gap_seq] for s in sent]
    np.testing.assert_array_equal(samples.rows, np.array(expected, float))
    assert estimates.stamps == samples.stamps
    shown = [[*(row[:2] if row[4] > 0 else [math.nan] * 2), row[3], row[4], row[2]] for row in rows]
    np.testing.assert_array_equal(estimates.rows, np.array(shown, float))
    stamp_s = [(source.zero_ns + s[1]) / 1e9 for s in sent]
    told = list(zip(found["-marks"].stamps, marks(found["-marks"]), strict=True))
    assert (stamp_s[0], ("note", "specimen 70 OO")) in told
    assert told[-2] == (stamp_s[-1], ("tare", ""))
    assert (told[-1][0], told.pop()[1][0]) == (stamp_s[-1], "revised")
    gap_at = next(i for i, s in enumerate(sent) if s[0] >= source.gap_seq)
    assert (stamp_s[gap_at], ("gap", "unplugged for 1.5 s")) in told
    check_touches(
        [(t, json.loads(text)) for t, (word, text) in told if word == "touch"],
        stream,
        "first_ratio",
        source,
    )
    check_touches(
        [(t, json.loads(text)) for t, (word, text) in told if word == "revised"],
        stream,
        "ratio",
        source,
    )
    ends = {row[4]: t for t, row in zip(stamp_s, rows, strict=True) if row[4]}
    assert [t for t, (word, _) in told if word == "touch"] == list(ends.values())
    revisions = [t for t, row in zip(stamp_s, rows, strict=True) if row[-1]]
    assert [t for t, (word, _) in told if word == "revised"] == revisions


def check_touches(
    found: list[tuple[float, dict[str, Any]]], stream: Stream, result: str, source: Lab
) -> None:
    """Compare the marks of touches with the touches themselves."""
    touches = [touch for touch in stream.touches if result == "first_ratio" or touch.revised]
    assert len(touches) >= 3
    said = [(mark["ratio"], mark["samples"]) for _, mark in found]
    assert said == [(getattr(touch, result), touch.samples) for touch in touches]
    begun_s = [mark["start"] for _, mark in found]
    assert begun_s == pytest.approx(
        [source.zero_ns / 1e9 + touch.start_s for touch in touches], abs=1e-8, rel=0
    )


class PatientClock:
    """Stands for the module time: a sleep of the outlets ends when all marks have come."""

    def __init__(self, listener: Listener) -> None:
        self.listener = listener

    def sleep(self, _: float) -> None:
        soon(self.has_all)

    def has_all(self) -> bool:
        self.listener.take()
        notes = [kind for kind, _ in marks(self.listener) if kind == "note"]
        return len(notes) == MANY


def test_nothing_is_lost_at_the_end(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Liblsl drops what is on its way when an outlet is closed: palpate waits before."""
    assert 0.5 <= lsl_outlets._LAST_S < 1
    stream = Stream(Lab(), capacity=4096)
    with Outlets(stream, name) as outlets:
        listener = Listener(f"{name}-marks")
        sent_from(stream, outlets)
        for number in range(MANY):
            outlets.mark("note", f"{number} {'x' * 1000}")
        monkeypatch.setattr(lsl_outlets, "time", PatientClock(listener))
        outlets.close()
    numbers = [int(text.split()[0]) for kind, text in marks(listener) if kind == "note"]
    assert numbers == list(range(MANY))


@pytest.mark.parametrize(
    "source", ["sim:stiff-steady", "sim:stiff-steady?speed=2", "tests/data/four-specimens.csv"]
)
def test_times_that_are_not_those_of_a_clock(source: str, tmp_path: Path) -> None:
    assert_refused(
        tmp_path, source, "--lsl", words="lsl: got a source whose times are not those of a clock"
    )


@pytest.mark.parametrize("given", [["--lsl", "usb:"], ["--lsl="]])
def test_names_that_are_refused(given: list[str], tmp_path: Path) -> None:
    assert_refused(tmp_path, "sim:", *given, words="allowed: a name without a colon")


def assert_refused(folder: Path, *given: str, words: str) -> None:
    done = run("record", *given, "-o", folder / "a.csv")
    assert (done.exit_code, words in done.stderr, list(folder.iterdir())) == (2, True, [])


def test_tares_and_marks_of_the_page_and_the_next_measurement(name: str, tmp_path: Path) -> None:
    """A receiver stays connected when Measure again is pressed."""
    from live_bench import begun

    bench = begun("sim:stiff-steady?speed=1&seed=1&idle=30", tmp_path, lsl=name)
    session = bench.measurement
    try:
        with listening(name) as found:
            soon(lambda: session.stream.counters.delivered >= 5)
            bench.obey("mark")
            bench.obey("tare")
            time.sleep(0.3)
            session.stream.stop()
            soon(lambda: not session.running)
            bench.obey("again")
            soon(lambda: session.stream.counters.delivered >= 5)
    finally:
        session.close()
    assert {("mark", ""), ("tare", "")} <= set(marks(found["-marks"]))
    assert any(later[3] < earlier[3] for earlier, later in pairwise(found[""].rows)), (
        "the second measurement"
    )
    assert all(later > earlier for earlier, later in pairwise(found[""].stamps))


def test_live_sends_too(name: str, tmp_path: Path) -> None:
    command = [
        sys.executable,
        "-m",
        "palpate",
        "live",
        "sim:",
        "--lsl",
        name,
        "--no-open",
        "--port",
        "0",
    ]
    with subprocess.Popen(
        command, cwd=tmp_path, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    ) as live:
        try:
            with palpate.open(f"lsl:{name}?wait=60") as source:
                assert [sample.seq for sample in islice(SampleReader(source), 5)] == [0, 1, 2, 3, 4]
        finally:
            live.terminate()


def test_devices_lists_streams(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also one whose name would write to the terminal."""
    monkeypatch.setattr("palpate.sources.lsl._OTHERS_S", 3.0)
    monkeypatch.setattr("palpate.sources.devices._STREAMS_S", 30.0)
    evil = Sender(f"{name}\x1b[2J", ("a", "b"))
    stream = Stream("sim:stiff-steady?speed=1")
    with Outlets(stream, name):
        found = {
            device["uri"]: device["what"] for device in document("devices", "--lsl")["devices"]
        }
    stream.close()
    evil.close()
    assert "6 channels" in found[f"lsl:{name}"]
    assert f"lsl:{name}-marks" not in found
    assert f"lsl:{name}\\x1b[2J" in found
