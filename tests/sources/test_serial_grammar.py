"""No line gives a sample that a strict grammar does not give, and the time for a line grows with its length only."""

import time
from contextlib import suppress

import pytest
from effort import draws, random_of
from line_grammar import line_of, strict
from palpate.sources.serial.cells import Refused
from palpate.sources.serial.formats import Given
from palpate.sources.serial.settling import Settling
from serial_lines import Sent

LINES = draws(20_000, 1_000_000)


def test_no_line_gives_more_than_the_grammar() -> None:
    rng = random_of("serial lines")
    read = 0
    for _ in range(LINES):
        line = line_of(rng)
        sent, expected = Sent(line + b"\n" + line + b"\n"), strict(line)
        if expected is None:
            assert sent.pairs == [], line
        else:
            assert sent.pairs[:1] == [pytest.approx(expected, rel=1e-12, nan_ok=True)], line
            read += 1
    assert LINES / 10 < read < LINES * 0.9


@pytest.mark.parametrize("unit", ["0", "1 ", "1.5,", "a", "a=", "a=1 ", "a=1,", " ", "\t", " = ", " (", "[", "1,5;", "OL ", "pF ", "1 pF ", "{",
                                  '{"a":', '"', "-", "1:", "1T", ".", "e", "*00", "\xa0", "hard,"])  # fmt: skip
@pytest.mark.parametrize("before", ["", "{", "hard=", "1"])
def test_a_line_takes_time_by_its_length_only(before: str, unit: str) -> None:
    def took(length: int) -> float:
        line, best = before + unit * (length // len(unit)), float("inf")
        for _ in range(3):
            begun = time.thread_time()
            with suppress(Refused):
                Settling(Given()).offer(line)
            best = min(best, time.thread_time() - begun)
        return best

    assert any((long := took(64_000)) < 2e-3 or long < 8 * took(16_000) for _ in range(4))
