"""A serial port in the browser: its lines have the values of `palpate live serial:`, and what that refuses is refused."""

from math import isnan
from random import Random
from typing import Any

import numpy as np
import palpate
import pytest
from effort import draws, random_of
from line_grammar import line_of
from palpate.live.feed import Flag
from palpate.simulation import scenarios
from palpate.sources.serial.cells import Refused
from palpate.sources.serial.formats import Given
from palpate.sources.serial.pairs import sample
from palpate.sources.serial.settling import Settling
from try_core import Node, rows_in

NAMES = ("hard_pF", "soft_pF", "C1 (fF)", "soft_fF", "hard", "soft", "C2 [pF]", "hard_raw", "soft_raw", "t_ms", "t_us", "millis", "t_hard_us",
         "t_soft_us", "seq", "status", "capdac_hard", "temp", "x", "t", "hard_V", "t_uncertainty_us", "soft_aF", "C_soft_F", "HARD_PF")  # fmt: skip
VALUES = ("1.5", "-0.25", ".5", "6.", "+3", "2e-3", "1E2", "8388608", "0", "-1", "16777215", "12", "OL", "-nan", "9.9E+37", "1,5", "7 pF", "4 fF", "1e40", "",
          "5 ms", "0.5", "2.5", "3 V", "4294967296", "1234567890123456789012", "abc", "1.5.5", "0x10")  # fmt: skip


def labelled(rng: Random) -> str:
    """Return a line of names and values, mostly a pair."""
    sides = rng.choice(
        [
            ("hard_pF", "soft_pF"),
            ("C1 (fF)", "C2 [pF]"),
            ("hard", "soft"),
            ("hard_raw", "soft_raw"),
            ("soft_fF", "hard_fF"),
        ]
    )
    names = [*sides, *rng.sample(NAMES, rng.choice([0, 0, 1, 2, 3]))]
    if rng.random() < 0.3:
        rng.shuffle(names)
    sign, separator = rng.choice("=:"), rng.choice([",", ", ", ";", "\t", " ", " | "])
    line = separator.join(
        f"{name}{rng.choice(['', '', ' '])}{sign}{rng.choice(VALUES[: rng.choice([5, 12, 99])])}" for name in names
    )
    if rng.random() < 0.2:
        line = f"{line}*{np.bitwise_xor.reduce(np.frombuffer(line.encode(), 'u1')) ^ (rng.random() < 0.2):02X}"
    return line


def there(line: str) -> tuple[dict[str, Any], dict[str, Any]] | None:
    """Return the values and the sample of a line in Python; None: it is not read."""
    settling = Settling(Given())
    try:
        if not settling.offer(line) or settling.format is None:
            return None
        values = settling.format.read(line)
        return values, sample(values, None)._asdict()
    except Refused:
        return None


def same(answer: Any, value: Any) -> bool:
    """Return whether an answer of JavaScript is a value: a time is text there, and nan."""
    if isinstance(value, float) and isnan(value):
        return bool(answer == "nan")
    return bool(type(value)(answer) == value)


def test_a_line_that_is_read_has_the_values_of_python(node: Node) -> None:
    rng = random_of("labelled lines")
    count = draws(10_000, 200_000)
    lines = [labelled(rng) if i % 4 else line_of(rng).decode("latin-1").strip() for i in range(count)]
    lines = [line for line in lines if line and "\n" not in line and "\r" not in line]
    read = 0
    for line, answer in zip(lines, node.ask("lines", lines=lines), strict=True):
        if "refused" in answer:
            continue
        expected = there(line)
        assert expected is not None, line
        values, made = expected
        assert answer["values"].keys() == values.keys(), line
        assert all(same(answer["values"][name], value) for name, value in values.items()), line
        assert all(same(value, made[name]) for name, value in answer["sample"].items()), line
        read += 1
    assert read > count / 50


@pytest.mark.parametrize(
    "line",
    [
        "hard_pF:6.92,soft_pF:4.69",
        "C1 (fF): 6920; C2 (fF): 4690",
        "hard: 6.92 pF, soft: 4690 fF",
        "hard_raw=8388608,soft_raw=8632320,status=0",
        "seq=12,t_hard_us=1234567,t_soft_us=1250321,hard_raw=8388608,soft_raw=9001234,capdac_hard=42,capdac_soft=28,status=0",
        "hard_pF=OL soft_pF=4.5",
        "t_ms=12.5\thard_pF=1\tsoft_pF=2",
    ],
)
def test_lines_of_the_documentation_are_read(node: Node, line: str) -> None:
    [answer] = node.ask("lines", lines=[line])
    assert "refused" not in answer, answer
    assert there(line) is not None


