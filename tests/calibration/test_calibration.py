"""Fitting eq. (2) to specimens, reading it backwards, and keeping it in a file."""

import re
import tomllib
from math import inf, isnan, nan
from pathlib import Path
from typing import Any

import numpy as np
import palpate
import pytest
import tomli_w
from effort import examples
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from palpate import Calibration, CalibrationError, digits
from palpate.elasticity import SORBOTHANE_MPA, Elasticity

PROBE = Elasticity()
MODULI = np.array(list(SORBOTHANE_MPA.values()))
FOUR = np.repeat(MODULI, 4)


def ratios(
    moduli: NDArray[np.float64], oblique: float = 0.03, seed: int = 1, probe: Elasticity = PROBE
) -> NDArray[np.float64]:
    random = np.random.default_rng(seed)
    return np.array([probe.ratio(E) for E in moduli]) * (1 + oblique * random.standard_normal(len(moduli)))


@pytest.fixture(scope="module")
def calibration() -> Calibration:
    return Calibration.fit(ratios(FOUR), FOUR, standard_errors=np.full(40, 2e-4), about={"scene": "handheld"})


@pytest.mark.parametrize("probe", [PROBE, Elasticity(3.0, 0.5), Elasticity(40.0, 9.0), Elasticity(1.5, 0.2)])
def test_exact_ratios_give_the_parameters_back(probe: Elasticity) -> None:
    found = Calibration.fit(ratios(MODULI, 0.0, probe=probe), MODULI)
    assert found.probe.rigid_ratio == pytest.approx(probe.rigid_ratio, rel=1e-8)
    assert found.probe.half_modulus == pytest.approx(probe.half_modulus, rel=1e-8)
    assert found.sound
    value, low, high = found.modulus(probe.ratio(1.0))
    assert low <= value <= high
    assert value == pytest.approx(1.0, rel=1e-7)


def test_the_third_parameter() -> None:
    probe = Elasticity(9.0, 2.0, 0.9)  # the hard channel's gain is 10 % too small
    data = ratios(FOUR, 0.01, probe=probe)
    wrong, right = Calibration.fit(data, FOUR), Calibration.fit(data, FOUR, soft_ratio=None)
    assert not wrong.sound
    assert "does not fit" in wrong.verdict
    assert right.sound
    for name, (low, high) in right.parameter_intervals().items():
        assert low < getattr(probe, name) < high
    assert right.fitted.covariance[2, 2] > 0
    assert wrong.fitted.covariance[2, 2] == 0
    given_ = Calibration.fit(data, FOUR, soft_ratio=0.9)
    assert given_.sound
    assert given_.probe.soft_ratio == 0.9


def test_covariance_and_scatter_are_what_they_are() -> None:
    """Over 300 calibrations: the stated variances against the true ones; a variance of 300 scatters by 8 %."""
    fits = [Calibration.fit(ratios(FOUR, seed=seed), FOUR) for seed in range(300)]
    parameters = np.array([f.fitted.parameters[:2] for f in fits])
    stated = np.mean([np.diag(f.fitted.covariance)[:2] for f in fits], axis=0)
    # The specimens' variance is 0 here, and an estimate cannot be below it: what is stated is somewhat more.
    assert stated / parameters.var(axis=0) == pytest.approx([1.1, 1.1], abs=0.3)
    # Biases: half a curvature times a variance, far below the scatter.
    assert np.abs(parameters.mean(axis=0) - [10, np.log(2)]) == pytest.approx([0, 0], abs=0.03)
    assert np.mean([f.touch_spread for f in fits]) == pytest.approx(0.03, rel=0.03)
    assert np.mean([f.specimen_spread for f in fits]) < 0.01
    assert np.mean([f.sound for f in fits]) > 0.97


def test_specimens_that_are_off_are_told_from_touches_that_scatter() -> None:
    off = np.repeat(1 + 0.06 * np.random.default_rng(3).standard_normal(10), 4)
    found = Calibration.fit(ratios(FOUR, 0.01) * off, FOUR)
    assert found.touch_spread == pytest.approx(0.01, rel=0.4)
    assert 0.03 < found.specimen_spread < 0.12
    assert not found.sound
    assert "degrees of freedom" in found.verdict
    assert len(found.residuals) == 10
    assert sum(r.touches for r in found.residuals) == 40
    assert np.sqrt(np.mean([r.standardised**2 for r in found.residuals])) == pytest.approx(0.9, abs=0.2)


