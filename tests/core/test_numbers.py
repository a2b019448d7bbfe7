"""Numbers in text, cpp/rows/number.hpp, against Python's own float() and repr()."""

import math
import re
import struct
import subprocess
from pathlib import Path

from effort import draws, random_of
from project import ROOT, STRICT, need, run

PLAIN = re.compile(r"[+-]?([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][+-]?[0-9]+)?")
SMALLEST = math.ldexp(1, -1074)
SHORT_OR_LONG = ["0", "-0.0", "1.", "+.5e1", "9007199254740993", "18446744073709551615", "99999999999999999999", "1e22", "1e-23",
                 "4503599627370497.5", "1e16", "9999999999999998", "1e-4", "1e-5", "1.7976931348623157e308", "4.9e-324",
                 "2.2250738585072011e-308", "0.1000000000000000055511151231257827021181583404541015625"]  # fmt: skip
NONE = ["", "-", "+", ".", "-.", "e5", "1e", "1e+", "1.5e-", "1 ", " 1", "1_0", "0x10", "nan", "inf", "-inf", "1,5",
        "--1", "+-1", "1e5.5", "1.2.3", "1e999", "1e-999", "1e99999999999", "\u0661", "1\0"]  # fmt: skip


def drawn(count: int) -> list[str]:
    """Return numbers as probes, tables and nobody writes them."""
    rng, found = random_of("numbers"), list[str]()
    for _ in range(count):
        digits = f"{rng.randrange(10 ** rng.randint(1, 21))}"
        place = rng.randint(0, len(digits))
        exponent = rng.choice(["", "", f"{rng.choice('eE')}{rng.choice(['', '+', '-'])}{rng.randint(0, 330)}"])
        found.append(digits[:place] + "." * rng.randint(0, 1) + digits[place:] + exponent)
        found.append(repr(struct.unpack("d", rng.randbytes(8))[0]))
        found.append(repr(rng.randrange(2**24) / 2_048_000))
    return [text for text in found if expected(text) != "none"]


def expected(text: str) -> str:
    """Return what Python makes of it; "none" for what float() takes beside plain numbers, and beyond the doubles."""
    if not PLAIN.fullmatch(text):
        return "none"
    value = float(text)
    beyond = math.isinf(value) or (value == 0 and re.search("[1-9]", re.split("[eE]", text)[0]))
    return "none" if beyond else f"{struct.unpack('Q', struct.pack('d', value))[0]:016x} {value!r}"


def test_the_nearest_double_and_the_shortest_text(tmp_path: Path) -> None:
    program = tmp_path / "numbers"
    run(need("c++"), *STRICT, "-O1", ROOT / "tests" / "cpp" / "numbers.cpp", "-o", program)
    given = [*SHORT_OR_LONG, *NONE, *drawn(draws(1500))]
    # At a power of two the nearest text with as many digits is not always one that gives it back.
    given += [repr(math.ldexp(1, exponent)) for exponent in range(-1074, 1024)]
    given += [repr(number * SMALLEST) for number in range(1, 500)]
    lines = "".join(f"{text}\n" for text in given)
    done = subprocess.run([program], input=lines.encode(), capture_output=True, check=True)
    found = done.stdout.decode().splitlines()
    for text, line in zip(given, found, strict=True):
        assert line == expected(text), text
