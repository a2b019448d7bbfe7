"""A serial port in the browser's core: its lines have the values of `serial:`; what that refuses is refused."""

from math import isnan
from random import Random
from typing import Any

import numpy as np
import palpate
import pytest
from effort import draws, random_of
from palpate.ad7746.registers import SATURATED_PF
from palpate.simulation import scenarios
from palpate.sources.line_protocol import Grammar, Refused, sample_of

BLOCK = scenarios.run("stiff-steady").block()
NAMES = ("hard_pF", "soft_pF", "C1", "soft_fF", "hard", "soft", "C2", "hard_raw", "soft_raw", "t_ms", "t_us", "millis", "t_hard_us",
         "t_soft_us", "seq", "status", "capdac_hard", "temp", "t", "hard_V", "t_uncertainty_us", "soft_aF", "HARD_PF")  # fmt: skip
VALUES = ("1.5", "-0.25", ".5", "6.", "+3", "2e-3", "1E2", "8388608", "0", "-1", "16777215", "12", "OL", "-nan", "9.9E+37", "1,5", "7 pF", "4 fF", "1e40", "",
          "5 ms", "0.5", "2.5", "3 V", "4294967296", "1234567890123456789012", "abc", "1.5.5", "0x10")  # fmt: skip
SIDES = (
    ("hard_pF", "soft_pF"),
    ("C1", "C2_pF"),
    ("hard", "soft"),
    ("hard_raw", "soft_raw"),
    ("soft_fF", "hard_fF"),
)


def some_line(rng: Random) -> str:
    """Return names and values, mostly a pair."""
    names = [*rng.choice(SIDES), *rng.sample(NAMES, rng.choice([0, 0, 1, 2, 3]))]
    if rng.random() < 0.3:
        rng.shuffle(names)
    sign, separator = rng.choice("=:"), rng.choice([",", ", ", ";", " ", " | "])
    values = VALUES[: rng.choice([5, 12, 99])]
    return separator.join(
        f"{name}{rng.choice(['', '', ' '])}{sign}{rng.choice(values)}" for name in names
    )


def in_python(line: str) -> tuple[dict[str, Any], dict[str, Any]] | None:
    """Return the values and the sample of a line in Python; None: it is refused."""
    try:
        values = Grammar().read(line.encode())
        return values, sample_of(values)._asdict()
    except Refused:
        return None


def same(answer: Any, value: Any) -> bool:
    """Return whether an answer of JavaScript is a value: a time is text there, and nan."""
    return bool(
        answer == "nan"
        if isinstance(value, float) and isnan(value)
        else type(value)(answer) == value
    )


def test_a_line_that_is_read_has_the_values_of_python(node: Any) -> None:
    rng = random_of("labelled lines")
    lines = [line for _ in range(draws(10_000, 200_000)) if (line := some_line(rng))]
    lines += [f"t_us:{x},hard_pF:1,soft_pF:2" for x in ("1.2346", "0.0005", "0.0015", "0.0025", "1e3", "3.9999999", "1e15", "-1", "nan")]  # fmt: skip
    read = 0
    for line, answer in zip(lines, node("lines", lines=lines), strict=True):
        if "refused" in answer:
            continue
        expected = in_python(line)
        assert expected is not None, line
        values, made = expected
        assert answer["values"].keys() == values.keys(), line
        assert all(same(answer["values"][name], value) for name, value in values.items()), line
        assert all(same(value, made[name]) for name, value in answer["sample"].items()), line
        read += 1
    assert read > len(lines) / 20


def lines_of(block: np.ndarray[Any, Any], first: int = 0) -> list[str]:
    """Return samples as a board prints them."""
    return [
        f"seq={first + i},t_hard_us={row['t_hard_ns'] // 1000},t_soft_us={row['t_soft_ns'] // 1000},hard_raw={row['hard_raw']},soft_raw={row['soft_raw']}\n"
        for i, row in enumerate(block)
    ]


def sent(lines: list[str], every: int = 1) -> list[tuple[str, float]]:
    """Return lines in pieces that do not end where lines end, and when they come."""
    text = "".join(lines)
    size = max(len(text) * every // len(lines), 1)
    pieces = [
        (text[at : at + size], 5.0 + 0.026 * every * n)
        for n, at in enumerate(range(0, len(text), size))
    ]
    return [("rest of a line\n", 5.0), *pieces]


@pytest.mark.parametrize("every", [1, 50])
def test_touches_of_a_port_have_the_bits_of_the_tracker(node: Any, every: int) -> None:
    found = node("serial", pieces=sent(lines_of(BLOCK), every))
    assert "refused" not in found
    t_hard, t_soft = (BLOCK[name] // 1000 * 1000 for name in ("t_hard_ns", "t_soft_ns"))
    origin = round(found["rows"]["t"][0] * 1e9) - t_hard[0]
    tracker = palpate.Tracker(full_scale=SATURATED_PF)
    rows = tracker.process(t_hard + origin, t_soft + origin, BLOCK["hard"], BLOCK["soft"])
    tracker.finish()
    measured = rows["touch"] > 0
    assert (
        np.array(found["rows"]["ratio"], float)[measured].tolist()
        == rows["ratio"][measured].tolist()
    )
    assert [row["ratio"] for row in found["touches"]] == [touch.ratio for touch in tracker.touches]
    assert (found["state"]["now"]["word"], found["state"]["line"]["text"]) == (
        "Stop",
        "The port is gone.",
    )


def test_a_board_that_restarts_is_a_gap(node: Any) -> None:
    half = len(BLOCK) // 2
    lines = [
        *lines_of(BLOCK[:half]),
        *lines_of(BLOCK[:half]),
        *lines_of(BLOCK[:half], first=half + 9),
    ]
    found = node("serial", pieces=sent(lines))
    gaps = found["events"]["gaps"]
    assert ["its clock went back" in gap["text"] for gap in gaps] == [True, True]
    assert [gap["lost"] for gap in gaps] == [0, 9]
    assert "gap" in found["touches"][0]["flags"]
    t_s = found["rows"]["t"]
    assert (np.diff(t_s) > 0).all()
    assert len(t_s) == 3 * half


@pytest.mark.parametrize(
    ("pieces", "told"),
    [
        ([("\n", 0.0), ("6.92,4.69\n" * 20, 1.0)], "port: no line is read. The last: '6.92,4.69'"),
        ([("\n" + "x" * 2000, 0.0)] * 25, "more than 1000 bytes without a line end"),
        ([("\n" + "hard_pF:6.92,soft_pF:4.69,humidity:41\n" * 20, 0.0)], "what is 'humidity'?"),
        ([("\n" + "\xff\xfe\x00\n" * 20, 0.0)], "it is not plain text: is the baud rate right?"),
        (
            [("\n", 0.0), *((f"t_us={i},hard_pF=1,soft_pF=2\n", 0.1 * i) for i in range(300))],
            "are not in their unit",
        ),
    ],
)
def test_a_port_that_is_not_understood_ends_in_words(
    node: Any, pieces: list[tuple[str, float]], told: str
) -> None:
    assert told in node("serial", pieces=pieces)["refused"]