def test_a_touch_with_a_large_standard_error_weighs_less() -> None:
    data, errors = ratios(FOUR, 0.01), np.full(40, 1e-3)
    clean = Calibration.fit(data, FOUR, standard_errors=errors)
    data[38] *= 1.3  # on the stiffest specimen
    errors[38] = 0.3 * data[38]
    weighted, unweighted = Calibration.fit(data, FOUR, standard_errors=errors), Calibration.fit(data, FOUR)
    true = clean.probe.rigid_ratio
    assert abs(weighted.probe.rigid_ratio / true - 1) < 0.01 < abs(unweighted.probe.rigid_ratio / true - 1)


def test_means_of_touches_count_as_many() -> None:
    means = ratios(FOUR).reshape(10, 4).mean(axis=1)
    one, four = Calibration.fit(means, MODULI), Calibration.fit(means, MODULI, touches=4)
    assert four.touch_spread == pytest.approx(2 * one.touch_spread, rel=1e-3)
    assert one.probe.rigid_ratio == pytest.approx(four.probe.rigid_ratio, rel=1e-6)
    a, b = one.modulus(4.0), four.modulus(4.0, touches=4)
    assert list(a) == pytest.approx(list(b), rel=1e-3)
    assert four.modulus(4.0).high > b.high


def test_the_interval_is_asymmetric_and_then_one_sided(calibration: Calibration) -> None:
    rigid = calibration.probe.rigid_ratio
    soft, middle, stiff = (calibration.modulus(share * rigid, 1e-3) for share in (0.3, 0.85, 0.98))
    for found in (soft, middle):
        value, low, high = found
        assert low < value < high < inf
        assert high - value > value - low
    assert (middle.high - middle.value) / (middle.value - middle.low) > 1.4
    assert stiff.high == inf
    assert stiff.low < stiff.value
    assert str(stiff).startswith("stiffer than ")
    assert str(soft).endswith(")")
    # In the limit the bound no longer moves with the ratio's last digits, where the value goes anywhere.
    near = [calibration.modulus(rigid * (1 - step), 1e-3) for step in (1e-3, 1e-6, 1e-9)]
    assert near[2].value > 1e5 * near[0].value
    assert near[2].low == pytest.approx(near[0].low, rel=0.02)


def test_wider_for_a_larger_error_and_a_higher_level(calibration: Calibration) -> None:
    narrow, wide = calibration.modulus(5.0, 0.01), calibration.modulus(5.0, 0.5)
    assert wide.low < narrow.low < narrow.high < wide.high
    higher = calibration.modulus(5.0, 0.01, level=0.99)
    assert higher.low < narrow.low < narrow.high < higher.high
    assert narrow.value == higher.value


def test_no_answer_has_a_reason(calibration: Calibration) -> None:
    rigid = calibration.probe.rigid_ratio
    above, far = calibration.modulus(rigid * 1.01), calibration.modulus(rigid * 2)
    assert isnan(above.value)
    assert 0 < above.low < above.high == inf
    assert above.reason == f"the ratio is not below {digits.number(rigid)}, the ratio of a rigid object"
    assert str(above) == f"stiffer than {digits.number(above.low)} MPa"
    assert all(map(isnan, far))
    assert far.reason.endswith("the difference is larger than the uncertainty")
    assert str(far) == "no modulus agrees with this ratio"
    below, nothing = calibration.modulus(0.99), calibration.modulus(0.2)
    assert (isnan(below.value), below.low) == (True, 0.0)
    assert 0 < below.high < 0.1
    assert str(below).startswith("softer than")
    assert str(nothing) == "no modulus agrees with this ratio"
    assert str(calibration.modulus(5.0, 50.0)) == "every modulus agrees with this ratio"
    assert below.as_dict()["value_MPa"] is None
    assert above.as_dict()["high_MPa"] is None


