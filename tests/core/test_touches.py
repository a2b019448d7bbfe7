"""Finding touches and estimating each, on made-up presses and on the recording that comes with the project."""

import runpy
from collections.abc import Iterable
from typing import Any

import numpy as np
import palpate
import pytest
from numpy.typing import NDArray
from project import ROOT

FOUR = ROOT / "tests" / "data" / "four-specimens.csv"
MAKER = ROOT / "tests" / "data" / "make_four_specimens.py"


def presses(heights: Iterable[float], *, hold: int = 300, idle: int = 80, noise: float = 0.0005) -> NDArray[np.float64]:
    """Soft-channel changes: idle, then each press with a rise of 10 samples and a fall of 6, then idle."""
    random = np.random.default_rng(5)
    parts = [np.zeros(idle)]
    for height in heights:
        parts += [np.linspace(0, height, 10), np.full(hold, height), np.linspace(height, 0, 6), np.zeros(idle)]
    clean = np.concatenate(parts)
    return clean + noise * random.standard_normal(clean.size)


def made(hard: NDArray[np.float64], soft: NDArray[np.float64]) -> palpate.Recording:
    """Make a recording of two channels that were read at once, 40 a second: 6.5 s are 260 of them."""
    t = np.arange(len(hard)) / 40
    return palpate.Recording(t, t, hard, soft)


def recording(soft: NDArray[np.float64], ratio: float = 2.5) -> palpate.Recording:
    noise = 0.0005 * np.random.default_rng(6).standard_normal(soft.size)
    return made(9 + ratio * soft + noise, 8 + soft)


def test_every_touch_is_found_once_and_at_its_start() -> None:
    heights = [0.2, 0.4, 0.1]
    found = palpate.touches(recording(presses(heights)))
    assert len(found) == 3
    for number, touch in enumerate(found):
        true_start = 80 + number * (10 + 300 + 6 + 80)
        assert 0 <= touch.start_s * 40 - true_start <= 3
        assert touch.samples in (259, 260, 261)
        assert touch.flags == ()
        assert touch.ratio == pytest.approx(2.5, rel=0.005)
    assert found[1].covariance < found[0].covariance < found[2].covariance


def test_a_press_may_lower_the_capacitances() -> None:
    [touch] = palpate.touches(recording(-presses([0.2])))
    assert touch.ratio == pytest.approx(2.5, rel=0.005)


def test_a_short_touch_and_one_cut_off_by_the_end() -> None:
    [touch] = palpate.touches(recording(presses([0.2], hold=50)))
    assert touch.flags == ("short",)
    assert 50 <= touch.samples <= 66
    [touch] = palpate.touches(recording(presses([0.2])[:200]))
    assert touch.flags == ("short",)


def test_noise_alone_is_no_touch() -> None:
    for noise in (0.0, 1e-5, 0.01, 10.0):
        assert palpate.touches(recording(presses([], idle=5000, noise=noise))) == []
    empty = np.empty(0)
    assert palpate.touches(made(empty, empty)) == []


def test_a_drift_between_touches_does_not_bias_the_next() -> None:
    soft = presses([0.2, 0.2, 0.2])
    drift = np.linspace(0, 0.05, soft.size)
    whole = made(9 + 2.5 * soft + drift, 8 + soft - drift)
    found = palpate.touches(whole)
    assert len(found) == 3
    # 300 samples of drift under each touch are 0.015 pF: 3 % of the hard press, 7 % of the soft one.
    assert [t.ratio for t in found] == pytest.approx([2.5] * 3, rel=0.15)
    assert np.ptp([t.ratio for t in found]) < 0.02


def test_samples_without_a_value_are_left_out() -> None:
    whole = recording(presses([0.2]))
    whole.hard[[5, 100, 101, 150]] = np.nan
    whole.soft[[7, 200]] = np.nan
    [touch] = palpate.touches(whole)
    assert 240 <= touch.samples < 260
    assert touch.ratio == pytest.approx(2.5, rel=0.005)


def test_a_touch_that_hardly_moves_the_prior_is_flagged() -> None:
    soft = presses([0.001], noise=0.0)
    light = made(9 + 2.5 * soft, 8 + soft)
    [kept] = palpate.touches(light, scene="paper", initial_covariance=1e4)
    assert kept.flags == ("unexcited",)
    assert kept.ratio < 2.4
    [touch] = palpate.touches(light, scene="paper")
    assert touch.flags == ()
    assert touch.ratio == pytest.approx(2.5, rel=0.01)
    [touch] = palpate.touches(light)
    assert touch.flags == ()
    assert touch.ratio == pytest.approx(2.5, rel=0.01)


def test_farads_taken_for_picofarads_are_no_touch() -> None:
    soft = presses([0.2])
    assert palpate.touches(made(2.5e-12 * soft, 1e-12 * soft)) == []


def test_settings_reach_the_estimator() -> None:
    whole = recording(presses([0.2]), ratio=6.0)
    [alarmed] = palpate.touches(whole, scene="paper", drift=0.0, threshold=0.0)
    [calm] = palpate.touches(whole, scene="paper", threshold=np.inf)
    assert alarmed.alarm_share == 1.0
    assert calm.alarm_share == 0.0
    assert palpate.touches(whole, samples=20)[0].samples == 20
    bad: list[tuple[dict[str, Any], str]]
    bad = [
        ({"scene": "moon"}, "scene: got 'moon', allowed: fixed, paper"),
        ({"samples": 0}, "samples: got 0.0"),
        ({"drift": -1.0}, "drift: got -1.0"),
    ]
    for wrong, message in bad:
        with pytest.raises(ValueError, match=message):
            palpate.touches(whole, **wrong)
    with pytest.raises(TypeError, match="got an unexpected keyword 'colour', allowed: samples, seconds, full_scale"):
        palpate.touches(whole, colour=1.0)  # type: ignore[call-overload]


def test_the_recording_of_the_project_is_what_its_script_makes() -> None:
    made = [line.split(",") for line in runpy.run_path(str(MAKER))["lines"]()]
    kept = [line.split(",") for line in FOUR.read_text().splitlines()]
    assert made[0] == kept[0]
    assert len(made) == len(kept)
    for new, old in zip(made[1:], kept[1:], strict=True):
        assert new[:3] == old[:3]
        # Sines may differ in their last bit from one C library to another, and so a code by one.
        assert all(abs(int(a) - int(b)) <= 1 for a, b in zip(new[3:5], old[3:5], strict=True))


def test_the_four_specimens_are_told_apart() -> None:
    """The paper's alarm never falls on the stiff ones; handheld is within 4 of its standard errors on all."""
    names = runpy.run_path(str(MAKER))
    truth = [names["ratio"](modulus) for modulus in names["MODULI_MPA"]]
    recording = palpate.read(FOUR)
    paper = palpate.touches(recording, scene="paper")
    assert [t.ratio for t in paper] == pytest.approx(truth, rel=0.01)
    assert [t.alarm_share > 0.9 for t in paper] == [False, False, True, True]
    handheld = palpate.touches(recording)
    for touch, right in zip(handheld, truth, strict=True):
        assert abs(touch.ratio - right) < 4 * touch.standard_error < 1e-3 * right
        assert (touch.samples, touch.alarm_share, touch.flags) == (250, 0.0, ())


def test_a_number_is_not_a_recording() -> None:
    with pytest.raises(TypeError, match=r"recording: got 3, allowed: the result of palpate\.read"):
        palpate.touches(3)  # type: ignore[call-overload]
