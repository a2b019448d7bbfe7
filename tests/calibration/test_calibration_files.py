"""What a calibration file keeps, a file of an earlier version, and one that is no calibration."""

import re
from collections.abc import Callable
from dataclasses import replace
from math import isnan, log, nan
from pathlib import Path

import numpy as np
import pytest
import tomli_w
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from palpate import Calibration
from palpate.calibration.assurance import CalibrationVerification
from palpate.calibration.calibration_file import Table
from palpate.calibration.evidence import EXPONENTS
from palpate.calibration.exponent_fits import ExponentFit
from palpate.calibration.fit import CurveFit
from palpate.calibration.modulus import Modulus
from palpate.calibration.ranges import BEND, Range, Ranges
from palpate.elasticity import Elasticity
from palpate.errors import CalibrationError
from palpate.files import read_toml
from project import ROOT
from tilted_touch import tilted_touch

EARLIER = ROOT / "tests" / "data" / "calibration-schema-1.toml"
"""As the first schema was written: level ratios of flat bumps, on four specimens."""
PROBE = Elasticity()
MODULI = (0.2, 0.6, 1.5, 5.0)

POSITIVE = st.floats(1e-6, 1e3)
RANGES = st.one_of(
    st.just(Range()),
    st.lists(POSITIVE, min_size=2, max_size=2).map(lambda ends: Range(*sorted(ends))),
)


@st.composite
def curves(draw: st.DrawFn) -> CurveFit:
    """Draw a curve whose covariance is a product with itself."""
    root = np.array(draw(st.lists(st.floats(-1, 1), min_size=9, max_size=9))).reshape(3, 3)
    parameters = [draw(st.floats(5, 20)), draw(st.floats(-3, 3)), draw(st.floats(0.5, 2))]
    return CurveFit(
        np.array(parameters),
        root @ root.T,
        touch_variance=draw(st.floats(0, 1)),
        touch_freedom=draw(st.integers(0, 100)),
        specimen_variance=draw(st.floats(0, 1)),
        specimen_freedom=draw(st.integers(1, 100)),
        specimen_share=draw(st.floats(0, 1)),
        misfit=draw(st.floats(0, 100)),
        modulus_share=draw(st.floats(0, 1)),
    )


@st.composite
def fits(draw: st.DrawFn) -> tuple[ExponentFit, ...]:
    """Draw the fits of some exponents, of which one is the likeliest."""
    exponents = draw(st.lists(st.floats(1.0, 3.0), min_size=1, max_size=4, unique=True))
    likeliest = draw(st.sampled_from(exponents))
    found = []
    for exponent in sorted(exponents):
        weight = 0.0 if exponent == likeliest else draw(st.floats(-1e3, 0.0))
        slope = draw(st.floats(-0.1, 0.1))
        error = draw(st.floats(0, 0.1))
        found.append(ExponentFit(exponent, draw(curves()), slope, error, weight))
    return tuple(found)


@st.composite
def ranges(draw: st.DrawFn) -> Ranges:
    """Draw ranges, of which some are unknown."""
    depth = draw(RANGES)
    middle = draw(st.floats(depth.low, depth.high)) if depth.is_known else nan
    tilt = draw(st.one_of(st.just(nan), st.floats(0, 1)))
    return Ranges(tilt, depth, draw(RANGES), middle)


VERIFICATIONS = st.builds(
    CalibrationVerification,
    specimen=st.text(max_size=8),
    date=st.sampled_from(["", "2026-11-29"]),
    known=POSITIVE,
    known_uncertainty=st.floats(0, 0.9),
    measured=POSITIVE.map(lambda value: Modulus(value, 0.9 * value, 1.2 * value)),
    touches=st.integers(1, 100),
    probability=st.floats(0, 1),
)


def calibration() -> Calibration:
    ratios = [PROBE.ratio(modulus) * factor for modulus in MODULI for factor in (0.997, 1.003)]
    return Calibration.fit(ratios, np.repeat(MODULI, 2))


