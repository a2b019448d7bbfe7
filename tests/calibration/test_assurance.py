"""A specimen of known modulus compared with a calibration: probabilities, the file, and the warning."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from math import inf, isnan, log, nan
from pathlib import Path

import numpy as np
import palpate
import pytest
from numpy.typing import NDArray
from palpate import Calibration, Touch
from palpate.calibration.assessment import calibration_doubts
from palpate.calibration.assurance import (
    DOUBT,
    CalibrationVerification,
    Comparison,
    compare,
)
from palpate.calibration.calibration_file import MOST_VERIFICATIONS, add_verification
from palpate.calibration.fit import CurveFit
from palpate.calibration.interval import MeasuredRatio
from palpate.calibration.modulus import Modulus
from palpate.elasticity import SORBOTHANE_MPA, Elasticity
from palpate.errors import CalibrationError
from palpate.file_locks import exclusive_change
from palpate.files import read_toml
from project import FOUR

Array = NDArray[np.float64]
PROBE = Elasticity()
MODULI = np.repeat(list(SORBOTHANE_MPA.values()), 4)
SCATTER = 0.02  # of a touch
TOUCHES = 4
GEL_MPA = 1.1
SESSIONS = 300
AGREES = CalibrationVerification(
    "gel", "2026-11-29", 1.1, 0.0, Modulus(1.1, 1.0, 1.2), 4, 0.5, 0.03
)
DISAGREES = replace(AGREES, date="2026-11-30", probability=1e-5)


def ratios_on(moduli: Array, random: np.random.Generator) -> Array:
    true = np.array([PROBE.ratio(modulus) for modulus in moduli])
    return np.asarray(true * (1 + SCATTER * random.standard_normal(len(moduli))))


@pytest.fixture(scope="module")
def calibration() -> Calibration:
    return Calibration.fit(ratios_on(MODULI, np.random.default_rng(1)), MODULI)


@dataclass(frozen=True)
class Session:
    """A calibration, and the mean of four later touches on the gel."""

    fit: CurveFit
    ratio: float

    def compared(
        self, gain: float = 1.0, modulus: float = GEL_MPA, uncertainty: float = 0.0
    ) -> Comparison:
        """Compare the touches, with another gain of the hard channel, with a stated modulus."""
        measured = MeasuredRatio(gain * self.ratio, touches=TOUCHES)
        return compare(self.fit, measured, log(modulus), uncertainty)


@pytest.fixture(scope="module")
def sessions() -> list[Session]:
    """Sessions whose touches differ by their scatter alone."""
    random = np.random.default_rng(49)
    made = []
    for _ in range(SESSIONS):
        found = Calibration.fit(ratios_on(MODULI, random), MODULI)
        later = ratios_on(np.full(TOUCHES, GEL_MPA), random)
        made.append(Session(found.fitted, float(later.mean())))
    return made


def share(sessions: list[Session], is_so: Callable[[Session], bool]) -> float:
    return float(np.mean([is_so(session) for session in sessions]))


@pytest.mark.parametrize("limit", [0.1, 0.25, 0.5, 0.75])
def test_probabilities_without_a_change_are_uniform(sessions: list[Session], limit: float) -> None:
    """Four standard deviations of a share p of 300, sqrt(p (1 - p) / 300), are at most .12."""
    below = share(sessions, lambda session: session.compared().probability < limit)
    assert below == pytest.approx(limit, abs=4 * (limit * (1 - limit) / SESSIONS) ** 0.5)


def test_false_warnings_are_rare(sessions: list[Session]) -> None:
    assert share(sessions, lambda session: session.compared().probability < DOUBT) <= 0.03


def test_false_warnings_are_rare_with_a_stated_uncertainty(sessions: list[Session]) -> None:
    """The stated modulus is wrong by 5 % rms; if that is not stated, warnings are frequent."""
    random = np.random.default_rng(50)
    wrong = GEL_MPA * np.exp(0.05 * random.standard_normal(SESSIONS))
    stated = []
    unstated = []
    for session, modulus in zip(sessions, wrong.tolist(), strict=True):
        stated.append(session.compared(modulus=modulus, uncertainty=0.05).probability < DOUBT)
        unstated.append(session.compared(modulus=modulus).probability < DOUBT)
    assert np.mean(stated) <= 0.03
    assert np.mean(unstated) > 0.05


@pytest.mark.parametrize("sign", [-1, 1])
def test_the_change_that_is_named_is_noticed(sessions: list[Session], sign: int) -> None:
    """In 95 of 100: four standard deviations of 300 are .05. The estimate of the error is rough."""

    def is_noticed(session: Session) -> bool:
        gain = 1 + sign * session.compared().noticed
        return session.compared(gain).probability < DOUBT

    assert 0.9 <= share(sessions, is_noticed) <= 0.999


def test_an_exact_calibration_notices_every_difference() -> None:
    fit = CurveFit(
        np.array([10.0, log(2.0), 1.0]),
        np.zeros((3, 3)),
        touch_variance=0.0,
        touch_freedom=30,
        specimen_variance=0.0,
        specimen_freedom=8,
        specimen_share=0.0,
        misfit=0.0,
        modulus_share=0.0,
    )
    ratio = Elasticity(10.0, 2.0).ratio(2.0)
    assert compare(fit, MeasuredRatio(ratio), log(2.0), 0.0) == Comparison(1.0, 0.0)
    assert compare(fit, MeasuredRatio(1.001 * ratio), log(2.0), 0.0) == Comparison(0.0, 0.0)


@pytest.fixture(scope="module")
def touch() -> Touch:
    return palpate.touches(palpate.read(FOUR))[1]


def test_the_sentence_names_the_change_that_would_show(
    calibration: Calibration, touch: Touch
) -> None:
    known = PROBE.modulus(touch.ratio)
    found = calibration.verify([touch] * 4, known, specimen="gel", date="2026-11-29")
    assert found.agrees
    assert 0.01 < found.noticed < 0.2
    assert f"(a change of the ratio by {100 * found.noticed:.2g} % or more would show)" in str(
        found
    )


@pytest.mark.parametrize(
    ("modulus", "uncertainty", "message"),
    [
        (0.0, 0.0, "modulus: got 0.0, allowed: a positive number, MPa"),
        (inf, 0.0, "modulus: got inf, allowed"),
        (1.0, -0.1, "modulus_uncertainty: got -0.1, allowed: 0 or more, relative"),
    ],
)
def test_wrong_values_are_refused(
    calibration: Calibration, touch: Touch, modulus: float, uncertainty: float, message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        calibration.verify([touch], modulus, uncertainty)


def test_touches_that_do_not_count_are_refused(calibration: Calibration, touch: Touch) -> None:
    with pytest.raises(ValueError, match="touches: got 1, none counts, allowed: at least one"):
        calibration.verify([replace(touch, age_s=1.3)], 1.0)


@pytest.mark.parametrize(
    "measured",
    [
        Modulus(1.3, 1.2, 1.4),
        Modulus(nan, 30.0, inf),
        Modulus(nan, 0.0, 0.1),
        Modulus(nan, nan, nan),
    ],
)
def test_a_comparison_is_read_as_it_was_written(
    calibration: Calibration, tmp_path: Path, measured: Modulus
) -> None:
    path = tmp_path / "probe.toml"
    calibration.save(path)
    before = read_toml(path)
    written = replace(AGREES, measured=measured)
    add_verification(path, written)
    after = read_toml(path)
    [read] = Calibration.load(path).verifications
    assert str(read) == str(written)
    assert repr(read) == repr(written)
    del after["verifications"]
    assert after == before


def test_a_comparison_of_unknown_resolution_is_read(
    calibration: Calibration, tmp_path: Path
) -> None:
    path = tmp_path / "probe.toml"
    replace(calibration, verifications=(replace(AGREES, noticed=nan),)).save(path)
    [read] = Calibration.load(path).verifications
    assert isnan(read.noticed)
    assert str(read).endswith("the calibration holds")


def test_the_newest_comparison_decides(calibration: Calibration, tmp_path: Path) -> None:
    path = tmp_path / "probe.toml"
    calibration.save(path)
    assert calibration.newest_verification is None
    assert calibration.is_reliable
    add_verification(path, DISAGREES)
    add_verification(path, AGREES)  # of an earlier recording
    worn = Calibration.load(path)
    assert worn.newest_verification == DISAGREES
    assert not worn.is_reliable
    [doubt] = calibration_doubts(worn, "handheld")
    assert "gel (1.10 MPa)" in doubt
    assert "2026-11-30" in doubt
    add_verification(path, replace(AGREES, date="2026-11-30"))  # on the same day, later
    repaired = Calibration.load(path)
    assert repaired.is_reliable
    assert calibration_doubts(repaired, "handheld") == []


def test_results_that_are_added_at_once_are_all_kept(
    calibration: Calibration, tmp_path: Path
) -> None:
    path = tmp_path / "probe.toml"
    calibration.save(path)
    results = [replace(AGREES, specimen=f"gel {number}") for number in range(12)]
    with ThreadPoolExecutor(len(results)) as pool:
        list(pool.map(partial(add_verification, path), results))
    kept = {one.specimen for one in Calibration.load(path).verifications}
    assert kept == {one.specimen for one in results}
    assert [file.name for file in tmp_path.iterdir()] == [path.name]  # no lock is left


def test_a_change_that_does_not_end_is_said(
    calibration: Calibration, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("palpate.file_locks._CHANGE_WAIT_S", 0.05)
    path = tmp_path / "probe.toml"
    calibration.save(path)
    with exclusive_change(path), pytest.raises(BlockingIOError, match="another program"):
        add_verification(path, AGREES)
    assert not Calibration.load(path).verifications


def test_a_file_keeps_the_newest_comparisons(calibration: Calibration, tmp_path: Path) -> None:
    path = tmp_path / "probe.toml"
    many = tuple(replace(AGREES, touches=number) for number in range(1, MOST_VERIFICATIONS + 1))
    replace(calibration, verifications=many).save(path)
    add_verification(path, DISAGREES)
    kept = Calibration.load(path).verifications
    assert len(kept) == MOST_VERIFICATIONS
    assert kept[0].touches == 2
    assert kept[-1] == DISAGREES


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("probability = 0.5", "probability = 1.5", "allowed: a positive number, and 0 to 1"),
        ("known_MPa = 1.1", "known_MPa = nan", "got known_MPa nan"),
        ("known_MPa = 1.1", 'known_MPa = "much"', "could not convert"),
        ('specimen = "gel"', "", "'specimen' is missing"),
    ],
)
def test_a_damaged_comparison_is_no_calibration(
    calibration: Calibration, tmp_path: Path, old: str, new: str, message: str
) -> None:
    path = tmp_path / "probe.toml"
    replace(calibration, verifications=(AGREES,)).save(path)
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(CalibrationError, match=message):
        Calibration.load(path)
    with pytest.raises(CalibrationError, match=message):
        add_verification(path, AGREES)


def test_comparisons_that_are_no_tables_are_no_calibration(
    calibration: Calibration, tmp_path: Path
) -> None:
    path = tmp_path / "probe.toml"
    calibration.save(path)
    path.write_text(f'verifications = ["x"]\n{path.read_text()}')
    with pytest.raises(CalibrationError, match="verifications: got 'x', allowed: tables"):
        Calibration.load(path)
