"""What HandoverRls does with changes, outliers, delays, and inputs at the ends of the range."""

import math
from typing import Any

import numpy as np
import palpate
import pytest
from numpy.typing import NDArray

Array = NDArray[np.float64]
KINDS = [palpate.HandoverRls, palpate.HandoverRls32]


def uniform(seed: int, size: int) -> tuple[Array, Array]:
    """Return a regressor from .5 to 1.5, and white noise of standard deviation 1."""
    random = np.random.default_rng(seed)
    return random.uniform(0.5, 1.5, size), random.standard_normal(size)


@pytest.mark.parametrize(("period", "late"), [(60, 1.0), (20, 0.25)])
def test_a_late_output_is_no_drift(period: float, late: float) -> None:
    """Its error changes its sign with the regressor's slope: a ratio that followed it would be wrong by more than 10 %."""
    t = np.arange(2000)
    noise = 0.02 * np.random.default_rng(11).standard_normal(len(t))
    output = 3 * np.sin(2 * np.pi * (t - late) / period) + noise
    rows = palpate.HandoverRls().trace(output, np.sin(2 * np.pi * t / period))
    assert np.abs(rows["ratio"][500:] / 3 - 1).max() < 0.03
    assert not rows["alarm"].any()


def test_a_small_step_is_found_and_covered() -> None:
    """The step is one standard deviation of the noise. 300 samples later least squares since then has an error of 1 / sqrt(325)."""
    off = []
    held = []
    for seed in range(30):
        x, noise = uniform(seed, 1300)
        rows = palpate.HandoverRls().trace(np.repeat([2.0, 3.0], [1000, 300]) * x + noise, x)
        assert rows["alarm"][1000:].any()
        assert not rows["alarm"][:1000].any()
        off.append(rows["ratio"][-1] - 3)
        held.append(abs(off[-1]) < 1.96 * rows["standard_error"][-1])
    assert np.sqrt(np.mean(np.square(off))) < 1.5 / math.sqrt(325)
    assert np.mean(held) > 0.95 - 3 * math.sqrt(0.95 * 0.05 / 30)


@pytest.mark.parametrize("kind", KINDS)
def test_outliers_do_not_change_the_ratio(kind: Any) -> None:
    """Of other samples those beyond 3 standard deviations do not, either: 3 in 1,000."""
    x, noise = uniform(3, 400)
    output = 2 * x + 0.1 * noise
    outliers = np.array([50, 51, 130, 131, 250, 388])
    output[outliers] += [5, -5, 40, -3, 1e6, -7]
    rows = kind().trace(output.astype(rows_type(kind)), x.astype(rows_type(kind)))
    assert (rows["ratio"][outliers] == rows["ratio"][outliers - 1]).all()
    others = np.delete(np.arange(100, 400), outliers[2:] - 100)
    assert np.mean(rows["ratio"][others] != rows["ratio"][others - 1]) > 0.98
    assert not rows["alarm"].any()


def rows_type(kind: Any) -> type[np.floating[Any]]:
    """Return the type of the estimator's numbers."""
    return np.float32 if kind is palpate.HandoverRls32 else np.float64


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("at", [100, 1000])
@pytest.mark.parametrize(("x_times", "y_times"), [(4e5, 5e5), (4e5, 1), (1e3, 1.1e3), (-30, 1)])
def test_one_false_reading_of_any_size_does_not_change_the_ratio(
    kind: Any, at: int, x_times: float, y_times: float
) -> None:
    """Nor does it make the samples after it say nothing: the ratio follows a step that comes later."""
    x, noise = uniform(5, at + 200)
    output = np.where(np.arange(len(x)) < at + 100, 2, 2.5) * x + 0.01 * noise
    x[at] *= x_times
    output[at] *= y_times
    rows = kind().trace(output.astype(rows_type(kind)), x.astype(rows_type(kind)))
    assert rows["ratio"][at] == rows["ratio"][at - 1]
    before = slice(at, at + 100)
    assert np.abs(rows["ratio"][before] - 2).max() < 0.01
    assert np.flatnonzero(rows["alarm"])[0] == at + 104
    assert abs(rows["ratio"][-1] - 2.5) < 3 * rows["standard_error"][-1] < 0.01


@pytest.mark.parametrize(("length", "idle"), [(3, 20), (5, 100), (20, 100)])
def test_pulses_between_idle_samples_that_are_noise(length: int, idle: int) -> None:
    """The noise is 1 % of a pulse in both signals. Idle samples alone have a ratio of 0, since their noises are independent."""
    for seed in range(10):
        random = np.random.default_rng(seed)
        size = 20 * (length + idle)
        pulse = np.where(np.arange(size) % (length + idle) >= idle, 1.0, 0.0)
        x = pulse + 0.01 * random.standard_normal(size)
        rows = palpate.HandoverRls().trace(2 * pulse + 0.01 * random.standard_normal(size), x)
        after_two = slice(2 * (length + idle), None)
        assert np.abs(rows["ratio"][after_two] - 2).max() < 0.05