@pytest.fixture
def rewritten(tmp_path: Path) -> Callable[..., Calibration]:
    """Return a function: a change of the table of a file, to the calibration in it."""

    def load(change: Callable[[Table], None], of: Path = EARLIER) -> Calibration:
        table = read_toml(of)
        change(table)
        path = tmp_path / "probe.toml"
        path.write_bytes(tomli_w.dumps(table).encode())
        return Calibration.load(path)

    return load


# There and back


@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    fits=fits(),
    ranges=ranges(),
    verifications=st.lists(VERIFICATIONS, max_size=3).map(tuple),
    share=st.floats(0, 1),
)
def test_a_file_keeps_everything(
    tmp_path: Path,
    fits: tuple[ExponentFit, ...],
    ranges: Ranges,
    verifications: tuple[CalibrationVerification, ...],
    share: float,
) -> None:
    saved = replace(
        calibration(),
        ratio="level",
        contact_exponent=fits[0].contact_exponent,
        exponent_fits=fits,
        ranges=ranges,
        verifications=verifications,
        error_share=share,
    )
    path = tmp_path / "probe.toml"
    saved.save(path)
    loaded = Calibration.load(path)
    assert loaded.as_dict() == saved.as_dict()
    assert loaded.verifications == verifications
    assert repr(loaded.ranges) == repr(ranges)  # nan equals nan
    for before, after in zip(fits, loaded.exponent_fits, strict=True):
        assert replace(after, fitted=before.fitted) == before
        assert repr(after) == repr(before)
    assert loaded.possible_exponents == saved.possible_exponents


def test_a_modulus_is_the_same_to_the_last_bit(tmp_path: Path) -> None:
    saved = Calibration.load(EARLIER)
    path = tmp_path / "probe.toml"
    saved.save(path)
    loaded = Calibration.load(path)
    touch = tilted_touch(4.0, 0.02, measured=1.0)
    assert loaded.modulus_of(touch) == saved.modulus_of(touch)
    assert loaded.differences(touch) == saved.differences(touch)


# A file of an earlier version


def test_an_earlier_file_leaves_all_exponents_open() -> None:
    found = Calibration.load(EARLIER)
    assert (found.ratio, found.contact_exponent, found.error_share) == ("level", 1.0, 1.0)
    assert found.possible_exponents == (1.0, 1.5)
    assert [fit.contact_exponent for fit in found.exponent_fits] == EXPONENTS.tolist()
    assert all(fit.fitted is found.fitted for fit in found.exponent_fits)
    assert {(fit.depth_slope, fit.depth_slope_error) for fit in found.exponent_fits} == {(0, BEND)}
    assert found.ranges.unknown == ["tilt", "depth", "rise"]
    assert found.verifications == ()
    assert (found.modulus_uncertainties == 0).all()
    assert found.sound


def test_an_earlier_file_has_wider_intervals() -> None:
    """It does not know how its touches were held: with their ranges the same touch is narrower."""
    found = Calibration.load(EARLIER)
    ranges = Ranges(0.05, Range(0.5, 1.5), Range(0.2, 0.5), 1.0)
    touch = tilted_touch(4.0, 0.03, exponent=1.0, measured=1.0)
    only = replace(found, exponent_fits=found.exponent_fits[:1])
    widths = []
    for one in (found, replace(found, ranges=ranges), only):
        interval = one.modulus_of(touch)
        widths.append(log(interval.high / interval.low))
    interval = found.modulus_of(touch)
    assert interval.low < PROBE.modulus(4.0) < interval.high
    assert widths[0] > 1.1 * widths[1]
    assert widths[0] > 1.5 * widths[2]