@pytest.mark.parametrize(
    "text", ["1.2346", "0.0005", "0.0015", "0.0025", "1e3", "4294967295", "3.9999999", "1e15", "-1", "nan"]
)
def test_times_are_rounded_as_in_python(node: Node, text: str) -> None:
    line = f"t_us:{text},hard_pF:1,soft_pF:2"
    [answer], expected = node.ask("lines", lines=[line]), there(line)
    assert ("refused" in answer) == (expected is None), answer
    assert expected is None or int(answer["values"]["t"]) == expected[0]["t"]


@pytest.mark.parametrize(
    ("line", "told"),
    [
        (
            "6.92,4.69",
            "'6.92' is not a name with a number; allowed here: lines with names and units, such as hard_pF:1.2,soft_pF:3.4",
        ),
        ("hard:6.92,soft:4.69", "the unit of hard is not said: pF, fF?"),
        ("t:5,hard_pF:6.92,soft_pF:4.69", "the unit of t is not said: s, ms or us?"),
        ("hard_pF:6.92,soft_pF:4.69,humidity:41", "what is 'humidity'?"),
        ("hard_V:6.92,soft_V:4.69", "'V' is not a unit of hard"),
        ("hard_pF=6.92,soft_pF=4.69*25", "its checksum is 25, but that of its text is"),
        ("hard_pF=6.92,hard_pF=4.69", "a name is there twice"),
        ("hard_pF=6.92,t_ms=4", "has not both channels, once each"),
        ("hard_pF=6.92 fF,soft_pF=4", "hard has several units: pF, fF"),
        ("hard_raw=5,soft_raw=99999999", "'99999999' is not a whole number from -1 to 16777215"),
        ('{"hard_pF": 1, "soft_pF": 2}', "is not a name with a number"),
        ("hard_pF=6,92;soft_pF=4,69", "is not made of names with numbers"),
        ("\xff\xfe\x00", "is not plain text: is the baud rate right?"),
    ],
)
def test_other_lines_are_refused_in_words(node: Node, line: str, told: str) -> None:
    [answer] = node.ask("lines", lines=[line])
    assert told in answer["refused"]


def lines_of(block: np.ndarray[Any, np.dtype[np.void]], first: int = 0) -> list[str]:
    """Return samples as a board prints them."""
    return [
        f"seq={first + i},t_hard_us={row['t_hard_ns'] // 1000},t_soft_us={row['t_soft_ns'] // 1000},hard_raw={row['hard_raw']},soft_raw={row['soft_raw']}\n"
        for i, row in enumerate(block)
    ]