def test_extrapolation_is_flagged(calibration: Calibration) -> None:
    assert calibration.range == (0.143, 8.68)
    flags = {E: calibration.modulus(calibration.probe.ratio(E)).extrapolated for E in (0.1, 0.15, 8.0, 9.0)}
    assert flags == {0.1: True, 0.15: False, 8.0: False, 9.0: True}
    assert calibration.modulus(20.0).extrapolated


def test_verdicts() -> None:
    data = ratios(FOUR)
    swapped = data.copy()
    swapped[4:8] *= 1.3
    assert "does not rise with the modulus between 0.186 and 0.289 MPa" in Calibration.fit(swapped, FOUR).verdict
    soft_only = Calibration.fit(data[:12], FOUR[:12])
    assert "rigid ratio is not determined" in soft_only.verdict
    assert not soft_only.sound
    single = Calibration.fit(data[::4], MODULI)
    assert "cannot be separated" in single.verdict
    good = Calibration.fit(data, FOUR)
    assert good.verdict.startswith("The curve fits. 10 specimens, 40 values.")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (([2.0, 3.0], [1.0]), r"moduli: got shape \(1,\)"),
        (([2.0, nan, 3.0], [1.0, 2.0, 3.0]), "ratios: got nan"),
        (([2.0, -1.0, 3.0], [1.0, 2.0, 3.0]), "ratios: got -1.0"),
        (([2.0, 3.0, 4.0], [1.0, 0.0, 3.0]), "moduli: got 0.0"),
        (([2.0, 3.0, 4.0], [1.0, 2.0, inf]), "moduli: got inf"),
    ],
)
def test_arguments_that_are_wrong(arguments: tuple[list[float], list[float]], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Calibration.fit(*arguments)


def test_options_that_are_wrong(calibration: Calibration) -> None:
    with pytest.raises(ValueError, match=r"standard_errors: got -1\.0"):
        Calibration.fit(MODULI, MODULI, standard_errors=np.full(10, -1.0))
    with pytest.raises(ValueError, match=r"touches: got 0\.0"):
        Calibration.fit(MODULI, MODULI, touches=0)
    with pytest.raises(ValueError, match="soft_ratio: got nan"):
        Calibration.fit(MODULI, MODULI, soft_ratio=nan)
    wrong: list[tuple[dict[str, Any], str]] = [
        ({"ratio": nan}, "ratio: got nan"),
        ({"ratio": 5.0, "standard_error": -1.0}, "standard_error: got -1.0"),
        ({"ratio": 5.0, "standard_error": nan}, "standard_error: got nan"),
        ({"ratio": 5.0, "touches": 0}, "touches: got 0"),
        ({"ratio": 5.0, "level": 1.0}, "level: got 1.0"),
    ]
    for arguments, message in wrong:
        with pytest.raises(ValueError, match=message):
            calibration.modulus(**arguments)


def test_specimens_that_make_no_calibration() -> None:
    with pytest.raises(CalibrationError, match="got 2 specimens, allowed: 3 or more"):
        Calibration.fit([2.0, 2.1, 3.0], [1.0, 1.0, 2.0])
    with pytest.raises(CalibrationError, match="got 3 specimens, allowed: 4 or more"):
        Calibration.fit([2.0, 3.0, 4.0], [1.0, 2.0, 3.0], soft_ratio=None)
    for falling in (MODULI[::-1], np.full(10, 3.0), 1 + MODULI):
        with pytest.raises(CalibrationError, match="do not follow the S-shaped curve"):
            Calibration.fit(falling, MODULI)


def test_saved_and_loaded(calibration: Calibration, tmp_path: Path) -> None:
    path = tmp_path / "probe.toml"
    calibration.save(path)
    loaded = Calibration.load(path)
    for ratio in (1.5, 5.0, 9.9):
        assert list(loaded.modulus(ratio, 0.01)) == list(calibration.modulus(ratio, 0.01))
    assert (loaded.verdict, loaded.about, loaded.version) == (
        calibration.verdict,
        {"scene": "handheld"},
        palpate.__version__,
    )
    again = Calibration.fit(
        loaded.ratios, loaded.moduli, standard_errors=loaded.standard_errors, touches=loaded.touches
    )
    assert np.array_equal(again.fitted.parameters, calibration.fitted.parameters)
    text = tomllib.loads(path.read_text())
    assert text["units"]["modulus"] == "MPa"
    assert text["palpate"] == palpate.__version__
    assert text["fit"]["rigid_ratio"] == calibration.probe.rigid_ratio
    assert text["data"]["moduli_MPa"] == FOUR.tolist()
    assert [p.name for p in tmp_path.iterdir()] == ["probe.toml"]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("schema = 1", "schema = 2", "schema: got 2"),
        ("schema = 1", "", "'schema' is missing"),
        ("touch_freedom = 30", "touch_freedom = -1", "touch_freedom: got -1"),
        ("touch_freedom = 30", 'touch_freedom = "many"', "touch_freedom: got 'many'"),
        ("[scatter]", "[scattered]", "'scatter' is missing"),
        ("touch_variance = ", "touch_variance = -", "touch_variance: got -"),
        ("[units]", "[units", "not a calibration"),
        ("parameters = [", "parameters = [ nan,", "parameters: got shape"),
    ],
)
def test_a_file_that_is_no_calibration(
    calibration: Calibration, tmp_path: Path, old: str, new: str, message: str
) -> None:
    path = tmp_path / "probe.toml"
    calibration.save(path)
    assert old in path.read_text()
    path.write_text(path.read_text().replace(old, new, 1))
    with pytest.raises(CalibrationError, match="not a calibration") as caught:
        Calibration.load(path)
    assert message in str(caught.value)


