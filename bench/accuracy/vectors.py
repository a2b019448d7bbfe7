"""VectorRls: its intervals over twelve kinds of regressors, its changes, and other libraries on the same data.

    python -m bench.accuracy.vectors [--runs 1000]

Three minutes; one with --runs 200. Needs the extra science; padasip, river, filterpy and statsmodels if they are installed.
"""

import argparse
import time
import warnings
from collections.abc import Callable, Iterator
from importlib.util import find_spec
from typing import Any

import numpy as np
import palpate
from numpy.typing import NDArray

Array = NDArray[np.float64]
FORGETTING = 0.995
NOISE = 0.01


def _coloured(random: np.random.Generator, shape: tuple[int, int], rho: float) -> Array:
    values = random.standard_normal(shape)
    for k in range(1, len(values)):
        values[k] = rho * values[k - 1] + np.sqrt(1 - rho**2) * values[k]
    return values


def _sinusoids(random: np.random.Generator, k: Array, i: Array) -> Array:
    return np.sin(0.3 * (i + 1) * k + random.uniform(0, 6, i.shape))


def _steps(random: np.random.Generator, k: Array, i: Array) -> Array:
    return np.where((k + random.integers(0, 20)) // (4 + 3 * i) % 2, 1.0, 0.2)


def _collinear(random: np.random.Generator, k: Array, i: Array) -> Array:
    first = random.standard_normal(k.shape)
    return first + np.where(i > 0, 1e-3, 0) * random.standard_normal((len(k), i.size))


Make = Callable[[np.random.Generator, Array, Array], Array]
KINDS: dict[str, Make] = {
    "white": lambda random, k, i: random.standard_normal((len(k), i.size)),
    "coloured": lambda random, k, i: _coloured(random, (len(k), i.size), 0.8),
    "slow": lambda random, k, i: _coloured(random, (len(k), i.size), 0.98),
    "sinusoids": _sinusoids,
    "steps": _steps,
    "nearly collinear": _collinear,
    "intermittent": lambda random, k, i: np.where(
        (k // 15 + i) % 3 > 0, random.standard_normal((len(k), i.size)), 0.0
    ),
    "near one": lambda random, k, i: 1 + 0.1 * random.standard_normal((len(k), i.size)),
    "level and sine": lambda random, k, i: (
        5 + np.sin(0.2 * k + i) + 0.1 * random.standard_normal((len(k), i.size))
    ),
    "lognormal": lambda random, k, i: np.exp(random.standard_normal((len(k), i.size))),
    "modulated": lambda random, k, i: (
        random.standard_normal((len(k), i.size)) * (1 + 0.9 * np.sin(0.01 * k))
    ),
    "heavy tails": lambda random, k, i: random.standard_t(3, (len(k), i.size)),
}
"""How the regressors of a kind are made, of a generator, the samples as a column and the regressors as a row."""


def regressors_of(kind: str, random: np.random.Generator, n: int, size: int) -> Array:
    """Return regressors of a kind, shape (n, size)."""
    return KINDS[kind](
        random, np.arange(n, dtype=float)[:, None], np.arange(size, dtype=float)[None, :]
    )


def made(
    kind: str, seed: int, n: int, size: int, change_at: int, intercept: bool
) -> tuple[Array, Array, Array]:
    """Return outputs, regressors and the coefficients at the end; the first one changes by 30 % at a sample."""
    random = np.random.default_rng([seed, size])
    regressors = regressors_of(kind, random, n, size)
    coefficients = random.uniform(1, 3, size + intercept)
    rows = np.column_stack([regressors, np.ones(n)]) if intercept else regressors
    output = rows @ coefficients
    coefficients[0] *= 1.3
    output[change_at:] = rows[change_at:] @ coefficients
    return (
        output + NOISE * np.sqrt(np.mean(output**2)) * random.standard_normal(n),
        regressors,
        coefficients,
    )


def covered(
    kind: str, size: int, intercept: bool, after: int, runs: int
) -> tuple[float, float, float]:
    """Return the share of 95 % intervals that hold, `after` samples after a change; the median error; the delay."""
    from scipy.stats import t

    held = []
    errors = []
    delays = []
    for seed in range(runs):
        n = 260 + after
        change_at = 260
        output, regressors, truth = made(kind, seed, n, size, change_at, intercept)
        estimator = palpate.VectorRls(size, intercept=intercept)
        alarms = np.flatnonzero(estimator.trace(output, regressors)["alarm"][change_at:])
        width = t.ppf(0.975, estimator.degrees_of_freedom) * estimator.standard_errors
        held += (np.abs(estimator.coefficients - truth) <= width)[np.isfinite(width)].tolist()
        errors.append(abs(estimator.coefficients[0] / truth[0] - 1))
        delays.append(alarms[0] + 1 if len(alarms) else np.inf)
    return float(np.mean(held)), float(np.median(errors)), float(np.median(delays))


def coverage(runs: int) -> Iterator[str]:
    """Yield the table of the intervals."""
    yield f"{'95 % intervals that hold, n samples after a change of 30 %':48}{'size 1':>9}{'2':>9}{'1 + int.':>9}{'4':>9}{'3 + int.':>9}{'8':>9}"
    for kind in KINDS:
        cells = []
        for size, intercept in (
            (1, False),
            (2, False),
            (1, True),
            (4, False),
            (3, True),
            (8, False),
        ):
            after = max(10, 2 * (size + intercept) + 8)
            cells.append(f"{covered(kind, size, intercept, after, runs)[0]:9.3f}")
        yield f"{kind:48}" + "".join(cells)


def changes(runs: int) -> Iterator[str]:
    """Yield what a change costs, and the false alarms."""
    for size in (1, 2, 8):
        _, error, delay = covered("white", size, False, 12 if size < 8 else 24, runs)
        yield f"size {size}: a coefficient changes by 30 %, noise 1 %: alarm after {delay:.0f}, median error after {12 if size < 8 else 24} samples {100 * error:.2f} %"
    for size, kind in ((1, "near one"), (2, "white"), (2, "coloured"), (8, "white")):
        random = np.random.default_rng(5)
        n = 1_000_000
        regressors = regressors_of(kind, random, n, size)
        trace = palpate.VectorRls(size).trace(
            regressors.sum(1) + NOISE * random.standard_normal(n), regressors
        )
        yield f"size {size}, {kind}: {int(trace['alarm'].sum())} false alarms in {n:,} samples"


def padasip(output: Array, regressors: Array) -> Array:
    """Estimate with padasip's FilterRLS."""
    from padasip.filters import FilterRLS

    size = regressors.shape[1]
    model = FilterRLS(size, mu=FORGETTING, eps=1e-12, w=np.zeros(size))
    return np.array(
        [(model.adapt(y, x), model.w.copy())[1] for y, x in zip(output, regressors, strict=True)]
    )


def river(output: Array, regressors: Array) -> Array:
    """Estimate with river's BayesianLinearRegression."""
    from river.linear_model import BayesianLinearRegression

    names = [f"x{i}" for i in range(regressors.shape[1])]
    model = BayesianLinearRegression(beta=1e12 / (1 - FORGETTING), smoothing=FORGETTING)
    found = []
    for y, x in zip(output.tolist(), regressors.tolist(), strict=True):
        model.learn_one(dict(zip(names, x, strict=True)), y)
        found.append([model.predict_one({n: float(n == name) for n in names}) for name in names])
    return np.array(found)


def filterpy(output: Array, regressors: Array) -> Array:
    """Estimate with filterpy's FadingKalmanFilter, alpha^2 = 1 / forgetting."""
    from filterpy.kalman import FadingKalmanFilter

    size = regressors.shape[1]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # of filterpy itself
        kalman = FadingKalmanFilter(alpha=FORGETTING**-0.5, dim_x=size, dim_z=1)
        found = np.empty(regressors.shape)
    kalman.x, kalman.P, kalman.Q = np.zeros((size, 1)), 1e12 * np.eye(size), np.zeros((size, size))
    for k, (y, x) in enumerate(zip(output.tolist(), regressors, strict=True)):
        kalman.H = x[None, :]
        kalman.predict()
        kalman.update(y)
        found[k] = kalman.x[:, 0]
    return found


def statsmodels(output: Array, regressors: Array) -> Array:
    """Without forgetting: it has none."""
    from statsmodels.regression.recursive_ls import RecursiveLS

    return np.asarray(RecursiveLS(output, regressors).fit().recursive_coefficients.filtered).T


PEERS = {"padasip": padasip, "river": river, "filterpy": filterpy, "statsmodels": statsmodels}


def peers() -> Iterator[str]:
    """Yield speed and error of each library: a change of 30 % after half of the samples, the error from 12 samples on."""
    n = 2000
    size = 2
    output, regressors, truth = made("white", 0, n, size, n // 2, False)
    before = truth / [1.3, 1.0]
    true = np.where(np.arange(n)[:, None] < n // 2, before, truth)
    times: dict[str, float] = {}
    ours: dict[str, Callable[[Array, Array], Any]] = {
        "VectorRls.process": lambda y, x: palpate.VectorRls(size).process(y, x),
        "VectorRls.process, alarmed=0.9": lambda y, x: palpate.VectorRls(size, alarmed=0.9).process(
            y, x
        ),
    }
    yield f"{'size 2, 2,000 samples':34}{'ns a sample':>13}{'rms error':>12}{'12 after':>12}"
    for name, work in (
        ours | {name: peer for name, peer in PEERS.items() if find_spec(name)}
    ).items():
        found = work(output, regressors)
        best = np.inf
        for _ in range(200 if name in ours else 3):
            begun = time.perf_counter()
            work(output, regressors)
            best = min(best, time.perf_counter() - begun)
        times[name] = best / n * 1e9
        wrong = np.linalg.norm(found - true, axis=1) / np.linalg.norm(true, axis=1)
        rms = np.sqrt(np.mean(wrong[np.r_[50 : n // 2, n // 2 + 12 : n]] ** 2))
        yield f"{name:34}{times[name]:13.1f}{rms:12.2e}{wrong[n // 2 + 11]:12.2e}"
    if "statsmodels" in times:
        y = output[: n // 2]
        x = regressors[: n // 2]
        plain = palpate.VectorRls(size, steady=1.0, clip=100.0).process(y, x)
        yield f"equal to statsmodels without forgetting, from sample 3 on, to {np.abs(plain - statsmodels(y, x))[3:].max():.1e}"


def main() -> None:
    """Print all tables."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--runs", type=int, default=1000, help="of each kind")
    options = parser.parse_args()
    for table in (coverage(options.runs), changes(options.runs), peers()):
        for line in table:
            print(line, flush=True)
        print()


if __name__ == "__main__":
    main()
