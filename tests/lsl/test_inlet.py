"""Streams of other programs as a source: which stream, which channels, which unit, which times, and what goes wrong."""

import math
import threading
import time
from collections.abc import Iterator
from itertools import islice
from typing import Any

import palpate
import pylsl
import pytest
from lsl_sender import PERIOD_S, Sender
from palpate import DeviceNotFound, Gap, ProtocolError, Sample, Source, Status
from palpate.sources.lsl import finding
from palpate.sources.lsl import source as lsl_source
from palpate.sources.lsl.channels import Asked, Channels
from palpate.sources.lsl.library import SAMPLES
from palpate.testing import check_source

FARADS = ("picofarads", "picofarads")


@pytest.fixture
def sender(name: str) -> Sender:
    return Sender(name, ("hard", "soft"), FARADS, rate=1 / PERIOD_S)


def received(source: Source, sender: Sender, *rows: tuple[float, ...], step_s: float = PERIOD_S) -> list[Sample]:
    """Send rows, `step_s` apart from now on, and return the samples that come of them."""
    with source:
        sender.wait()
        begin_s = pylsl.local_clock()
        for i, row in enumerate(rows):
            sender.send(*row, at_s=begin_s + i * step_s)
        return list(islice(source, len(rows)))


def test_it_is_a_source(sender: Sender) -> None:
    with sender.going_on(6.9, 4.7):
        samples = check_source(f"lsl:{sender.name}", samples=50, patience=10.0)
    assert {(sample.hard, sample.soft, sample.hard_raw) for sample in samples} == {(6.9, 4.7, -1)}
    assert [sample.seq for sample in samples] == list(range(50))


def test_times_are_the_stamps_and_values_the_same_bits(sender: Sender) -> None:
    rows = [(1 / 3, math.pi), (math.nan, 2.0), (5e-324, -1.0), (math.inf, 1.0)]
    source = palpate.open(f"lsl:{sender.name}")
    before = time.monotonic_ns()
    samples = received(source, sender, *rows)
    assert source.zero_ns is not None
    assert source.zero_ns < before < source.zero_ns + samples[0].t_hard_ns < time.monotonic_ns()
    assert [sample.t_hard_ns - samples[0].t_hard_ns for sample in samples] == pytest.approx(
        [0, 10**7, 2 * 10**7, 3 * 10**7], abs=1
    )
    assert all(sample.t_soft_ns == sample.t_hard_ns for sample in samples)
    assert [sample[5:7] for sample in samples[::2]] == [rows[0], rows[2]]
    assert [sample.status for sample in samples] == [0, Status.LOST, 0, Status.LOST]
    assert math.isnan(samples[3].hard)
    assert samples[1].soft == 2.0
    assert source.describe()["stamps"] == "host"
    assert source.describe()["period_s"] == PERIOD_S