@pytest.mark.parametrize(
    ("table", "key", "value", "message"),
    [
        ("fit", "parameters", [1.0, 0.0, 2.0], "parameters: got [1.0, 0.0, 2.0], allowed: soft_ratio < rigid_ratio"),
        ("scatter", "specimen_share", 1.5, "specimen_share: got 1.5, allowed: 0 to 1"),
        ("data", "touches", [0.0] * 40, "touches: got no value, or a value that is not positive"),
        ("data", "moduli_MPa", [-1.0] * 40, "moduli_MPa: got no value, or a value that is not positive"),
    ],
)
def test_numbers_that_no_calibration_has(
    calibration: Calibration, tmp_path: Path, table: str, key: str, value: Any, message: str
) -> None:
    path = tmp_path / "probe.toml"
    calibration.save(path)
    document = tomllib.loads(path.read_text())
    assert key in document[table]
    document[table][key] = value
    path.write_text(tomli_w.dumps(document))
    with pytest.raises(CalibrationError, match=re.escape(message)):
        Calibration.load(path)


def test_a_file_too_large_is_not_read(tmp_path: Path) -> None:
    path = tmp_path / "probe.toml"
    with path.open("wb") as file:
        file.truncate(10_000_001)
    with pytest.raises(CalibrationError, match="larger than 1,000,000 bytes"):
        Calibration.load(path)


@pytest.mark.parametrize("error", [1e80, 1e160, 1e300])
def test_a_standard_error_beyond_sense_tells_nothing(calibration: Calibration, error: float) -> None:
    found = calibration.modulus(2.5, error)
    assert (found.low, found.high) == (0.0, inf)


@pytest.fixture(scope="module")
def text(calibration: Calibration, tmp_path_factory: pytest.TempPathFactory) -> str:
    path = tmp_path_factory.mktemp("saved") / "probe.toml"
    calibration.save(path)
    return path.read_text()


@examples(100)
@given(st.data())
def test_a_file_cut_or_overwritten_is_refused_or_right(
    text: str, tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    at = data.draw(st.integers(0, len(text) - 1))
    cut = st.just(text[:at])
    changed = data.draw(cut | st.text(max_size=8).map(lambda new: text[:at] + new + text[at + 4 :]))
    path = tmp_path_factory.getbasetemp() / "fuzzed.toml"
    path.write_text(changed, encoding="utf-8", errors="replace")
    try:
        found = Calibration.load(path)
    except CalibrationError:
        return
    value, low, high = found.modulus(5.0, 0.01)
    assert isnan(low) or low <= high
    assert isnan(value) or isnan(low) or low <= value <= high
