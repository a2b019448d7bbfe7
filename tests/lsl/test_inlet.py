"""Streams of other programs as a source: which stream, channels, unit, times, what goes wrong; and the library itself."""

import math
import sys
import threading
import time
from itertools import islice
from unittest.mock import Mock

import palpate
import pylsl
import pytest
from command_lines import run
from lsl_sender import PERIOD_S, Sender
from palpate import Sample, Source
from palpate.errors import DeviceNotFound, MissingExtra, ProtocolError
from palpate.source_events import GapCause
from palpate.sources import lsl as lsl_source
from palpate.sources.conformance import check_source
from palpate.sources.lsl import SAMPLES, Channels, LslOptions, ahead_ns, library
from recording_bench import SampleReader

FARADS = ("pF", "pF")


@pytest.fixture
def sender(name: str) -> Sender:
    return Sender(name, ("hard", "soft"), FARADS, rate=1 / PERIOD_S)


def received(source: Source, sender: Sender, *rows: tuple[float, ...]) -> list[Sample]:
    """Send rows, and return the samples that come of them."""
    with source:
        sender.wait()
        for row in rows:
            sender.send(*row)
        return list(islice(SampleReader(source), len(rows)))


def test_it_is_a_source(sender: Sender) -> None:
    source = palpate.open(f"lsl:{sender.name}")
    assert (source.describe()["stamps"], source.describe()["period_s"]) == ("host", PERIOD_S)
    with sender.going_on(6.9, 4.7):
        samples = check_source(source, samples=50, patience=10.0)
    assert {(sample.hard, sample.soft, sample.hard_raw) for sample in samples} == {(6.9, 4.7, -1)}
    assert [sample.seq for sample in samples] == list(range(50))


