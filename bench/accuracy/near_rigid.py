"""Eq. (2) near the ratio of a rigid object: rounding of the formula, and of the ratio that it gets."""

import subprocess
import tempfile
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path
from typing import NamedTuple

import numpy as np
import palpate

PROBE = (8.5, 1.25, 0.97)
"""Rigid ratio, half modulus and soft ratio of near_rigid.cpp."""
EPS = {"float32": 2.0**-23, "float64": 2.0**-52}


class Row(NamedTuple):
    """Errors at a ratio, in eps of its type.

    Attributes
    ----------
    left : float
        Distance of the ratio from that of a rigid object.
    modulus, slope : float
        Relative error of the result, against eq. (2) of the same numbers in exact arithmetic.
    back : float
        Error of the ratio that is computed from the modulus.
    given : float
        Relative change of the modulus if the ratio changes by half an eps of itself: how it was rounded.
    """

    type: str
    left: float
    modulus: float
    slope: float
    back: float
    given: float


def near_rigid() -> list[Row]:
    """Compile and run near_rigid.cpp, and compare it with exact arithmetic."""
    with tempfile.TemporaryDirectory() as folder:
        program, source = Path(folder) / "near_rigid", Path(__file__).with_suffix(".cpp")
        include = f"-I{palpate.get_include()}"
        subprocess.run(["c++", "-O2", "-std=c++17", "-ffp-contract=off", include, source, "-o", program], check=True)
        lines = subprocess.run([program], check=True, capture_output=True, text=True).stdout.splitlines()
    return [_row(type_, *map(float.fromhex, numbers)) for type_, *numbers in (line.split() for line in lines)]


def _row(type_: str, ratio: float, modulus: float, slope: float, back: float) -> Row:
    eps = Fraction(EPS[type_])
    rigid, half, soft = (Fraction(float(value)) for value in np.array(PROBE, type_))
    r = Fraction(ratio)
    exact = half * (r - soft) / (rigid - r)
    exact_slope = half * (rigid - soft) / (rigid - r) ** 2
    return Row(
        type_,
        float(rigid - r),
        float(abs(Fraction(modulus) / exact - 1) / eps),
        float(abs(Fraction(slope) / exact_slope - 1) / eps),
        float(abs(Fraction(back) - r) / (eps * rigid)),
        float(exact_slope * r / (2 * exact)),
    )


def near_rigid_table() -> Iterator[str]:
    """Print the errors near the rigid ratio."""
    yield f"eq. (2) near the rigid ratio, {PROBE[0]:g}: errors in eps; right: error of the modulus if r is rounded by half an eps"
    yield f"  {'':8} {'rigid - r':>10} {'modulus':>8} {'slope':>6} {'back to r':>10} {'eps':>12} {'that is':>9}"
    for row in near_rigid():
        share = 100 * row.given * EPS[row.type]
        yield (
            f"  {row.type:8} {row.left:10.1e} {row.modulus:8.2f} {row.slope:6.2f} {row.back:10.2f} {row.given:12.3g} "
            f"{share:7.1g} %"
        )
