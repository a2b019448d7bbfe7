"""Numbers as text: two digits of the uncertainty, in Python; tests/live/test_page.py compares the page."""

import math
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st
from palpate import number_format

NAN = math.nan
INF = math.inf

PAIRS = [
    # value, uncertainty, number, plus_minus
    (1.600483, 4.7e-5, "1.600483", "1.600483 ± 0.000047"),
    (0.0996, 0.012, "0.100", "0.100 ± 0.012"),
    (0.0996, 0.0996, "0.10", "0.10 ± 0.10"),  # 0.0996 has two digits as 0.10, and not as 0.100
    (9.996, 0.10, "10.00", "10.00 ± 0.10"),
    (-4.149, 0.12, "-4.15", "-4.15 ± 0.12"),
    (-0.001, 0.12, "0.00", "0.00 ± 0.12"),  # no -0.00
    (0.3, 120.0, "0", "0 ± 120"),
    (123456.0, 1234.0, "123500", "123500 ± 1200"),
    (1234567.0, 1234.0, "1.2346e6", "1.2346e6 ± 1.2e3"),
    (1e-300, 1e-302, "1.000e-300", "1.000e-300 ± 1.0e-302"),
    (1.0, 1e300, "0", "0 ± 1.0e300"),
    (4.14902, NAN, "4.15", "4.15, uncertainty not known"),
    (4.45e-5, NAN, "4.45e-5", "4.45e-5, uncertainty not known"),
    (4.45e-4, NAN, "0.000445", "0.000445, uncertainty not known"),
    (0.0, NAN, "0.00", "0.00, uncertainty not known"),
    (NAN, 0.1, "-", "-, uncertainty not known"),
    (INF, 0.1, "inf", "inf, uncertainty not known"),
]


@pytest.mark.parametrize(("value", "uncertainty", "number", "both"), PAIRS)
def test_numbers(value: float, uncertainty: float, number: str, both: str) -> None:
    assert number_format.number(value, uncertainty) == number
    assert number_format.plus_minus(value, uncertainty) == both


@given(st.floats(1e-290, 1e290), st.floats(-290, 290), st.sampled_from([-1, 1]))
def test_what_is_printed_is_the_value_within_the_last_digit(
    value: float, power: float, sign: int
) -> None:
    uncertainty = 10.0**power
    printed = float(number_format.number(sign * value, uncertainty))
    # Half of the second digit, 0.05 of an uncertainty of one digit 1, is the most that rounding takes away; or nothing is
    # left of a value that is smaller than this digit; or a double has not as many digits.
    assert abs(printed - sign * value) <= max(0.1 * uncertainty, 1e-15 * value)
    if printed and 1e-4 < uncertainty / value < 0.01:
        mantissa = re.sub(r"e.*|[-.]", "", number_format.error(uncertainty)).lstrip("0")
        assert len(mantissa.rstrip("0")) <= 2


def test_intervals() -> None:
    assert number_format.between(1.0921, 0.9573, 1.2512) == ("1.09", "0.96", "1.25")
    assert number_format.between(9.94, 9.6, 10.61) == ("9.94", "9.60", "10.61")
    assert number_format.between(8.4, 6.0, 145.0) == ("8.4", "6.0", "140")
    assert number_format.between(0.5, 0.00101, 20.4) == ("0.50", "0.0010", "20")
    assert number_format.between(2.0, 2.0, 2.0) == ("2.00", "2.00", "2.00")
    assert number_format.between(4.0, 0.0, INF) == ("4.0", "0.0", "inf")