def test_a_stream_is_chosen_by_its_type(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(finding, "_OTHERS_S", 3.0)  # the other one may answer late on a machine that is busy
    senders = [Sender(name, ("C1_nF", "x", "C2"), ("", "", "fF"), kind=kind) for kind in ("A", "B")]
    with pytest.raises(DeviceNotFound, match=r"2 streams have name .*\(A, on .*\), .*\(B, on .*\); choose one"):
        palpate.open(f"lsl:{name}")
    with pytest.raises(ValueError, match="lsl: map: got option 'time', allowed: hard, soft"):
        palpate.open(f"lsl:{name}?map=hard=C1_nF,soft=3,time=2")
    palpate.open(f"lsl:{name}?type=B&map=hard%3DC1_nF,soft%3D3").close()
    source = palpate.open(f"lsl:{name}?type=B&hard=C1_nF&soft=3")
    [sample] = received(source, senders[1], (0.5, 7.0, 250.0))
    assert (sample.hard, sample.soft) == (500.0, 0.25)
    assert source.describe()["channels"] == {"hard": "C1_nF, nF", "soft": "C2, fF"}


def test_a_stream_that_is_not_there(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    limits, plain = list[float](), finding.search

    def search(wanted: Any, limit_s: float) -> Any:
        limits.append(limit_s)
        return plain(wanted, limit_s)

    monkeypatch.setattr(finding, "search", search)
    with pytest.raises(DeviceNotFound, match=rf"no stream with name '{name}' answered within 0.2 s"):
        palpate.open(f"lsl:{name}?wait=0.2")
    assert limits == [0.2]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ("", "lsl: got no stream, allowed: lsl:NAME or"),
        ("?unit=m", "unit: got 'm', allowed: aF"),
        ("?wait=-1", "wait: got '-1'"),
        ("?stamps=mine", "stamps: got 'mine', allowed: converter, host"),
        ("?colour=red", "lsl: got option 'colour', allowed: type, source_id, host, hard"),
        ("a'\"b", "name: got .*, allowed: no text with both kinds of quotes"),
    ],
)
def test_wrong_options(options: str, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        palpate.open(f"lsl:{options}")


@pytest.mark.parametrize(
    ("labels", "units", "asked", "message"),
    [
        (
            ["", ""],
            ["pF", "pF"],
            Asked(),
            "hard: got nothing, allowed: hard=LABEL or a position from 1, one of 1, 2",
        ),
        (["a", "b"], ["pF", "pF"], Asked("a", "c"), r"soft: got 'c', .* one of 1 \(a\), 2 \(b\)"),
        (["a", "b"], ["pF", "pF"], Asked("1", "3"), "soft: got '3'"),
        (["a", "b"], ["pF", "pF"], Asked("1", "9" * 5000), "soft: got '999"),
        (["a", "b"], ["pF", "pF"], Asked("b", "2"), r"hard, soft: got 2 \(b\) for both"),
        (["C1", "C1", "C2"], ["pF"] * 3, Asked(), "hard: got nothing"),
        (["a", "a"], ["pF", "pF"], Asked("a", "2"), "hard: got 'a'"),
        (["hard", "soft"], ["microvolts", ""], Asked(), "unit: the stream says 'microvolts' for hard"),
        (["hard", "soft_V"], ["pF", ""], Asked("1", "2"), r"unit: the stream says '' for soft, channel 2 \(soft_V\)"),
    ],
)
def test_channels_that_are_not_known(labels: list[str], units: list[str], asked: Asked, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Channels(labels, units, asked)


def test_units() -> None:
    for units in (["nF", "nanofarad"], ["NanoFarads", "nF"]):
        assert Channels(["hard", "soft"], units, Asked()).values([1.0, 2.0]) == (1000.0, 2000.0)
    assert Channels(["CIN2 (fF)", "CIN1"], ["", "pF"], Asked()).values([1.0, 2.0]) == (2.0, 0.001)
    assert Channels(["1", "hard"], ["V", "V"], Asked("hard", "1", "fF")).values([2.0, 1.0]) == (0.001, 0.002)


def test_only_palpates_own_stream_has_numbers() -> None:
    row = [1.0, 2.0, 0.5, 7.0, 4.0, 3.0]
    own, other = (Channels(SAMPLES, [""] * 6, Asked(), own) for own in (True, False))
    assert (own.offset_ns(row), own.count(row, "seq"), own.status(row, (1.0, 2.0))) == (5 * 10**8, 7, 4)
    assert (other.offset_ns(row), other.count(row, "seq"), other.status(row, (1.0, 2.0))) == (0, None, 0)
    for place, value in ((2, math.nan), (3, -1.0), (3, math.inf), (4, 8.0), (5, 0.5)):
        wrong = [value if i == place else cell for i, cell in enumerate(row)]
        with pytest.raises(ProtocolError, match=f"lsl: {SAMPLES[place]}: got"):
            _ = own.offset_ns(wrong), own.count(wrong, "seq"), own.status(wrong, (1.0, 2.0)), own.count(wrong, "gaps")


def test_a_stream_of_text(name: str) -> None:
    sender = Sender(name, ("hard", "soft"), FARADS, form=pylsl.cf_string)
    with pytest.raises(ValueError, match="has no numbers"):
        palpate.open(f"lsl:{sender.name}")


def test_stamps_that_go_back(sender: Sender) -> None:
    """One is refused and counted; many in a row end the measurement."""
    with palpate.open(f"lsl:{sender.name}") as source:
        sender.wait()
        begin_s, samples = pylsl.local_clock(), iter(source)
        for i in (0, 1, 2, -50, 3):
            sender.send(i, 1.0, at_s=begin_s + i * 0.01)
        assert [sample.hard for sample in islice(samples, 4)] == [0.0, 1.0, 2.0, 3.0]
        assert source.counters["errors"] == 1
        for _ in range(100):
            sender.send(0.0, 1.0, at_s=begin_s - 1)
        with pytest.raises(ProtocolError, match="the time stamps of 100 samples lie before"):
            next(samples)


def test_stamps_of_another_clock(sender: Sender) -> None:
    heard: list[str] = []
    with palpate.open(f"lsl:{sender.name}") as source:
        source.notify = heard.append
        sender.wait()
        for at_s in (1.0, 1.5):
            sender.send(1.0, 1.0, at_s=at_s)
        first, second = islice(source, 2)
    assert 0 < first.t_hard_ns < 60e9
    assert second.t_hard_ns - first.t_hard_ns == 5 * 10**8
    assert len(heard) == 1
    assert "s from LSL's clock: the first one is taken as its arrival" in heard[0]


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lsl_source, "_SILENT_S", 0.3)
    monkeypatch.setattr(lsl_source, "_LOOK_S", 0.3)


def test_a_stream_that_ends_and_comes_back(sender: Sender, quick: None, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lsl_source, "_SILENT_S", 60.0)  # its end is told by its connection
    heard: list[str] = []
    with palpate.open(f"lsl:{sender.name}") as source:
        source.notify = heard.append
        sender.wait()
        samples: Iterator[Sample] = iter(source)
        sender.send(1.0, 1.0)
        assert next(samples).seq == 0
        sender.close()
        back: list[Sender] = []

        def come_back() -> None:
            time.sleep(0.5)
            back.append(Sender(sender.name, ("hard", "soft"), FARADS, rate=1 / PERIOD_S))
            back[0].wait()
            back[0].send(2.0, 1.0)

        returning = threading.Thread(target=come_back)
        returning.start()
        after = next(samples)
        returning.join()
    assert after.hard == 2.0
    assert after.seq > 0.4 / PERIOD_S  # the nominal rate says how many are missing
    assert source.counters["reconnects"] == 1
    [gap] = source.gaps
    assert gap.seq == after.seq
    assert "was away for" in gap.text
    assert "was lost. Waiting for it, up to 30 s." in heard[0]


def test_a_stream_that_does_not_come_back(name: str, quick: None) -> None:
    sender = Sender(name, ("hard", "soft"), FARADS)
    with palpate.open(f"lsl:{name}?replug=0.1") as source:
        sender.wait()
        sender.send(1.0, 1.0)
        samples = iter(source)
        next(samples)
        sender.close()
        with pytest.raises(DeviceNotFound, match=f"lsl: the stream {name} .* was lost: start its sender again"):
            next(samples)


@pytest.mark.parametrize("alive", [True, False])
def test_silence(sender: Sender, quick: None, alive: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """It is said once; and a stream that does not answer any more, though its connection stands, is lost."""
    heard: list[str] = []
    with palpate.open(f"lsl:{sender.name}?replug=0.1") as source:
        source.notify = heard.append
        sender.wait()
        if not alive:
            monkeypatch.setattr(lsl_source, "search", lambda *_, **__: [])
        if alive:
            monkeypatch.setattr(lsl_source, "_LOOK_S", 60.0)  # it ends with the answer
            source.notify = lambda text: (heard.append(text), source.interrupt())  # type: ignore[assignment,func-returns-value]
            assert list(source) == []
            assert len(heard) == 1
            assert "sends no sample for 0.3 s" in heard[0]
        else:
            with pytest.raises(DeviceNotFound, match="was lost"):
                list(source)


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
    sender = Sender(name, SAMPLES, ("pF", "pF", "s", "none", "none", "none"), manufacturer="palpate")
    rows = [
        (1.0, 2.0, 0.013, 7, 0, 1), (1.1, 2.0, 0.013, 9, 1, 1), (1.2, 2.0, 0.013, 10, 0, 2), (1.3, 2.0, -0.5, 0, 0, 0)
    ]  # fmt: skip
    source = palpate.open(f"lsl:{name}")
    samples = received(source, sender, *rows)
    assert [(sample.seq, sample.hard, sample.status) for sample in samples] == [
        (0, 1.0, 0), (2, 1.1, 1), (3, 1.2, 0), (4, 1.3, 0)
    ]  # fmt: skip
    assert [sample.t_soft_ns - sample.t_hard_ns for sample in samples] == [13 * 10**6] * 3 + [-5 * 10**8]
    assert source.gaps == [Gap(3, "the sender had a gap"), Gap(4, "the sender began again")]
