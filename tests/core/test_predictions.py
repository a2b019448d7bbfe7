"""VectorRls.predict: against least squares in 80 digits, the standard errors, and the truth."""

import copy
import math
import pickle
from collections.abc import Callable
from decimal import Decimal, localcontext
from typing import Any

import numpy as np
import palpate
import pytest
from effort import draws
from numpy.typing import NDArray
from palpate.reference.vectors import solved
from scipy.stats import t as student

Array = NDArray[np.float64]
ENDLESS = {"clip": 100.0, "false_alarm_interval": math.inf}  # no sample is left out, no change
VectorRls: Any = palpate.VectorRls


def decimals(values: Array) -> Any:
    return np.vectorize(Decimal, otypes=[object])(values.astype(object))


def made(seed: int, samples: int, size: int, spread: float = 1.0) -> tuple[Array, Array]:
    """Return outputs and correlated regressors, the last one by `spread` smaller than the first."""
    random = np.random.default_rng(seed)
    regressors = random.standard_normal((samples, size)) @ random.standard_normal((size, size))
    regressors *= np.geomspace(1, spread, size)
    output = regressors.sum(axis=1) + 0.01 * random.standard_normal(samples)
    return output, regressors


def in_decimals(
    output: Array, regressors: Array, weights: Any, x: Array
) -> tuple[float, float, float]:
    """Return x' theta, the root of s^2 x' P Q P x, and the number of samples that all have weight 1 and the same variance.

    P = (sum w x x')^-1, Q = sum w^2 x x'.
    """
    with localcontext(prec=80):
        samples = decimals(regressors)
        moments = samples.T @ (weights[:, None] * samples)
        squares = samples.T @ (weights[:, None] ** 2 * samples)
        theta = solved(moments, samples.T @ (weights * decimals(output)))
        rest = decimals(output) - samples @ theta
        left = weights.sum() - np.trace(solved(moments, squares))
        column = solved(moments, decimals(x))
        variance = column @ squares @ column * (weights * rest**2).sum() / left
        number = weights.sum() ** 2 / (weights**2).sum()
        return float(decimals(x) @ theta), float(variance ** Decimal("0.5")), float(number)


def steady_weights(steady: float, samples: int) -> Any:
    """Return the weights of samples."""
    return Decimal(steady) ** np.arange(samples)[::-1].astype(object)


def recent_weights(steady: float, samples: int, size: int) -> Any:
    """Return the weights of samples in a fit with a quarter of the memory, which is 2 size samples longer at first."""
    counts = np.cumsum(Decimal(steady) ** np.arange(samples).astype(object))
    kept = 1 - 4 / (counts + 8 * size)
    return np.array([kept[later + 1 :].prod() for later in range(samples)], object)


def across(x: Array, output: Array, regressors: Array, weights: Any, newest: Any) -> Array:
    """Return x without its part by which the predictions of both fits differ."""
    apart = np.array(
        [
            in_decimals(output, regressors, newest, axis)[0]
            - in_decimals(output, regressors, weights, axis)[0]
            for axis in np.eye(len(x))
        ]
    )
    without: Array = x - apart * (x @ apart) / (apart @ apart)
    return without


@pytest.mark.parametrize("steady", [1.0, 0.97])
@pytest.mark.parametrize("size", [2, 3, 5])
def test_it_agrees_with_least_squares_in_decimal_digits(size: int, steady: float) -> None:
    """The condition of the regressors is below 1e4: eps times its square is 1e-8.

    The largest correlation of the influences on a coefficient is in all errors of predictions; where the newest samples show
    more than noise, this is, too.
    """
    output, regressors = made(size, 60, size, spread=0.01)
    estimator = VectorRls(size, steady=steady, **ENDLESS)
    estimator.process(output, regressors)
    weights = steady_weights(steady, 60)
    newest = recent_weights(steady, 60, size)
    random = np.random.default_rng(9)
    xs = np.repeat([1e-6, 1.0, 1e6], 20)[:, None] * random.standard_normal((60, size))
    xs[0] = across(xs[20], output, regressors, weights, newest)
    exact = np.array([in_decimals(output, regressors, weights, x) for x in xs])
    recent = np.array([in_decimals(output, regressors, newest, x) for x in xs])
    found = np.array([estimator.predict(x) for x in xs])
    assert found[:, 0] == pytest.approx(exact[:, 0], rel=1e-8, abs=1e-8)
    factor = found[0, 1] / exact[0, 1]
    assert 1 - 1e-7 <= factor < 1.6
    of_noise = np.square(factor * exact[:, 1])
    apart = np.square(recent[:, 0] - exact[:, 0])
    moved = np.maximum(0, apart - of_noise * (exact[:, 2] / recent[:, 2] - 1))
    assert found[:, 1] == pytest.approx(np.sqrt(of_noise + moved), rel=1e-7)