def sent(lines: list[str], every: int = 1) -> list[tuple[str, float]]:
    """Return lines in pieces that do not end where lines end, and when they come."""
    text = "".join(lines)
    size = max(len(text) * every // len(lines), 1)
    return [(text[at : at + size], 5.0 + 0.026 * every * number) for number, at in enumerate(range(0, len(text), size))]


@pytest.mark.parametrize("every", [1, 7, 50])
def test_touches_of_a_port_have_the_bits_of_the_tracker(node: Node, every: int) -> None:
    block = scenarios.run("stiff-steady").block()
    found = node.ask(
        "serial", pieces=[("rest of a line\n", 5.0), *sent(lines_of(block), every)], close="the port is gone"
    )
    assert found["refused"] is None
    micro = block.copy()
    for name in ("t_hard_ns", "t_soft_ns"):
        micro[name] = block[name] // 1000 * 1000
    t_ns = micro["t_hard_ns"] - micro["t_hard_ns"][0]
    rows = rows_in(found["blocks"])
    assert len(rows) == len(block)
    origin_ns = round(rows["t_s"][0] * 1e9)
    tracker = palpate.Tracker(full_scale=palpate.ad7746.datasheet.SATURATED_PF)
    expected = tracker.process(
        t_ns + origin_ns, t_ns + origin_ns + micro["t_soft_ns"] - micro["t_hard_ns"], block["hard"], block["soft"]
    )
    tracker.finish()
    measured = expected["touch"] > 0
    assert (rows["flags"] & int(Flag.MEASURED) > 0).tolist() == measured.tolist()
    assert rows["ratio"][measured].tobytes() == expected["ratio"][measured].tobytes()
    assert [row["ratio"] for row in found["touches"]["rows"]] == [touch.ratio for touch in tracker.touches]
    assert found["state"]["error"] == "the port is gone"
    assert found["state"]["now"]["word"] == "Stop"
    assert found["state"]["line"]["text"] == "the port is gone"
    assert found["before"]["counters"]["read"] == len(block)


def test_a_board_that_restarts_is_a_gap(node: Node) -> None:
    block = scenarios.run("stiff-steady").block()
    half = len(block) // 2
    lines = [*lines_of(block[:half]), *lines_of(block[:half]), *lines_of(block[:half], first=half + 9)]
    found = node.ask("serial", pieces=[("\n", 5.0), *sent(lines)])
    assert [gap["text"].split(";")[0] for gap in found["events"]["gaps"]] == [
        "the board restarted, or its counter began again: its clock went back"
    ] * 2
    assert [gap["lost"] for gap in found["events"]["gaps"]] == [0, 9]
    assert "gap" in found["touches"]["rows"][0]["flags"]
    t_s = rows_in(found["blocks"])["t_s"]
    assert (np.diff(t_s) > 0).all()
    assert len(t_s) == 3 * half


def test_without_times_those_of_arrival_are_used(node: Node) -> None:
    block = scenarios.run("stiff-steady").block()
    lines = [
        f"hard_pF:{row['hard']!r:.24},soft_pF:{row['soft']!r:.24}\n".replace("np.float64(", "").replace(")", "")
        for row in block
    ]
    found = node.ask("serial", pieces=[("\n", 5.0), *sent(lines)])
    assert found["refused"] is None
    assert found["hello"]["seconds"] == 6.5
    assert any("without times: those of arrival are used, smoothed" in text for text in found["state"]["messages"])
    [touch] = found["touches"]["rows"]
    [expected] = palpate.touches(scenarios.run("stiff-steady"))
    assert abs(touch["ratio"] / expected.ratio - 1) < 0.01


def test_values_that_do_not_come_are_told_once(node: Node) -> None:
    pieces = [("\n", 0.0), *((f"hard_pF=OL,soft_pF=2,t_ms={500 * i}\n", 0.5 * i) for i in range(40))]
    found = node.ask("serial", pieces=pieces)
    assert sum("no pair with both values for 5 s" in text for text in found["state"]["messages"]) == 1
    assert found["state"]["counters"]["refused"] == 40


@pytest.mark.parametrize(
    ("pieces", "told"),
    [
        (
            [("\n", 0.0), ("6.92,4.69\n" * 20, 1.0)],
            "port: 20 lines in a row were not read. The first: '6.92,4.69'. Reason: '6.92' is not a name",
        ),
        ([("\n", 0.0), ("boot\n", 1.0), ("boot 2\n", 12.0)], "port: 2 lines in a row were not read. The first: 'boot'"),
        ([("\n" + "x" * 2000, 0.0)] * 25, "more than 1000 bytes without a line end"),
        (
            [("\n", 0.0), *((f"t_s={i},hard_pF=1,soft_pF=2\n", 0.1 * i) for i in range(100))],
            "the times of the lines are not in their unit",
        ),
    ],
)
def test_a_port_that_is_not_understood_ends_in_words(node: Node, pieces: list[tuple[str, float]], told: str) -> None:
    assert told in node.ask("serial", pieces=pieces)["refused"]


def test_comments_and_odd_lines_between_are_no_samples(node: Node) -> None:
    lines = [f"hard_pF=1,soft_pF=2,t_ms={20 * i}\n" for i in range(50)]
    lines[10:10] = ["# warming up\n", "error 5\n", "\r\n", "hard_pF=1,soft_pF=2,t_ms=180\n"]
    found = node.ask("serial", pieces=[("\n", 0.0), *((line, 0.02 * i) for i, line in enumerate(lines))])
    assert len(rows_in(found["blocks"])) == 50
    assert any("# warming up" in text for text in found["state"]["messages"])
    assert found["refused"] is None


def test_tare_is_refused_in_contact(node: Node) -> None:
    block = scenarios.run("stiff-steady").block()
    pieces = [("\n", 5.0), *sent(lines_of(block), 20)]
    tared = node.ask("serial", pieces=pieces, tare=2)
    assert tared["refused"] is None
    assert len(tared["events"]["tares"]) == 1
    assert "tare: got it while the probe is in contact" in node.ask("serial", pieces=pieces, tare=10)["refused"]
