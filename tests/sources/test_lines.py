"""Serial lines without a device: the page's table, a strict grammar of its own, and boards that count, stamp and restart."""

import re
from functools import reduce
from itertools import pairwise
from operator import xor
from random import Random
from typing import Any

import pytest
from effort import draws, random_of
from line_grammar import line_of, strict
from palpate import Sample, Status
from palpate.source_events import GapCause
from project import ROOT
from serial_lines import Sent

LINES = draws(20_000, 1_000_000)


def documented() -> list[Any]:
    """Return line, option and result of each row of the table on the page."""
    page = (ROOT / "docs" / "serial.md").read_text(encoding="utf-8")
    table = page.partition("## Which lines are read")[2].partition("## The grammar")[0]
    rows = [
        re.split(r"(?<!\\)\|", row)[1:-1] for row in table.splitlines() if row.startswith("| `")
    ]
    return [[cell.replace("\\|", "|").strip() for cell in row] for row in rows]


NO_CHECKSUM = "no checksum *XX: a digit that is lost before the point is not seen"


def test_the_table_of_the_page() -> None:
    rows = documented()
    for quoted, option, result in rows:
        line, (name, _, value) = quoted[1:-1], option.partition("=")
        sent = Sent([line], **({name: value} if option else {}))
        found = (
            sent.said[0].partition("; no checksum")[0]
            if sent.samples
            else f"refused: {sent.refusals[-1]}"
        )
        assert found == (result if result.startswith("refused") else f"{line!r} -> {result}")
        assert bool(sent.samples) != result.startswith("refused")
    assert len(rows) >= 25


def test_no_line_gives_more_or_less_than_the_strict_grammar() -> None:
    rng, read = random_of("serial lines"), 0
    for _ in range(LINES):
        line = line_of(rng)
        found, expected = Sent(line + b"\n").pairs, strict(line)
        assert found == ([pytest.approx(expected, rel=1e-12, nan_ok=True)] if expected else []), (
            line
        )
        read += bool(expected)
    assert LINES / 10 < read < LINES * 0.9


@pytest.mark.parametrize(
    ("first", "others"),
    [
        (
            "hard:6.92,soft:4.69",
            ["6.92,4.69", "soft:4.69,hard:6.92", "hard:1,soft:2,t_ms:3", "hard:3,soft:4*09"],
        ),
        ("6.92,4.69", ["6.92", "6.92,4.69,1", "hard:6.92,soft:4.69"]),
        ("hard=1,soft=2*3E", ["hard=1,soft=2", "hard=1,soft=2*3F"]),
        ("seq=0,hard=1,soft=2", ["hard=1,soft=2", "n=1,hard=1,soft=2", "seq=1.0,hard=1,soft=2"]),
    ],
)
def test_the_first_line_fixes_the_form(first: str, others: list[str]) -> None:
    sent = Sent([first, *others])
    assert (len(sent.samples), sent.source.counters["errors"]) == (1, len(others))


def cut(rng: Random, text: str) -> str:
    """Return a fixed-point number without some characters behind its point."""
    point = text.index(".")
    lost = set(rng.sample(range(point + 1, len(text)), rng.choice((1, 1, 2))))
    return "".join(c for at, c in enumerate(text) if at not in lost)