@pytest.mark.parametrize("bound", [1e280, 1e4, 1.0])
def test_along_an_axis_it_is_a_coefficient_with_its_standard_error(bound: float) -> None:
    """Where a standard error is nan, that of the prediction is, too."""
    for seed in range(draws(40)):
        output, regressors = made(seed, 12 + 5 * seed % 80, 3)
        regressors[:, 2] *= seed % 2
        estimator = VectorRls(3, initial_covariance=bound, max_covariance=bound)
        estimator.process(output, regressors)
        for row in range(3):
            axis = np.eye(3)[row]
            value, standard_error = estimator.predict(axis)
            assert value == estimator.coefficients[row]
            expected = estimator.standard_errors[row]
            if math.isnan(expected):
                assert math.isnan(standard_error)
            elif not math.isnan(standard_error):
                assert standard_error == pytest.approx(expected, rel=1e-6)
            else:
                assert bound < 1e280  # both are limits of the prior's share, of one or of all axes


@pytest.mark.parametrize("scale", [1.0, 3.7, 1e-9, 1e9])
def test_a_combination_that_the_samples_had_is_known_and_any_other_one_is_not(scale: float) -> None:
    """No coefficient is known alone. By rounding, 0.1 + 0.2 is not 0.3."""
    random = np.random.default_rng(2)
    first = random.standard_normal(200)
    regressors = np.column_stack([first, scale * first])
    twins = VectorRls(2)
    twins.process(2 * first + 0.01 * random.standard_normal(200), regressors)
    assert not (twins.standard_errors < 1e100).any()
    for size in (1.0, 0.1 + 0.2, *(1e6 * random.random(10)), *(1e-6 * random.random(10))):
        value, standard_error = twins.predict((size, scale * size))
        assert abs(value - 2 * size) < 4 * standard_error < 0.05 * size
    for other in ((1.0, 0.0), (0.0, 1.0), (1.0, -scale), (1.0, 1.001 * scale)):
        value, standard_error = twins.predict(other)
        assert math.isfinite(value)
        assert math.isnan(standard_error)


def test_regressors_of_any_size_are_a_known_combination() -> None:
    """The rounding of a sum is compared with the regressors themselves, not with those of the samples."""
    random = np.random.default_rng(3)
    two = random.standard_normal((200, 2))
    regressors = np.column_stack([two, two.sum(axis=1)])
    estimator = VectorRls(3)
    estimator.process(two @ [2.0, 3.0] + 0.01 * random.standard_normal(200), regressors)
    for size in (1e-9, 1e-3, 1.0, 1e3, 1e9):
        for x in size * random.standard_normal((10, 2)):
            value, standard_error = estimator.predict((*x, x.sum()))
            assert abs(value - x @ [2.0, 3.0]) < 5 * standard_error < 0.1 * size
            assert math.isnan(estimator.predict((*x, x.sum() + 1e-3 * size))[1])


def test_an_interval_contains_the_true_mean_in_95_of_100_cases() -> None:
    """The number of 1000 cases has the standard deviation sqrt(1000 * 0.95 * 0.05) = 7."""
    random = np.random.default_rng(5)
    inside = 0
    for _ in range(1000):
        x = random.standard_normal((20, 2))
        y = 1 + x @ [2.0, 3.0] + 0.1 * random.standard_normal(20)
        plane = palpate.VectorRls(2, intercept=True, steady=1.0, clip=100.0)
        plane.process(y, x)
        new = 2 * random.standard_normal(2)
        value, standard_error = plane.predict(new)
        reach = student.ppf(0.975, plane.degrees_of_freedom) * standard_error
        inside += abs(value - (1 + new @ [2.0, 3.0])) < reach
    assert abs(inside - 950) < 4 * 7


def test_an_intercept_is_a_last_regressor_of_1() -> None:
    output, regressors = made(4, 50, 2)
    with_intercept = VectorRls(2, intercept=True)
    with_intercept.process(output, regressors)
    explicit = VectorRls(3)
    explicit.process(output, np.column_stack([regressors, np.ones(50)]))
    assert with_intercept.predict((0.3, 0.2)) == explicit.predict((0.3, 0.2, 1.0))
    assert with_intercept.predict((0.0, 0.0))[1] == pytest.approx(
        with_intercept.standard_errors[2], rel=1e-9
    )


