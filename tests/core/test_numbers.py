"""Numbers in rows, cpp/rows/number.hpp, against Python's own float() and repr()."""

import math
import struct

import numpy as np
import pytest
from effort import draws, random_of
from palpate.recording.rows import COLUMNS, format_rows, parse_rows

SMALLEST = math.ldexp(1, -1074)
SHORT_OR_LONG = ["0", "-0.0", "1.", ".5e1", "9007199254740993", "18446744073709551615", "99999999999999999999", "1e22", "1e-23",
                 "4503599627370497.5", "1e16", "9999999999999998", "1e-4", "1e-5", "1.7976931348623157e308", "4.9e-324",
                 "2.2250738585072011e-308", "0.1000000000000000055511151231257827021181583404541015625"]  # fmt: skip
NONE = ["-", "+", "+.5e1", ".", "-.", "e5", "1e", "1e+", "1.5e-", "1 ", " 1", "1_0", "0x10", "1.5.",
        "--1", "+-1", "1e5.5", "1.2.3", "1e999", "1e-999", "1e99999999999", "\u0661", "1\0"]  # fmt: skip


def drawn(count: int) -> list[str]:
    """Return numbers as probes, tables and nobody writes them."""
    rng = random_of("numbers")
    found = list[str]()
    for _ in range(count):
        digits = f"{rng.randrange(10 ** rng.randint(1, 21))}"
        place = rng.randint(0, len(digits))
        exponent = rng.choice(
            ["", "", f"{rng.choice('eE')}{rng.choice(['', '+', '-'])}{rng.randint(0, 330)}"]
        )
        found.append(digits[:place] + "." * rng.randint(0, 1) + digits[place:] + exponent)
        found.append(repr(struct.unpack("d", rng.randbytes(8))[0]))
        found.append(repr(rng.randrange(2**24) / 2_048_000))
    return [text for text in found if 0 < abs(float(text)) < math.inf]


def row(text: str) -> bytes:
    return f"0,0.000000000,0.000000000,-1,-1,{text},0.0,-1,0\n".encode()


def test_the_nearest_double_and_the_shortest_text() -> None:
    given = [*SHORT_OR_LONG, *drawn(draws(1500))]
    # At a power of two the nearest text with as many digits is not always one that gives it back.
    given += [repr(math.ldexp(1, exponent)) for exponent in range(-1074, 1024)]
    given += [repr(number * SMALLEST) for number in range(1, 500)]
    expected = np.array([float(text) for text in given])
    block = parse_rows(b"".join(map(row, given)), COLUMNS, None)
    assert block["hard"].tobytes() == expected.tobytes()
    assert format_rows(block) == b"".join(row(repr(value)) for value in expected.tolist())


@pytest.mark.parametrize("text", NONE)
def test_what_is_no_plain_number_is_no_row(text: str) -> None:
    with pytest.raises(ValueError, match="a line is not a row of a recording"):
        parse_rows(row(text), COLUMNS, None)


@pytest.mark.parametrize("text", ["", "nan", "inf", "-inf"])
def test_a_row_may_have_no_value(text: str) -> None:
    assert np.isnan(parse_rows(row(text), COLUMNS, None)["hard"]).all()