def test_an_output_without_a_regressor_shows_no_change() -> None:
    """Its steps do not depend on the ratio; afterwards the ratio is what it was, and a change of it is found as before."""
    x, noise = uniform(7, 400)
    x[100:200] = 0
    output = np.repeat([2.0, 3.0], [350, 50]) * x + 0.01 * noise
    output[120:160] += 0.5
    output[160:200] -= 3
    rows = palpate.HandoverRls().trace(output, x)
    assert not rows["alarm"][:350].any()
    assert rows["alarm"][350:360].any()
    assert np.abs(rows["ratio"][100:350] - 2).max() < 0.01


def test_a_burst_is_rarely_a_change_and_a_step_of_its_size_is_one() -> None:
    """Of 20 samples of a hundred times the noise five in a row are as one change in one of twelve runs: 4 standard deviations."""
    burst = []
    for seed in range(40):
        x, noise = uniform(seed, 400)
        noise *= 0.01
        step = np.repeat([2.0, 3.0], 200)
        assert palpate.HandoverRls().trace(step * x + noise, x)["alarm"].any()
        noise[200:220] *= 100
        burst.append(palpate.HandoverRls().trace(2 * x + noise, x)["alarm"].any())
    assert np.mean(burst) < 1 / 12 + 4 * math.sqrt(1 / 12 * 11 / 12 / 40)


@pytest.mark.parametrize(("speed", "behind"), [(1.0, 7.5), (5.0, 1.0), (30.0, 1.0)])
def test_a_slide_is_followed(speed: float, behind: float) -> None:
    """The speed is in standard deviations of the noise per sample.

    A fast one is read from the last samples alone. A slow one is found by the CUSUM, of which each sample adds 2.25 at most:
    in five samples to the limit of 11. Their mean is then 2.5 samples behind, and 7.5 before the next hand-over.
    """
    x, noise = uniform(4, 500)
    truth = 2 + 0.01 * speed * np.clip(np.arange(500) - 300, 0, 150)
    rows = palpate.HandoverRls().trace(truth * x + 0.01 * noise, x)
    off = rows["ratio"] - truth
    assert np.sqrt(np.mean(off[330:450] ** 2)) < 0.01 * (1.5 + behind * speed)
    assert np.abs(off[480:]).max() < 0.01


@pytest.mark.parametrize("kind", KINDS)
def test_data_without_noise_have_a_standard_error(kind: Any) -> None:
    """No number of this type is nearer to the ratio than its rounding error."""
    number = rows_type(kind)
    rows = kind().trace(np.full(400, 0.75, number), np.full(400, 0.3, number))
    error = rows["standard_error"][100:]
    assert np.isfinite(error).all()
    assert error.min() >= np.finfo(number).eps / 2 * 2.5 * 0.99
    assert error.max() <= np.finfo(number).eps * 2.5
    assert not rows["alarm"].any()


@pytest.mark.parametrize(
    ("kind", "least"), [(palpate.HandoverRls, 1e-139), (palpate.HandoverRls32, 1e-18)]
)
def test_a_regressor_whose_square_would_vanish_counts_as_0(kind: Any, least: float) -> None:
    number = rows_type(kind)
    estimator = kind(initial_ratio=3.0)
    rows = estimator.trace(np.full(200, 0.9 * least, number), np.full(200, 0.9 * least, number))
    assert (rows["ratio"] == 3).all()
    assert np.isinf(rows["covariance"]).all()
    assert np.isnan(rows["standard_error"]).all()
    assert not rows["alarm"].any()
    assert estimator.rejected == 0
    estimator.process(np.full(9, 2 * least, number), np.full(9, 2 * least, number))
    assert estimator.ratio == pytest.approx(1, rel=1e-6)
    assert math.isfinite(estimator.covariance)


@pytest.mark.parametrize(
    ("kind", "most"), [(palpate.HandoverRls, 1e140), (palpate.HandoverRls32, 1e16)]
)
@pytest.mark.parametrize("channel", [0, 1])
def test_values_whose_products_would_overflow_are_refused(
    kind: Any, most: float, channel: int
) -> None:
    estimator = kind()
    estimator.process(np.full(60, 0.5), np.full(60, 0.25))
    for value in (1.01 * most, -1.01 * most, math.inf, math.nan):
        sample = [0.5, 0.25]
        sample[channel] = value
        estimator.update(*sample)
    assert estimator.rejected == 4
    assert estimator.ratio == 2
    again = kind()
    again.process(np.full(60, 0.5), np.full(60, 0.25))
    later = uniform(5, 100)
    assert (estimator.process(*later) == again.process(*later)).all()


def test_without_false_alarms_there_are_none() -> None:
    """Neither of the CUSUM, nor of the windows, nor of a slide: all three find something here by default."""
    never = {"false_alarm_interval": math.inf}
    k = np.arange(1500)
    x, noise = uniform(6, 1500)
    for truth in (2 + 1.0 * (k > 1000), 2 + 20.0 * (k > 700)):
        assert palpate.HandoverRls().trace(truth * x + noise, x)["alarm"].any()
        assert not palpate.HandoverRls(**never).trace(truth * x + noise, x)["alarm"].any()
    slide = 2 + 0.03 * np.maximum(0, k - 700)
    assert palpate.HandoverRls().trace(slide * x + 0.01 * noise, x)["alarm"].any()
    assert not palpate.HandoverRls(**never).trace(slide * x + 0.01 * noise, x)["alarm"].any()