def test_it_is_known_when_the_standard_errors_are() -> None:
    """A change in row 40 is a hand-over to so few samples that both are unknown for a while."""
    output, regressors = made(3, 60, 2)
    output[40:] += 500 * regressors[40:, 0]
    estimator = VectorRls(2, false_alarm_interval=1e4)
    assert estimator.predict((1.0, 1.0))[0] == 0
    unknown = []
    for y, x in zip(output, regressors, strict=True):
        estimator.update(y, x)
        unknown.append(math.isnan(estimator.predict((1.0, 1.0))[1]))
        assert unknown[-1] == np.isnan(estimator.standard_errors).any()
    assert unknown[4]
    assert not unknown[10]
    assert any(unknown[40:])


def test_zero_and_values_that_are_no_numbers() -> None:
    output, regressors = made(3, 60, 2)
    estimator = VectorRls(2)
    estimator.process(output, regressors)
    assert estimator.predict((0.0, 0.0)) == (0.0, 0.0)
    for bad in (math.nan, math.inf, 1e140):
        for x in ((bad, 1.0), (1.0, bad)):
            value, standard_error = estimator.predict(x)
            assert value == pytest.approx(estimator.coefficients @ x, nan_ok=True)
            assert math.isnan(standard_error)


def test_the_state_stays_and_any_kind_of_row_is_taken() -> None:
    output, regressors = made(3, 60, 2)
    estimator = VectorRls(2)
    estimator.process(output, regressors)
    before = copy.copy(estimator)
    rows = ((1.5, 2.0), [1.5, 2.0], np.array([1.5, 2.0]), np.array([1.5, 2.0], np.float32))
    assert len({estimator.predict(row) for row in rows}) == 1
    assert estimator == before
    assert pickle.loads(pickle.dumps(estimator)).predict((1.5, 2.0)) == before.predict((1.5, 2.0))


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        (lambda each: each.predict(), TypeError, r"takes exactly the regressors \(0 given\)"),
        (lambda each: each.predict(1.0, 2.0), TypeError, r"exactly the regressors \(2 given\)"),
        (lambda each: each.predict((1.0,)), ValueError, r"regressors: got shape \(1,\), .* \(2,\)"),
        (
            lambda each: each.predict(1.0),
            ValueError,
            r"regressors: got shape \(\), allowed: \(2,\)",
        ),
        (
            lambda each: each.predict((1.0, "x")),
            TypeError,
            "regressors: got 'x', allowed: a number",
        ),
        (lambda each: each.predict([[1.0, 2.0]]), ValueError, r"got shape \(1, 2\), .* \(2,\)"),
    ],
)
def test_what_is_refused(call: Callable[[Any], Any], error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        call(VectorRls(2))


@pytest.mark.parametrize("intercept", [False, True])
def test_one_regressor_may_be_an_array_of_one_dimension(intercept: bool) -> None:
    """Contiguous or not, of any type, with the bits of a column."""
    output, columns = made(6, 80, 1)
    line = VectorRls(1, intercept=intercept)
    expected = line.process(output, columns)
    for regressors in (columns[:, 0], columns[:, 0].tolist(), np.repeat(columns[:, 0], 2)[::2]):
        assert VectorRls(1, intercept=intercept).process(output, regressors).tobytes() == (
            expected.tobytes()
        )
        rows = VectorRls(1, intercept=intercept).trace(output, regressors)
        assert rows["coefficients"].tobytes() == expected.tobytes()
    for wrong, shape in ((columns[1:, 0], r"\(79,\)"), (columns.T, r"\(1, 80\)")):
        with pytest.raises(ValueError, match=rf"regressors: got shape {shape}, allowed: \(80, 1\)"):
            VectorRls(1, intercept=intercept).process(output, wrong)


def test_a_bank_takes_a_row_of_one_regressor_each() -> None:
    output, regressors = made(7, 3, 3)
    bank = palpate.Bank(VectorRls(1), 3)
    expected = palpate.Bank(VectorRls(1), 3)
    for y, x in zip(np.column_stack([output] * 3), regressors, strict=True):
        assert bank.update(y, x).tobytes() == expected.update(y, x[:, None]).tobytes()
