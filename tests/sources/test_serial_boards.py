"""Boards that count, stamp, restart, and sum what they send."""

import math
from itertools import pairwise

import pytest
from palpate import Gap, ProtocolError, Sample, Status
from palpate.sources.serial.cells import Refused
from palpate.sources.serial.numbering import Numbering, Place
from serial_lines import Sent

LINE = "seq={},t_hard_us={},t_soft_us={},hard_raw={},soft_raw=8400000,capdac_hard={},capdac_soft=9,status={}"
SECOND = 10**9


def line(seq: int, t_us: int, capdac: int = 5, code: int = 8388608, status: int = 0) -> str:
    """Return a line of the palpate format with its checksum."""
    text = LINE.format(seq, t_us % 2**32, (t_us + 15_000) % 2**32, code, capdac, status)
    return f"{text}*{checksum(text)}"


def checksum(text: str) -> str:
    found = 0
    for byte in text.encode():
        found ^= byte
    return f"{found:02X}"


def steps(samples: list[Sample]) -> list[int]:
    """Return the times from one pair to the next, us."""
    return [(b.t_hard_ns - a.t_hard_ns) // 1000 for a, b in pairwise(samples)]


def test_the_palpate_format() -> None:
    sent = Sent(
        ["# AD7746, EXCB", *(line(k, 31_500 * k) for k in range(40, 45)), line(45, 1_450_000, code=-1, status=8)]
    )
    assert [sample.seq for sample in sent.samples] == list(range(6))
    assert steps(sent.samples)[:4] == [31_500] * 4
    assert {sample.t_soft_ns - sample.t_hard_ns for sample in sent.samples} == {15_000_000}
    assert {sample.hard_raw for sample in sent.samples[:5]} == {8388608}
    assert [sample.status for sample in sent.samples] == [0] * 5 + [Status.LOST]
    assert sent.source.describe()["stamps"] == "converter"
    assert sent.source.describe()["full_scale_pF"] < 4.096
    assert (sent.source.gaps, sent.source.counters) == ([], {"errors": 0, "lost": 0, "reconnects": 0})


def test_every_byte_that_changes_is_seen() -> None:
    text = line(2, 63_000)
    changed = [text[:at] + chr(ord(text[at]) ^ 1) + text[at + 1 :] for at in range(len(text))]
    sent = Sent([line(0, 0), line(1, 31_500), *changed, text])
    assert [sample.t_hard_ns - sent.samples[0].t_hard_ns for sample in sent.samples] == [0, 31_500_000, 63_000_000]
    assert sent.source.counters["errors"] == len(text)
    assert Sent([line(0, 0), LINE.format(1, 31_500, 46_500, 0, 5, 0)]).source.counters["errors"] == 1


def test_a_counter_of_32_bits_begins_again() -> None:
    sent = Sent([line(k, 2**32 - 100_000 + 31_500 * k) for k in range(10)])
    assert steps(sent.samples) == [31_500] * 9
    assert {sample.t_soft_ns - sample.t_hard_ns for sample in sent.samples} == {15_000_000}
    assert sent.source.gaps == []


def test_numbers_that_were_left_out_are_lost() -> None:
    sent = Sent([line(0, 0), line(1, 31_500), line(4, 126_000)])
    assert [sample.seq for sample in sent.samples] == [0, 1, 4]
    assert sent.source.counters["lost"] == 2
    assert sent.source.gaps == []


@pytest.mark.parametrize("t_us", [5_000_000, 2**32 - 5_000_000])
def test_a_board_that_restarts_is_a_gap(t_us: int) -> None:
    before = [line(k, t_us + 31_500 * k) for k in range(70, 75)]
    after = [line(k, 900_000 + 31_500 * k) for k in range(5)]
    sent = Sent([*before, "ets Jul 29 2019", *after])
    assert [sample.seq for sample in sent.samples] == list(range(10))
    assert sent.source.gaps == [Gap(5, "the board restarted: seq 0 after 74")]
    times = [sample.t_hard_ns for sample in sent.samples]
    assert times == sorted(set(times))
    assert steps(sent.samples)[5:] == [31_500] * 4
    assert sent.source.counters["lost"] == 0


def test_a_board_without_numbers_restarts() -> None:
    sent = Sent([f"t_ms={t},hard=1,soft=2" for t in (100, 131, 162, 5, 36)])
    assert [gap.seq for gap in sent.source.gaps] == [3]
    assert "its clock went back: it shows 0.005 s after 0.162 s" in sent.source.gaps[0].text
    ahead = Sent([f"t_ms={t},hard=1,soft=2" for t in (100, 131, 2**32 - 1, 30)])
    assert [gap.seq for gap in ahead.source.gaps] == [2]


def test_a_capdac_that_moves_and_names_that_come_again_are_gaps() -> None:
    sent = Sent([line(0, 0), line(1, 31_500, capdac=6), line(2, 63_000, capdac=6)])
    assert sent.source.gaps == [Gap(1, "CAPDAC 5, 9 -> 6, 9")]
    again = Sent(["hard,soft", "1,2", "1,2", "boot", "hard,soft", "3,4", "3,4"])
    assert [gap.seq for gap in again.source.gaps] == [2]
    assert len(again.samples) == 4


def test_a_board_that_always_restarts_ends_it() -> None:
    sent = Sent([line(7, 31_500 * k) for k in range(100)])
    assert len(sent.samples) == 20
    assert "restarts with each line, or does not count up: the board restarted: seq 7 after 7" in sent.failed


def test_times_that_cannot_be() -> None:
    sent = Sent([f"t_hard_ms={t},t_soft_ms={t + d},hard=1,soft=2" for t, d in ((1, 5), (1, 5), (32, 20_000), (33, 4))])
    assert steps(sent.samples) == [32_000]
    assert sent.source.counters["errors"] == 2


def test_the_uncertainty_of_the_times_goes_with_the_sample() -> None:
    sent = Sent(["t_us=1,hard=1,soft=2,t_uncertainty_us=40", "t_us=2,hard=1,soft=2,t_uncertainty_us=-1"])
    assert [sample.t_uncertainty_us for sample in sent.samples] == [40, -1]


def numbered(steps: list[tuple[int | None, int | None, int]], unit: str = "us") -> list[Place]:
    """Return the places of pairs with these seq, times and arrivals."""
    numbering = Numbering(True, {"t_hard": unit, "t_soft": unit} if steps[0][1] is not None else {})
    found = []
    for seq, t_ns, arrived_ns in steps:
        times = {} if t_ns is None else {"t_hard": t_ns, "t_soft": t_ns}
        found.append(numbering.place({**times, **({} if seq is None else {"seq": seq})}, (arrived_ns, arrived_ns)))
    return found


def test_a_long_silence_of_the_board_is_no_restart_but_a_jump_of_its_clock_is() -> None:
    quiet = numbered([(0, SECOND, 0), (1, 61 * SECOND, 60 * SECOND)])
    assert (quiet[1].t_hard_ns, quiet[1].gap) == (60 * SECOND, "")
    stalled = numbered([(0, SECOND, 0), (1, 2 * SECOND, 60 * SECOND)])  # the host slept, and its buffer did not
    assert (stalled[1].t_hard_ns, stalled[1].gap) == (SECOND, "")
    jumped = numbered([(0, SECOND, 0), (1, 61 * SECOND, 30_000_000)])
    assert jumped[1].t_hard_ns == 30_000_000
    assert "jumped ahead: it shows 61 s after 1 s" in jumped[1].gap


def test_a_board_that_restarts_shortly_before_its_counter_begins_again() -> None:
    wrap_ns = 2**32 * 1000
    places = numbered([(None, wrap_ns // 4 * 3, 0), (None, SECOND, 30_000_000)])
    assert "it shows 1 s after" in places[1].gap
    across = numbered([(None, wrap_ns - 1000, 0), (None, 30_000_000 - 1000, 30_000_000)])
    assert (across[1].t_hard_ns, across[1].gap) == (30_000_000, "")


def paced(unit: str, clock_s: list[float], arrived_s: list[float]) -> list[Place]:
    """Return the places of pairs with these times, as read in this unit, and arrivals."""
    pairs = zip(clock_s, arrived_s, strict=True)
    return numbered([(None, round(clock * SECOND) + 1, round(arrived * SECOND)) for clock, arrived in pairs], unit)


STEADY = [0.03 * k for k in range(200)]


@pytest.mark.parametrize(
    ("unit", "factor", "helps"),
    [
        ("s", 1e3, "In ms they agree: name the column t_ms, for example columns=t_ms,hard,soft"),
        ("s", 1e6, "In us they agree"),
        ("ms", 1e3, "In us they agree"),
        ("ms", 1e-3, "In s they agree"),
        ("us", 1e-3, "In ms they agree"),
    ],
)
def test_a_clock_in_another_unit_ends_it(unit: str, factor: float, helps: str) -> None:
    with pytest.raises(ProtocolError, match=f"not in {unit}: by them .* s went by in 1.* s of the computer") as error:
        paced(unit, [factor * t for t in STEADY], STEADY)
    assert helps in str(error.value)
    assert paced(unit, [factor * t for t in STEADY[:20]], STEADY[:20])[-1].seq == 19  # not before 1 s


@pytest.mark.parametrize("factor", [0.1, 30.0])
def test_a_clock_that_no_unit_explains_is_told_once(factor: float) -> None:
    """Stored lines that are sent again, or a board of another crystal than it believes."""
    numbering, told = Numbering(True, {"t": "ms"}), []
    for t in STEADY:
        numbering.place({"t": round(factor * t * SECOND) + 1}, (round(t * SECOND),) * 2)
        told += [numbering.remark] if numbering.remark else []
        numbering.remark = ""
    [text] = told
    assert text.endswith("s of the computer's clock: is the clock of the board right?")


def test_a_clock_that_is_ahead_at_each_pair_is_said_once() -> None:
    places = paced("s", [1e3 * t for t in STEADY[:40]], STEADY[:40])
    assert [place.seq for place in places if place.gap] == [1]
    assert "restarted" not in places[1].gap


@pytest.mark.parametrize("factor", [0.4, 1.0, 2.5])
@pytest.mark.parametrize("early", [0, 100, 199])
def test_lines_that_waited_are_no_wrong_clock(factor: float, early: int) -> None:
    burst = [0.0] * early + [t - STEADY[early] for t in STEADY[early:]]
    assert len(paced("ms", [factor * t for t in STEADY], burst)) == 200


@pytest.mark.parametrize("batch", [2, 7, 10, 25, 90])
@pytest.mark.parametrize("period_s", [0.03, 1.0])
@pytest.mark.parametrize("first", [0, 1, 6])
def test_lines_in_batches_are_no_wrong_clock(batch: int, period_s: float, first: int) -> None:
    clock = [period_s * k for k in range(400)]
    arrived = [period_s * batch * ((k + first) // batch) for k in range(400)]
    assert len(paced("ms", clock, arrived)) == 400


def test_a_computer_that_stops_for_a_while_and_a_clock_that_is_set_are_no_wrong_clock() -> None:
    stopped = [t if t < 2 else max(t, 5.5) for t in STEADY]
    assert not any(place.gap for place in paced("ms", STEADY, stopped))
    anew = [t + 3600 * (t > 2) for t in STEADY]
    assert [place.seq for place in paced("ms", anew, STEADY) if place.gap] == [67]


def test_pairs_lost_while_the_port_was_away() -> None:
    numbering = Numbering(True, {})
    assert numbering.place({}, (0, 0)).seq == 0
    away = numbering.place({}, (SECOND, SECOND), away=30, why="unplugged")
    assert (away.seq, away.gap, numbering.lost) == (31, "unplugged", 30)
    counts = Numbering(True, {})
    counts.place({"seq": 5}, (0, 0))
    assert counts.place({"seq": 9}, (1, 1), away=30, why="unplugged").seq == 4  # the board counted on
    assert counts.place({"seq": 2}, (2, 2), away=30, why="unplugged")[0::3] == (
        35,
        "unplugged; the board restarted: seq 2 after 9",
    )


def test_a_pair_without_its_time_is_refused_and_changes_nothing() -> None:
    numbering = Numbering(True, {"t": "us"})
    with pytest.raises(Refused, match="it has no time"):
        numbering.place({"seq": 3}, (0, 0))
    assert (numbering.next, numbering.place({"t": 5, "seq": 0}, (math.ceil(1e9), 0)).seq) == (0, 0)