@pytest.mark.parametrize("form", ["{},{}", "hard={} soft={}", '{{"hard": {}, "soft": {}}}'])
def test_a_number_that_lost_decimals_is_not_read(form: str) -> None:
    """Of fixed-point lines, from the third on, one in ten is damaged; the seven digits of a constant channel show nothing."""
    for places, spread in ((2, 3.0), (4, 0.001), (6, 1e-9)):
        rng, lines, good = random_of(f"{form} {places}"), list[str](), list[tuple[float, float]]()
        for k in range(draws(10_000) // 9):
            pair = [f"{rng.gauss(mean, spread):.{places}f}" for mean in (16.9231713, 14.6912347)]
            if damaged := k > 2 and rng.random() < 0.1:
                at = rng.choice((0, 1))
                pair[at] = cut(rng, pair[at])
            good += [] if damaged else [(float(pair[0]), float(pair[1]))]
            lines.append(form.format(*pair))
        sent = Sent(lines)
        assert (sent.pairs, sent.source.counters["errors"]) == (good, len(lines) - len(good))
    assert "decimals, before it had 6: has it lost a character?" in sent.refusals[-1]


def test_numbers_whose_decimals_vary_are_read() -> None:
    """As `print` of Python writes them; or with more decimals in another range of the instrument."""
    rng = random_of("decimals that vary")
    pairs = [(round(rng.gauss(7, 1), 3), round(rng.gauss(5, 1), 3)) for _ in range(500)]
    assert len(Sent([f"hard={hard},soft={soft}" for hard, soft in pairs]).samples) >= 490
    ranges = ["9.9870,4.6900"] * 50 + ["10.002,4.6910"] * 50
    assert Sent(ranges).source.counters["errors"] == 7
    assert Sent(["1.50,2.50*2F", "1.5,2.50*1F"]).pairs == [(1.5, 2.5), (1.5, 2.5)]


def test_only_the_first_values_need_the_size_of_pF() -> None:
    late = Sent(["hard=OL,soft=1", "hard=6700,soft=1", "hard=6.7,soft=1", "hard=0.0,soft=-101"])
    assert (late.pairs[1:], late.source.counters["errors"]) == ([(6.7, 1), (0, -101)], 1)
    assert Sent(["1.5,2.5", "1.0,2.0"]).pairs == [(1.5, 2.5), (1, 2)]


def test_codes_become_capacitances_and_a_status_goes_with_its_values() -> None:
    middle, full = 8388608, 16777215
    lines = [
        (0, middle, 0),
        (middle + 1, full, 4),
        (-1, middle, 8),
        (-1, middle, 0),
        (middle, middle, 8),
        (1, 1, 9),
    ]
    sent = Sent(["hard_raw={},soft_raw={},status={}".format(*line) for line in lines])
    assert sent.pairs[:2] == [(-4.096, 0), (2**-21 * 1.024, pytest.approx(4.09599951, abs=1e-8))]
    assert [sample.hard_raw for sample in sent.samples] == [0, 8388609, -1]
    expected = [Status.HARD_SATURATED, Status.SOFT_SATURATED | Status.EXCITATION, Status.LOST]
    assert ([sample.status for sample in sent.samples], sent.source.counters["errors"]) == (
        expected,
        3,
    )
    assert sent.source.describe()["full_scale_pF"] < 4.096


def test_columns_and_patterns_say_what_a_line_is() -> None:
    lines = [
        "heap=23000 free=48000",
        "CIN1=6.92 CIN2=4.69",
        "CIN2=6.93 CIN1=4.70",
        "CIN1=6.94 CIN2=4.71",
    ]
    assert Sent(lines, columns="hard,soft").pairs == [(6.92, 4.69), (6.94, 4.71)]
    assert Sent(["1,2,a-b,3"], columns="hard_pF,soft_pF,-,-").pairs == [(1, 2)]
    pattern = r"h=(?P<hard>\S+) s=(?P<soft>\S+)(?: seq=(?P<seq>\d+))?"
    lines = [
        "h=1 s=2",
        "h=1 s=2 ",
        "x h=1 s=2",
        "h=1 s=2 x",
        "h=1 s=two",
        "h=0x1 s=2",
        "h=1_0 s=2",
        "h=1 s=2 seq=7",
    ]
    sent = Sent(lines, pattern=pattern, unit="fF")
    assert (sent.pairs, sent.source.counters["errors"]) == ([(0.001, 0.002)] * 3, 5)


def test_lines_that_do_not_fit_are_counted_after_the_first_that_does() -> None:
    sent = Sent(["booting...", "# AD7746", "C1=1 C2=2", "", "#", "what", "C1=OL C2=3", "C1=4 C2=5"])
    assert [(s.seq, s.status) for s in sent.samples] == [(0, 0), (1, Status.LOST), (2, 0)]
    assert sent.source.counters["errors"] == 1
    first = f"'C1=1 C2=2' -> hard 1 pF, soft 2 pF; {NO_CHECKSUM}"
    at_end = "tty: lines not read: 1. The last: 'what'. Reason: its names or its checksum are not as in the first line"
    assert sent.said == ["tty: '# AD7746'", first, "tty: '#'", at_end]
    assert Sent(["#"], pattern="(?P<hard>.) (?P<soft>.)").said == ["tty: '#'"]
    [said] = Sent(["a b c"], pattern="(?P<hard>.) (?P<soft>.)").said
    assert (
        said
        == "tty: lines not read: 1. The last: 'a b c'. Reason: it does not match the pattern as a whole"
    )
    assert Sent([]).said == ["tty: no line came: check the board, and the baud rate, 115200"]
    many = Sent(["C1=1 C2=2", *["what"] * 100])
    assert [text.split(".")[0] for text in many.said[1:]] == [
        f"tty: {n} lines were not read" for n in (10, 100)
    ]


@pytest.mark.parametrize(
    "end", [b"9" * 5000 + b" 2\n", b"9" * 1500 + b"\xff" + b"9" * 1500 + b"\xff" + b" 1\n"]
)
def test_a_long_line_is_one_error_however_it_arrives(end: bytes) -> None:
    sent = Sent(b"end\nC1=1 C2=2\n" + end + b"C1=3 C2=4\n")
    assert (sent.pairs, sent.source.counters["errors"]) == ([(1, 2), (3, 4)], 1)


@pytest.mark.parametrize(
    ("lines", "arrivals_s", "failed"),
    [
        (["what"] * 3, [0, 9.9, 10], "tty: no line is read. The last: 'what'. Reason: 1 cells"),
        (["\u00f8"] * 2, [0, 10], "It is not plain text: check the baud rate, 115200"),
        (["1.5,2.5", *["what"] * 3], [0, 99, 128.9, 129], "no line is read"),
        (["1.5,2.5", *["what"] * 3], [0, 99, 110, 128.9], ""),
    ],
)
def test_too_long_without_a_line_that_is_read(
    lines: list[str], arrivals_s: list[float], failed: str
) -> None:
    found = Sent(lines, arrivals_s).failed
    assert failed in found if failed else not found


def test_silence_is_reported_once() -> None:
    sent = Sent(
        ["1.5,2.5", *["1.5,nan"] * 5, "1.5,2.5", "what"], [0, 1, 10, 10.1, 12, 15, 20, 30.1]
    )
    silent = "tty: no pair with both values for 10 s: check the board, the baud rate, 115200, and the probe"
    assert [text.startswith(silent) for text in sent.said] == [False, True, True, False]


LINE = "seq={},t_hard_us={},t_soft_us={},hard_raw={},soft_raw=8400000,capdac_hard={},capdac_soft=9,status={}"


def line(seq: int, t_us: int, capdac: int = 5, code: int = 8388608, status: int = 0) -> str:
    """Return a line of the palpate format with its checksum."""
    text = LINE.format(seq, t_us % 2**32, (t_us + 15_000) % 2**32, code, capdac, status)
    return f"{text}*{reduce(xor, text.encode()):02X}"


def steps(samples: list[Sample]) -> list[int]:
    """Return the times from one pair to the next, us."""
    return [(b.t_hard_ns - a.t_hard_ns) // 1000 for a, b in pairwise(samples)]


def test_the_palpate_format() -> None:
    """The board's counter of 32 bits begins again on the way."""
    begin = 2**32 - 100_000
    last = line(49, begin + 9 * 31_500, code=-1, status=8)
    sent = Sent([line(40 + k, begin + 31_500 * k) for k in range(9)] + [last])
    assert [sample.seq for sample in sent.samples] == list(range(10))
    assert steps(sent.samples) == [31_500] * 9
    assert {sample.t_soft_ns - sample.t_hard_ns for sample in sent.samples} == {15_000_000}
    assert [sample.status for sample in sent.samples] == [0] * 9 + [Status.LOST]
    assert sent.source.describe()["stamps"] == "converter"
    assert (sent.gaps, sent.source.counters) == (
        [],
        {"errors": 0, "lost": 0, "reconnects": 0},
    )


def test_every_byte_that_changes_is_seen() -> None:
    text = line(2, 63_000)
    changed = [text[:at] + chr(ord(text[at]) ^ 1) + text[at + 1 :] for at in range(len(text))]
    sent = Sent([line(0, 0), line(1, 31_500), *changed, text])
    assert steps(sent.samples) == [31_500] * 2
    assert sent.source.counters["errors"] == len(text)


def test_numbers_that_were_left_out_are_lost_and_a_capdac_that_moves_is_a_gap() -> None:
    sent = Sent([line(0, 0), line(1, 31_500), line(4, 126_000, capdac=6)])
    assert [sample.seq for sample in sent.samples] == [0, 1, 4]
    assert sent.source.counters["lost"] == 2
    assert (sent.gaps, sent.causes) == ([(4, "CAPDAC 5, 9 -> 6, 9")], [GapCause.RANGE])


@pytest.mark.parametrize("t_us", [5_000_000, 2**32 - 5_000_000])
def test_a_board_that_restarts_is_a_gap(t_us: int) -> None:
    before = [line(k, t_us + 31_500 * k) for k in range(70, 75)]
    after = [line(k, 900_000 + 31_500 * k) for k in range(5)]
    sent = Sent([*before, "ets Jul 29 2019", *after])
    assert [sample.seq for sample in sent.samples] == list(range(10))
    assert sent.causes == [GapCause.RESTARTED]
    assert (sent.gaps, sent.source.counters["lost"]) == (
        [(5, "the board restarted: seq 0 after 74")],
        0,
    )
    assert (min(steps(sent.samples)) >= 0, steps(sent.samples)[5:]) == (True, [31_500] * 4)


def test_a_board_that_always_restarts_ends_it() -> None:
    sent = Sent([line(7, 31_500 * k) for k in range(100)])
    assert len(sent.samples) == 20
    assert (
        "restarts with each line, or does not count up, or its times are not in us: the board"
        in sent.failed
    )


def stamped(clock_s: list[float], arrivals_s: list[float]) -> Sent:
    """Send pairs with these times of the board, at these times of the computer."""
    return Sent([f"t_s={t:.6f},hard=1,soft=2" for t in clock_s], arrivals_s)


@pytest.mark.parametrize(
    ("clock_s", "arrivals_s", "expected_s", "gaps"),
    [
        ([1, 61], [0, 60], 60, 0),  # a long silence
        ([1, 2], [0, 60], 1, 0),  # the computer slept, and its buffer did not
        ([1, 3.02], [0, 0.03], 2.02, 0),
        ([1, 3.04], [0, 0.03], 0.03, 1),  # the board's clock was set
        ([9, 1], [0, 0.03], 0.03, 1),
    ],
)
def test_times_of_the_board(
    clock_s: list[float], arrivals_s: list[float], expected_s: float, gaps: int
) -> None:
    sent = stamped(clock_s, arrivals_s)
    assert steps(sent.samples) == [round(expected_s * 1e6)]
    assert len(sent.gaps) == gaps


STEADY = [0.03 * k for k in range(500)]


@pytest.mark.parametrize("factor", [3.1, 1 / 3.1])
def test_a_clock_in_another_unit_ends_it(factor: float) -> None:
    sent = stamped([factor * t for t in STEADY], STEADY)
    assert "the times of the lines are not in s: by them" in sent.failed
    assert sent.samples[-1].seq == 333  # after 10 s, not before


@pytest.mark.parametrize("batch", [2, 25, 90])
@pytest.mark.parametrize("first", [0, 1, 6])
def test_lines_in_batches_are_no_wrong_clock(batch: int, first: int) -> None:
    sent = stamped(STEADY, [0.03 * batch * ((k + first) // batch) for k in range(500)])
    assert (len(sent.samples), sent.failed) == (500, "")


def test_times_that_cannot_be_and_the_uncertainty_of_those_that_are() -> None:
    lines = [(1, 5), (1, 5), (32, 20_000), (33, 4)]
    sent = Sent(
        [f"t_hard_ms={t},t_soft_ms={t + d},hard=1,soft=2,t_uncertainty_us=40" for t, d in lines]
    )
    assert (steps(sent.samples), sent.source.counters["errors"]) == ([32_000], 2)
    assert {sample.t_uncertainty_us for sample in sent.samples} == {40}


@pytest.mark.parametrize(
    ("numbers", "seqs"), [(["", "", "+"], [0, 1, 2]), (["seq=5,", "seq=6,", "+seq=9,"], [0, 1, 4])]
)
def test_pairs_lost_while_the_port_was_away(numbers: list[str], seqs: list[int]) -> None:
    """How many is known by the numbers of the board only."""
    sent = Sent([f"{number}hard=1,soft=2" for number in numbers], [0, 1, 31])
    assert [sample.seq for sample in sent.samples] == seqs
    assert sent.gaps[0][1].startswith("the port was unplugged for 1.0 s")


def test_after_a_pause_of_the_program_no_line_is_missed(monkeypatch: pytest.MonkeyPatch) -> None:
    """A line that is not read before a pause, and one after it, are no long time without a line."""
    times_s = iter([0.0, 0.0, 0.1, 40.0, 40.1, 40.2])
    monkeypatch.setattr("palpate.sources.serial.fine_ns", lambda: round(1e9 * next(times_s)))
    good = b"hard=6.92,soft=4.69\n"
    sent = Sent(b"\n" + good + b"\xff" + b"hard=6\n" + b"\xff" + b"hard=6\n" + b"\xff" + good)
    assert (sent.failed, len(sent.samples)) == ("", 2)
    assert not any("no pair with both values" in text for text in sent.said)


def test_lines_that_had_waited_are_behind_the_clock_of_the_computer() -> None:
    """The board goes on in a pause of an hour: the lines of the first second waited, the rest was lost."""
    clock_s = [1.0, 2.0, 3.0, 3601.0, 3602.0]
    sent = stamped(clock_s, [0.0, 3600.0, 3600.0, 3600.0, 3601.0])
    assert sent.gaps == []
    assert [round(sample.t_hard_ns / 1e9) for sample in sent.samples] == [0, 1, 2, 3600, 3601]
