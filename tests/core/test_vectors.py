"""VectorRls: against its reference, least squares in 200 bits, its own other calls, and the truth."""

import copy
import pickle
import re
from decimal import Decimal, localcontext
from typing import Any

import numpy as np
import palpate
import pytest
from numpy.typing import NDArray
from palpate.reference.vectors import VectorTrace, solved, vector_rls

from bench.accuracy.signal_worlds import coloured, several_slow_noise
from bench.accuracy.vectors import KINDS, NOISE, covered, made, regressors_of

Array = NDArray[np.float64]
EPS = np.finfo(float).eps


def data(seed: int, n: int, size: int, kind: str = "white") -> tuple[Array, Array]:
    """Return outputs and regressors with a change, spikes and a stretch without excitation."""
    output, regressors, _ = made(kind, seed, n, size, n * 2 // 3, intercept=False)
    output[[n // 3, n - 9]] += 3
    regressors[n // 2 : n // 2 + 4] = 0
    return output, regressors


def decimals(values: NDArray[Any]) -> Any:
    return np.vectorize(Decimal, otypes=[object])(values.astype(object))


@pytest.mark.parametrize("size", [1, 2, 3])
@pytest.mark.parametrize(
    "settings",
    [
        {},
        {"alarmed": 0.9},
        {"steady": 1.0},
        {"initial_covariance": 1.0, "max_covariance": 10.0},
        {"false_alarm_interval": 10.0, "clip": 2.2},
    ],
    ids=str,
)
def test_it_agrees_with_the_reference_in_decimal_digits(
    size: int, settings: dict[str, float]
) -> None:
    output, regressors = data(size, 90, size)
    # so that 80 digits hold the prior beside the samples
    bounded = {"max_covariance": 1e12} | settings
    bounded = {"initial_covariance": bounded["max_covariance"]} | bounded
    exact = against_the_reference(output, regressors, bounded)
    assert exact.alarm.any() or "initial_covariance" in settings


@pytest.mark.parametrize(("size", "interval"), [(1, 10.0), (2, 10.0), (1, np.inf)])
def test_it_agrees_with_the_reference_where_noise_is_correlated_and_grows(
    size: int, interval: float
) -> None:
    """With a threshold this low some alarms are noise; without alarms noise waits for 128 samples."""
    random = np.random.default_rng(size)
    regressors = random.standard_normal((220, size))
    noise = coloured(random.standard_normal(220), 0.8) * np.where(np.arange(220) < 70, 0.01, 0.1)
    bounds = {"max_covariance": 1e12, "initial_covariance": 1e12}
    settings = bounds | {"false_alarm_interval": interval}
    coefficient = np.where(np.arange(220) < 70, 1.0, 2.0)
    against_the_reference(coefficient * regressors.sum(1) + noise, regressors, settings)


def against_the_reference(
    output: Array, regressors: Array, settings: dict[str, float]
) -> VectorTrace:
    """Compare with the reference at each sample, and return its trace."""
    estimator = palpate.VectorRls(regressors.shape[1], **settings)  # type: ignore[arg-type]
    trace = estimator.trace(output, regressors)
    others = {name: settings[name] for name in settings if name != "false_alarm_interval"}
    exact = vector_rls(output, regressors, threshold=estimator.threshold, **others)
    assert trace["alarm"].tolist() == exact.alarm.tolist()
    for name in ("coefficients", "innovation", "statistic"):
        found = trace[name]
        right = getattr(exact, name)
        # A regressor of 0.01 is the smallest of a direction; a statistic is a sum of up to 90 quotients.
        assert np.abs(found - right).max() <= 2000 * EPS * np.abs(right).max(), name
    known = exact.degrees_of_freedom > 0
    assert np.isnan(trace["standard_errors"][~known]).all()
    # Residuals are the squares of innovations, each with an error of some eps of the output, 100 times the noise.
    assert np.allclose(
        trace["standard_errors"][known],
        exact.standard_errors[known],
        rtol=1e-9,
        atol=0,
        equal_nan=True,
    )
    return exact


@pytest.mark.parametrize("steady", [1.0, 0.97])
@pytest.mark.parametrize("condition", [1e0, 1e3, 1e6, 1e9, 1e12])
@pytest.mark.parametrize("size", [2, 4])
def test_the_error_grows_with_the_condition_and_not_with_its_square(
    size: int, condition: float, steady: float
) -> None:
    """16 eps (k + k^2 residual / output), k the condition of the weighted regressors: the least-squares bound."""
    random = np.random.default_rng(int(condition))
    n = 60
    base = np.linalg.qr(random.standard_normal((n, size)))[0] * condition ** (
        -np.arange(size) / (size - 1)
    )
    regressors = base @ np.linalg.qr(random.standard_normal((size, size)))[0]
    output = regressors @ np.ones(size) + 1e-9 * random.standard_normal(n)
    found = palpate.VectorRls(size, steady=steady, clip=100.0).process(output, regressors)[-1]
    weights = steady ** np.arange(n)[::-1]
    with localcontext(prec=80):
        x = decimals(regressors)
        y = decimals(output)
        w = decimals(weights)
        exact = solved(x.T @ (w[:, None] * x), x.T @ (w * y))
        residual = float(sum(w * (y - x @ exact) ** 2)) ** 0.5
    k = np.linalg.cond(np.sqrt(weights)[:, None] * regressors)
    relative = residual / np.linalg.norm(np.sqrt(weights) * output)
    if k * EPS < 0.01:
        wrong = np.linalg.norm(found - exact.astype(float)) / np.linalg.norm(exact.astype(float))
        assert wrong <= 16 * EPS * (k + k**2 * relative)


def test_without_a_prior_it_is_least_squares_from_the_first_samples_on() -> None:
    output, regressors, _ = made("coloured", 3, 80, 3, 80, intercept=False)
    found = palpate.VectorRls(3, steady=0.98, clip=100.0).process(output, regressors)
    for n in (3, 4, 10, 80):
        root = 0.98 ** (np.arange(n)[::-1] / 2)
        right = np.linalg.lstsq(root[:, None] * regressors[:n], root * output[:n], rcond=None)[0]
        assert np.allclose(found[n - 1], right, rtol=1e-11, atol=1e-11)


def test_of_size_1_with_alarmed_it_is_adaptive_rls() -> None:
    """To 32 eps, without an alarm in either."""
    random = np.random.default_rng(8)
    regressor = 0.25 + 0.02 * random.standard_normal(2000)
    output = 2.5 * regressor + 1e-3 * random.standard_normal(2000)
    paper = palpate.AdaptiveRls(
        initial_ratio=0.0, initial_covariance=1e280, max_covariance=1e280, threshold=np.inf
    )
    vector = palpate.VectorRls(1, alarmed=0.9, false_alarm_interval=np.inf)
    ratios = paper.process(output, regressor)
    coefficients = vector.process(output, regressor[:, None])[:, 0]
    assert np.abs(coefficients / ratios - 1).max() <= 32 * EPS


@pytest.mark.parametrize("kind", list(KINDS))
def test_the_intervals_hold_after_a_change(kind: str) -> None:
    """92 to 97 % from max(10, 2 size + 8) samples on: of 300 runs, with 3 standard deviations of a share."""
    for size, intercept in ((2, False), (1, True)):
        share, _, _ = covered(kind, size, intercept, after=2 * (size + intercept) + 8, runs=300)
        spread = 3 * np.sqrt(0.95 * 0.05 / 600)
        assert 0.92 - spread <= share <= 0.97 + spread, (kind, size, share)


def test_a_change_is_found_and_noise_is_not() -> None:
    _, error, delay = covered("white", 2, False, after=12, runs=200)
    assert error <= 0.02
    assert delay <= 8
    random = np.random.default_rng(0)
    n = 100_000
    for kind, size in (("white", 2), ("coloured", 3), ("near one", 1)):
        regressors = regressors_of(kind, random, n, size)
        output = regressors.sum(1) + NOISE * random.standard_normal(n)
        assert not palpate.VectorRls(size).trace(output, regressors)["alarm"].any()


def test_a_spike_changes_nothing_and_a_larger_noise_is_learnt() -> None:
    random = np.random.default_rng(2)
    regressors = random.standard_normal((3000, 2))
    output = regressors @ [1.0, 2.0] + np.where(
        np.arange(3000) < 1000, 0.01, 0.1
    ) * random.standard_normal(3000)
    output[500] += 100
    trace = palpate.VectorRls(2).trace(output, regressors)
    assert (trace["coefficients"][500] == trace["coefficients"][499]).all()
    assert not trace["alarm"][1300:].any()
    assert np.allclose(trace["coefficients"][-1], [1, 2], atol=0.05)


@pytest.mark.parametrize(("intercept", "rho"), [(False, 0.95), (True, 0.0)])
def test_correlated_noise_is_no_change_and_widens_what_is_slow(intercept: bool, rho: float) -> None:
    """At most 12 % of 100 runs have an alarm, 6 % are expected; 80 % of the intervals hold, of white noise 40 %."""
    alarms = 0
    held = []
    widths = []
    for seed in range(100):
        signals = several_slow_noise(seed, intercept, rho)
        estimator = palpate.VectorRls(2, intercept=intercept)
        alarms += bool(estimator.trace(signals.output, signals.regressors)["alarm"].any())
        width = 1.96 * estimator.standard_errors
        held.append(np.abs(estimator.coefficients - signals.coefficients) <= width)
        widths.append(width)
    assert alarms <= 12
    assert np.min(np.mean(held, axis=0)) >= 0.75
    if intercept:
        slow, fast = np.median(widths, axis=0)[[2, 0]]
        assert slow > 2 * fast


@pytest.mark.parametrize(("shift", "per_sample"), [(1.0, 0.0), (0.0, 0.002)])
def test_the_interval_holds_while_the_coefficients_follow_a_small_change(
    shift: float, per_sample: float
) -> None:
    """A step of one standard deviation, and a drift by two in 1,000 samples, of which the fit is late by 200 samples.

    A fit of the newest samples shows it. Without it no interval of the drift would hold.
    """
    held = []
    for seed in range(40):
        random = np.random.default_rng(seed)
        regressor = random.uniform(0.5, 1.5, 1300)
        k = np.arange(1300)
        true = 2 + shift * (k >= 1000) + per_sample * k
        rows = palpate.VectorRls(1).trace(
            true * regressor + random.standard_normal(1300), regressor
        )
        error = rows["coefficients"][1050::50, 0] - true[1050::50]
        held.append(np.abs(error) < 1.96 * rows["standard_errors"][1050::50, 0])
    assert np.mean(held) > 0.7


def test_the_standard_error_contains_rounding() -> None:
    random = np.random.default_rng(9)
    regressors = random.standard_normal((1000, 2))
    estimator = palpate.VectorRls(2, intercept=True)
    truth = [1.1, 2.3, 5.7]
    estimator.process(regressors @ truth[:2] + truth[2], regressors)
    # Each of 100 samples, 1 / (1 - steady^2), rounds by eps / sqrt(12).
    least = EPS * np.sqrt(100 / 12) * np.array(truth)
    assert (estimator.standard_errors >= 0.99 * least).all()
    assert (np.abs(estimator.coefficients - truth) <= 1.96 * estimator.standard_errors).all()


def test_a_direction_without_excitation_stays_and_does_not_wind_up() -> None:
    random = np.random.default_rng(4)
    regressors = random.standard_normal((20_000, 3))
    output = regressors @ [1.0, 2.0, 3.0] + 0.01 * random.standard_normal(20_000)
    regressors[5000:, 2] = 0
    output[5000:] = regressors[5000:] @ [1.0, 2.0, 3.0] + 0.01 * random.standard_normal(15_000)
    for most in (1e2, 1e8, 1e280):
        bounded = palpate.VectorRls(3, initial_covariance=most, max_covariance=most)
        trace = bounded.trace(output, regressors)
        assert np.linalg.eigvalsh(bounded.covariance).max() <= most * (1 + 1e-12)
        assert np.ptp(trace["coefficients"][5010:, 2]) < 1e-3
        # What was measured stays as good as it was; what the bound holds is not known.
        last = trace["standard_errors"][-1, 2]
        before = trace["standard_errors"][4999, 2]
        assert np.isnan(last) if most < 1e280 else np.isclose(last, before, rtol=0.2)
    # The same regressor twice: the sum is known, the difference is not.
    twins = palpate.VectorRls(2)
    twins.process(3 * regressors[:5000, 0], np.column_stack([regressors[:5000, 0]] * 2))
    assert np.isclose(twins.coefficients.sum(), 3)
    assert np.abs(twins.coefficients).max() < 10
    assert np.isnan(twins.standard_errors).all()
    assert np.isfinite(twins.covariance).all()


@pytest.mark.parametrize("size", range(1, 9))
def test_every_call_gives_the_same_bits(size: int) -> None:
    output, regressors = data(size, 200, size)
    output[17] = np.nan
    one, block, traced = (palpate.VectorRls(size) for _ in range(3))
    innovations = []
    rows = []
    for y, x in zip(output, regressors, strict=True):
        innovations.append(one.update(y, tuple(x.tolist())))
        rows.append(one.coefficients)
    assert block.process(output, regressors).tobytes() == np.array(rows).tobytes()
    trace = traced.trace(output, regressors)
    assert trace["coefficients"].tobytes() == np.array(rows).tobytes()
    assert np.isnan(trace["innovation"][17])
    assert (trace["innovation"] == innovations)[np.arange(200) != 17].all()
    assert one == block == traced == pickle.loads(pickle.dumps(one)) == copy.copy(one)
    assert (one.samples, one.rejected) == (199, 1)
    again = pickle.loads(pickle.dumps(one))
    assert (
        again.process(output, regressors).tobytes() == block.process(output, regressors).tobytes()
    )
    kinds_of_rows = (
        regressors[0],
        regressors[0].tolist(),
        tuple(regressors[0].tolist()),
        regressors[:, ::-1][0, ::-1],
    )
    assert len({copy.copy(one).update(1.0, row) for row in kinds_of_rows}) == 1
    one.reset()
    assert one == palpate.VectorRls(size) != block


def test_an_intercept_is_a_last_regressor_of_1() -> None:
    output, regressors, _truth = made("white", 1, 150, 2, 150, intercept=True)
    line = palpate.VectorRls(2, intercept=True)
    ones = palpate.VectorRls(3)
    block = line.process(output, regressors)
    assert block.shape == (150, 3)
    assert (
        block.tobytes()
        == ones.process(output, np.column_stack([regressors, np.ones(150)])).tobytes()
    )
    settings: dict[str, Any] = line.settings
    assert palpate.VectorRls(**settings).settings == settings
    assert repr(palpate.VectorRls(2, intercept=True)).startswith(
        "<VectorRls(size=2, intercept=True): coefficients 0.0"
    )


def test_a_bank_has_the_bits_of_single_ones() -> None:
    pieces = [data(seed, 120, 2) for seed in range(5)]
    output = np.stack([y for y, _ in pieces], 1)
    regressors = np.stack([x for _, x in pieces], 1)
    bank = palpate.Bank(palpate.VectorRls(2), 5)
    singles = [palpate.VectorRls(2) for _ in range(5)]
    found = bank.process(output, regressors)
    right = np.stack(
        [single.process(y, x) for single, (y, x) in zip(singles, pieces, strict=True)], 1
    )
    assert found.tobytes() == right.tobytes()
    assert [bank[i] for i in range(5)] == singles
    assert (
        bank.coefficients.tobytes()
        == np.stack([single.coefficients for single in singles]).tobytes()
    )
    assert bank.standard_errors.shape == (5, 2)
    assert bank.update(output[0], regressors[0]).shape == (5, 2)
    assert pickle.loads(pickle.dumps(bank)) == bank
    shared = palpate.Bank(palpate.VectorRls(2), 5).process(output, regressors[:, 0])
    assert shared[:, 0].tobytes() == right[:, 0].tobytes()


VectorRls: Any = palpate.VectorRls


@pytest.mark.parametrize(
    ("make", "error", "said"),
    [
        (lambda: VectorRls(0), ValueError, "size: got 0.0, allowed: a whole number, 1 to 8"),
        (lambda: VectorRls(9), ValueError, "size: got 9.0, allowed: a whole number, 1 to 8"),
        (
            lambda: VectorRls(8, intercept=True),
            ValueError,
            "size: got 8.0, allowed: 1 to 7 with an intercept",
        ),
        (lambda: VectorRls(), TypeError, "VectorRls: got 0 values without a name, allowed: size"),
        (lambda: VectorRls(2, 3), TypeError, "VectorRls: got 2 values without a name"),
        (lambda: VectorRls(2, steady=1.5), ValueError, "steady: got 1.5, allowed: 0 < steady <= 1"),
        (
            lambda: VectorRls(2, alarmed=1.0),
            ValueError,
            "alarmed: got 1.0, allowed: 0, or alarmed <= steady",
        ),
        (lambda: VectorRls(2, stady=0.9), TypeError, "did you mean 'steady'"),
        (lambda: VectorRls(2).update(1.0), TypeError, "takes exactly an output and regressors"),
        (
            lambda: VectorRls(2).update("x", (1.0, 2.0)),
            TypeError,
            "output: got 'x', allowed: a number",
        ),
        (
            lambda: VectorRls(2).update(1.0, (1.0, "x")),
            TypeError,
            "regressors: got 'x', allowed: a number",
        ),
        (
            lambda: VectorRls(2).update(1.0, (1.0,)),
            ValueError,
            r"regressors: got shape \(1,\), allowed: \(2,\)",
        ),
        (
            lambda: VectorRls(2).update(1.0, 2.0),
            ValueError,
            r"regressors: got shape \(\), allowed: \(2,\)",
        ),
        (
            lambda: VectorRls(2).process([1.0], [1.0, 2.0]),
            ValueError,
            r"regressors: got shape \(2,\), allowed: \(1, 2\)",
        ),
        (
            lambda: VectorRls(2).process([1j], [[1.0, 2.0]]),
            TypeError,
            "output: got dtype complex128",
        ),
    ],
)
def test_bad_input_is_refused_in_words(make: Any, error: type[Exception], said: str) -> None:
    with pytest.raises(error, match=said if "\\" in said else re.escape(said)):
        make()


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 1e200])
def test_what_cannot_be_used_is_counted_and_leaves_the_state(bad: float) -> None:
    estimator = palpate.VectorRls(2)
    output, regressors = data(1, 40, 2)
    estimator.process(output, regressors)
    before = estimator.coefficients.tobytes(), estimator.statistic
    for y, x in ((bad, (1.0, 1.0)), (1.0, (bad, 1.0)), (1.0, (1.0, bad))):
        estimator.update(y, x)
    assert (estimator.coefficients.tobytes(), estimator.statistic) == before
    assert (estimator.samples, estimator.rejected) == (40, 3)


@pytest.mark.parametrize("scale", [1e-60, 1e-12, 1e12, 1e60])
def test_the_unit_of_the_signals_does_not_matter(scale: float) -> None:
    output, regressors = data(5, 300, 2)
    plain = palpate.VectorRls(2).trace(output, regressors)
    scaled = palpate.VectorRls(2).trace(output * scale, regressors)
    assert (plain["alarm"] == scaled["alarm"]).all()
    assert np.allclose(scaled["coefficients"], plain["coefficients"] * scale, rtol=1e-9, atol=0)
    shrunk = palpate.VectorRls(2).process(output, regressors * scale)
    # Of one sample, the prior decides which of the coefficients that explain it they are.
    assert np.allclose((shrunk * scale)[1:], plain["coefficients"][1:], rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize(("offset", "most"), [(0, 1.0), (1e4, 1.0), (1e9, 1.42), (1.7e12, 1.42)])
def test_an_offset_leaves_the_standard_error_right_or_a_little_large(
    offset: float, most: float
) -> None:
    random = np.random.default_rng(6)
    x = random.standard_normal(400)
    y = 2 * x + 1 + 0.02 * random.standard_normal(400)
    plain, moved = (palpate.VectorRls(1, intercept=True) for _ in range(2))
    plain.process(y, x[:, None])
    moved.process(y, x[:, None] + offset)
    assert 0.97 <= moved.standard_errors[0] / plain.standard_errors[0] <= most * 1.03
    assert 0 < moved.degrees_of_freedom < 400