def test_an_earlier_file_of_the_hold_has_one_exponent(
    rewritten: Callable[..., Calibration],
) -> None:
    """A touch has no tilt that it could be compared with: the whole tilt counts."""

    def without_touch(table: Table) -> None:
        del table["touch"]

    found = rewritten(without_touch)
    assert (found.ratio, found.possible_exponents) == ("hold", (1.0, 1.0))
    level = found.modulus_of(tilted_touch(4.0, 0.0))
    tilted = found.modulus_of(tilted_touch(4.0, 0.03, measured=1.0))
    assert log(tilted.high / tilted.low) > 4 * log(level.high / level.low)


def test_an_earlier_file_is_saved_as_a_new_one(tmp_path: Path) -> None:
    found = Calibration.load(EARLIER)
    path = tmp_path / "probe.toml"
    found.save(path)
    assert read_toml(EARLIER)["schema"] == 1
    table = read_toml(path)
    assert table["schema"] == 2
    assert len(table["exponents"]) == len(EXPONENTS)
    assert table["ranges"] == {}


# No calibration


def exponent(**values: object) -> Callable[[Table], None]:
    """Return a change of the first exponent."""
    return lambda table: table["exponents"][0].update(values)


def of_ranges(**values: object) -> Callable[[Table], None]:
    return lambda table: table["ranges"].update(values)


def of_all(weight: float) -> Callable[[Table], None]:
    def change(table: Table) -> None:
        for one in table["exponents"]:
            one["log_weight"] = weight

    return change


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (exponent(contact_exponent=0.9), "contact_exponent: got 0.9, allowed: 1 to 3"),
        (exponent(depth_slope="steep"), "depth_slope: got 'steep'"),
        (exponent(depth_slope_error=-1.0), "depth_slope_error: got -1.0"),
        (exponent(log_weight=0.5), "log_weight: got 0.5"),
        (exponent(parameters=[1.0, 0.0, 2.0]), "allowed: soft_ratio < rigid_ratio"),
        (exponent(touch_freedom=-1), "touch_freedom: got -1"),
        (
            lambda table: table["touch"].update(contact_exponent=1.05),
            "contact_exponent: got 1.05, allowed: one of [[exponents]]",
        ),
        (of_all(-3.0), "log_weight: got at most -3, allowed: 0 for the likeliest"),
        (of_ranges(tilt=-0.1), "tilt: got -0.1"),
        (of_ranges(tilt=nan), "tilt: got nan"),
        (of_ranges(depth_pF=[0.5, 1.0], middle_pF=1.5), "middle_pF: got 1.5, allowed: 0.5 to 1"),
        (of_ranges(depth_pF=[0.5, 1.0]), "'middle_pF' is missing"),
        (of_ranges(depth_pF=[0.5], middle_pF=0.5), "depth_pF: got shape"),
        (of_ranges(rise_s=[0.5, 0.2]), "rise_s: got 0.5 before 0.2"),
        (of_ranges(rise_s=[0.0, 0.2]), "rise_s: got no value, or a value that is not positive"),
        (of_ranges(rise_s=[nan, 0.2]), "rise_s: got shape"),
        (lambda table: table.update(ranges=3), "not a calibration"),
        (lambda table: table.update(exponents=3), "not a calibration"),
        (lambda table: table.update(exponents="ab"), "not a calibration"),
        (lambda table: table.update(verifications=[{"specimen": "gel"}]), "'known_MPa' is missing"),
        (lambda table: table.update(schema=3), "schema: got 3, allowed: 1 or 2"),
        (lambda table: table.update(schema="1"), "schema: got '1', allowed: 1 or 2"),
    ],
)
def test_a_file_that_is_no_calibration(
    rewritten: Callable[..., Calibration],
    tmp_path: Path,
    change: Callable[[Table], None],
    message: str,
) -> None:
    path = tmp_path / "new.toml"
    Calibration.load(EARLIER).save(path)
    assert not isnan(rewritten(lambda _: None, path).fitted.misfit)
    with pytest.raises(CalibrationError, match=re.escape(message)):
        rewritten(change, path)