def test_a_stream_is_chosen_by_its_type(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    # the other one may answer late on a machine that is busy
    monkeypatch.setattr(lsl_source, "_OTHERS_S", 3.0)
    senders = [Sender(name, ("C1_nF", "x", "C2"), ("", "", "fF"), kind=kind) for kind in ("A", "B")]
    with pytest.raises(
        DeviceNotFound, match=r"2 streams have name .*\(A, on .*\), .*\(B, on .*\); choose one"
    ):
        palpate.open(f"lsl:{name}")
    source = palpate.open(f"lsl:{name}?type=B&hard=C1_nF&soft=3")
    [sample] = received(source, senders[1], (0.5, 7.0, 250.0))
    assert (sample.hard, sample.soft) == (500.0, 0.25)
    assert source.describe()["channels"] == {"hard": "C1_nF, nF", "soft": "C2, fF"}


def test_a_stream_that_is_not_there(name: str) -> None:
    with pytest.raises(
        DeviceNotFound, match=rf"no stream with name '{name}' answered within 0.2 s"
    ):
        palpate.open(f"lsl:{name}?wait=0.2")


@pytest.mark.parametrize(
    ("labels", "units", "options", "message"),
    [
        (
            ["", ""],
            ["pF", "pF"],
            {},
            "hard: got nothing, allowed: hard=LABEL or a position from 1, one of 1, 2",
        ),
        (
            ["a", "b"],
            ["pF", "pF"],
            {"hard": "a", "soft": "c"},
            r"soft: got 'c', .* one of 1 \(a\), 2 \(b\)",
        ),
        (["a", "b"], ["pF", "pF"], {"hard": "1", "soft": "3"}, "soft: got '3'"),
        (["a", "b"], ["pF", "pF"], {"hard": "b", "soft": "2"}, r"hard, soft: got 2 \(b\) for both"),
        (["C1", "C1", "C2"], ["pF"] * 3, {}, "hard: got nothing"),
        (["a", "a"], ["pF", "pF"], {"hard": "a", "soft": "2"}, "hard: got 'a'"),
        (["hard", "soft"], ["microvolts", ""], {}, "unit: the stream says 'microvolts' for hard"),
        (
            ["hard", "soft_V"],
            ["pF", ""],
            {"hard": "1", "soft": "2"},
            r"says '' for soft, channel 2 \(soft_V\)",
        ),
    ],
)
def test_channels_that_are_not_known(
    labels: list[str], units: list[str], options: dict[str, str], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        Channels(labels, units, LslOptions.parse("lsl", options))


def test_units() -> None:
    assert Channels(["C2_fF", "C1"], ["", "pF"], LslOptions()).values([1.0, 2.0]) == [2.0, 0.001]
    options = LslOptions(hard="hard", soft="1", unit="fF")
    assert Channels(["1", "hard"], ["V", "V"], options).values([2.0, 1.0]) == [0.001, 0.002]
    hard, soft = Channels(["hard", "soft"], FARADS, LslOptions()).values([math.inf, 5e-324])
    assert (math.isnan(hard), soft) == (True, 5e-324)


def test_only_palpates_own_stream_has_numbers() -> None:
    row = [1.0, 2.0, 0.5, 7.0, 4.0, 3.0]
    own = Channels(SAMPLES, [""] * 6, LslOptions(), is_own=True)
    other = Channels(SAMPLES, [""] * 6, LslOptions(), is_own=False)
    assert [own.own(row, name) for name in SAMPLES[2:]] == row[2:]
    assert [other.own(row, name) for name in SAMPLES[2:]] == [0] * 4
    for place, value in ((3, math.nan), (3, -1.0), (3, math.inf), (4, 8.0)):
        wrong = [value if i == place else cell for i, cell in enumerate(row)]
        with pytest.raises(ProtocolError, match=f"lsl: {SAMPLES[place]}: got"):
            own.own(wrong, SAMPLES[place], 0, 7)


def test_a_stream_of_text(name: str) -> None:
    sender = Sender(name, ("hard", "soft"), FARADS, form=pylsl.cf_string)
    with pytest.raises(ValueError, match="has no numbers"):
        palpate.open(f"lsl:{sender.name}")


def test_stamps_that_go_back_or_are_of_another_clock(sender: Sender) -> None:
    """One is refused and counted; many in a row end the measurement."""
    with palpate.open(f"lsl:{sender.name}") as source:
        sender.wait()
        begin_s = pylsl.local_clock()
        samples = SampleReader(source)
        for i in (0, 1, 2, -50, 1.99, 3):
            sender.send(i, 1.0, at_s=begin_s + i * 0.01)
        found = list(islice(samples, 5))
        assert [sample.hard for sample in found] == [
            0.0,
            1.0,
            2.0,
            1.99,
            3.0,
        ]  # a small step back is of the correction
        assert found[3].t_hard_ns == found[2].t_hard_ns
        assert source.counters["errors"] == 1
        for _ in range(100):
            sender.send(0.0, 1.0, at_s=begin_s - 1)
        with pytest.raises(ProtocolError, match="the time stamps of 100 samples in a row go back"):
            next(samples)
        sender.send(0.0, 1.0, at_s=begin_s + 700)
        with pytest.raises(ProtocolError, match="allowed: within 600 s of LSL's clock"):
            list(source)


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lsl_source, "_SILENT_S", 0.3)
    monkeypatch.setattr(lsl_source, "_LOOK_S", 0.3)


def test_a_stream_that_ends_and_comes_back(
    sender: Sender, quick: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(lsl_source, "_SILENT_S", 60.0)  # its connection shows the end
    heard: list[str] = []
    with palpate.open(f"lsl:{sender.name}") as source:
        source.notify = heard.append
        sender.wait()
        samples = SampleReader(source)
        sender.send(1.0, 1.0)
        assert next(samples).seq == 0
        sender.close()
        back: list[Sender] = []

        def come_back() -> None:
            back.append(Sender(sender.name, ("hard", "soft"), FARADS, rate=1 / PERIOD_S))
            back[0].wait()
            back[0].send(2.0, 1.0)

        returning = threading.Timer(0.5, come_back)
        returning.start()
        after = next(samples)
        returning.join()
    assert (after.seq, after.hard, source.counters["reconnects"]) == (1, 2.0, 1)
    assert [(seq, "was lost" in text) for seq, text in samples.gaps] == [(1, True)]
    assert samples.causes == [GapCause.DISCONNECTED]
    assert "was lost, or is silent. Waiting for it, up to 30 s." in heard[0]


def test_a_stream_that_does_not_come_back(sender: Sender, quick: None) -> None:
    with palpate.open(f"lsl:{sender.name}?replug=0.1") as source:
        sender.wait()
        sender.send(1.0, 1.0)
        samples = SampleReader(source)
        next(samples)
        sender.close()
        with pytest.raises(
            DeviceNotFound,
            match=f"lsl: the stream {sender.name} .* was lost: start its sender again",
        ):
            next(samples)


def test_a_stream_that_is_silent_is_looked_for_again(sender: Sender, quick: None) -> None:
    heard: list[str] = []
    with palpate.open(f"lsl:{sender.name}") as source:
        source.notify = heard.append
        sender.wait()
        with sender.going_on(1.0, 1.0, after_s=1.5):
            first = next(SampleReader(source))
    assert (first.seq, len(heard), source.counters["reconnects"]) == (0, 1, 1)
    assert "is silent" in heard[0]


@pytest.mark.parametrize("lost", [False, True])
def test_an_interruption_ends_waiting(sender: Sender, quick: None, lost: bool) -> None:
    with palpate.open(f"lsl:{sender.name}") as source:
        sender.wait()
        if lost:
            sender.close()
        reading = threading.Thread(target=list, args=[source])
        reading.start()
        time.sleep(0.3)
        source.interrupt()
        reading.join(25.0)  # it would wait for 30 s
        assert not reading.is_alive()


def test_the_senders_own_gaps_and_numbers(name: str) -> None:
    sender = Sender(
        name, SAMPLES, ("pF", "pF", "s", "none", "none", "none"), manufacturer="palpate"
    )
    rest = [(0.013, 7, 0, 1), (0.013, 9, 1, 1), (0.013, 10, 0, 2), (-0.5, 0, 0, 0)]
    source = palpate.open(f"lsl:{name}")
    with source:
        sender.wait()
        for row in rest:
            sender.send(1.0, 2.0, *row)
        reader = SampleReader(source)
        samples = list(islice(reader, len(rest)))
    assert [(sample.seq, sample.status) for sample in samples] == [(0, 0), (2, 1), (3, 0), (4, 0)]
    assert [sample.t_soft_ns - sample.t_hard_ns for sample in samples] == [13 * 10**6] * 3 + [
        -5 * 10**8
    ]
    assert reader.gaps == [(3, "the sender had a gap"), (4, "the sender began again")]
    assert reader.causes == [GapCause.UPSTREAM, GapCause.RESTARTED]


@pytest.fixture
def fresh(monkeypatch: pytest.MonkeyPatch) -> None:
    """Import the library anew in this test."""
    monkeypatch.setattr(lsl_source, "library", library.__wrapped__)


def test_devices_without_pylsl(fresh: None, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pylsl", None)
    line = "not searched: pylsl is not installed; type: pip install 'palpate[lsl]'"
    assert line in run("devices", "--lsl").stderr
    assert "pylsl" not in run("devices").stderr


def test_without_liblsl(fresh: None, monkeypatch: pytest.MonkeyPatch) -> None:
    missing = Mock(
        side_effect=RuntimeError("LSL binary library file was not found. Please ...\nmore")
    )
    monkeypatch.setattr("palpate.sources.lsl.need", missing)
    with pytest.raises(
        MissingExtra, match=r"pylsl finds no liblsl \(LSL binary library file was not found"
    ) as raised:
        lsl_source.library()
    assert "pip install --force-reinstall 'palpate[lsl]'" in str(raised.value)


def test_a_clock_that_is_another_one(monkeypatch: pytest.MonkeyPatch) -> None:
    """As on Windows, where Python before 3.13 counts ticks: the difference is measured; on Linux it is exactly 0."""
    monkeypatch.setattr(pylsl, "local_clock", lambda: time.monotonic() + 5.0)
    assert ahead_ns(pylsl) == pytest.approx(5 * 10**9, abs=10**7)
    monkeypatch.setattr(pylsl, "local_clock", time.monotonic)
    assert ahead_ns(pylsl) == 0
