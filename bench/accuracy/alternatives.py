"""palpate beside other libraries on two signals of unit size: error, error bar and run time, each on data seen once.

    python -m bench.accuracy.alternatives [--seeds 40]
    python -m bench.accuracy.alternatives --write      put the table into docs/alternatives.md

Three worlds: the ratio is steady; it steps by 10 %; it is steady, and one sample in a hundred is off by 30 standard
deviations of the noise. Every estimator gets the signals as they are. The libraries have the settings of
`bench.accuracy.rivals`, with the same forgetting as `Rls`. A library that is not installed has no row.
"""

import argparse
import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import palpate
from numpy.typing import NDArray

from bench.accuracy import rivals
from bench.results_age import ROOT
from bench.speed.__main__ import replace_table

Array = NDArray[np.float64]
Estimate = Callable[[Array, Array], tuple[Array, Array | None]]
"""From outputs and regressors to the ratios, and to their standard errors if it has some."""

SAMPLES = 2000
STEP_AT = 1000
SETTLED = 500  # errors count from this sample on
RATIO = 20.0
STEP = 1.1
NOISE = 0.2  # of the output
OUTLIER_SHARE = 0.01
OUTLIER_SIZE = 30.0  # standard deviations of the noise
NEAR = 0.01  # of the ratio
PAGE = ROOT / "docs" / "alternatives.md"
MARK = "<!-- python -m bench.accuracy.alternatives -->"
COLUMNS = (
    "| | error, steady, % | samples to a step of 10 % | error with outliers, % "
    "| 95 % intervals that hold, % | ns a sample |"
)


@dataclass(frozen=True)
class TwoSignals:
    """Signals whose ratio is known."""

    output: Array
    regressor: Array
    ratio: Array


def two_signals(seed: int, *, step: float = 1.0, outlier_share: float = 0.0) -> TwoSignals:
    """Return a regressor between 0.5 and 1.5, and a noisy output."""
    rng = np.random.default_rng(seed)
    regressor = rng.uniform(0.5, 1.5, SAMPLES)
    ratio = np.full(SAMPLES, RATIO)
    ratio[STEP_AT:] *= step
    noise = NOISE * rng.standard_normal(SAMPLES)
    is_outlier = rng.random(SAMPLES) < outlier_share
    noise[is_outlier] *= OUTLIER_SIZE
    return TwoSignals(ratio * regressor + noise, regressor, ratio)


def handover(output: Array, regressor: Array) -> tuple[Array, Array | None]:
    """Estimate with HandoverRls as it is."""
    rows = palpate.HandoverRls().trace(output, regressor)
    return rows["ratio"], rows["standard_error"]


def plain_rls(output: Array, regressor: Array) -> tuple[Array, Array | None]:
    """Estimate with Rls, the same forgetting as the libraries."""
    unknown = rivals.COVARIANCE
    estimator = palpate.Rls(
        forgetting=rivals.FORGETTING, initial_covariance=unknown, max_covariance=unknown
    )
    return estimator.process(output, regressor), None


def of_library(estimate: rivals.Method) -> Estimate:
    """Return a library's estimate, which has no error bar."""

    def without_error(output: Array, regressor: Array) -> tuple[Array, Array | None]:
        return estimate(output, regressor), None

    return without_error


def estimators() -> dict[str, Estimate]:
    """Return the estimators that are installed, by name."""
    found: dict[str, Estimate] = {"palpate `HandoverRls`": handover, "palpate `Rls`": plain_rls}
    names = {
        "scipy": "scipy `lfilter`, twice",
        "padasip": "padasip `FilterRLS`",
        "river": "river `BayesianLinearRegression`",
        "filterpy": "filterpy `FadingKalmanFilter`",
        "simdkalman": "simdkalman `primitives`",
    }
    for library, estimate in rivals.installed().items():
        found[names[library]] = of_library(estimate)
    return found


@dataclass(frozen=True)
class Figures:
    """What an estimator does in the three worlds.

    Attributes
    ----------
    steady, outliers : float, %
        Error of the ratio, rms, of the last samples.
    delay : float
        Samples after the step until the ratio is within 1 % and stays there.
    covered : float, %
        Intervals of 95 % that contain the ratio, after the step, too; nan: it has none.
    sample_ns : float
        Run time of a sample, the fastest of the seeds.
    """

    steady: float
    delay: float
    outliers: float
    covered: float
    sample_ns: float


def rms_error(ratio: Array, signals: TwoSignals) -> float:
    """Return the error of the settled ratios, %."""
    relative = ratio[SETTLED:] / signals.ratio[SETTLED:] - 1
    return float(100 * np.sqrt(np.mean(relative**2)))


def delay_of(ratio: Array, signals: TwoSignals) -> int:
    """Return after how many samples the ratio is near the new one, and stays there."""
    is_far = abs(ratio[STEP_AT:] / signals.ratio[STEP_AT:] - 1) > NEAR
    far = np.flatnonzero(is_far)
    return int(far[-1]) + 1 if len(far) else 0


def share_covered(ratio: Array, error: Array | None, signals: TwoSignals) -> float:
    """Return how many intervals of 95 % contain the ratio, %, with those after the step."""
    if error is None:
        return float("nan")
    is_inside = abs(ratio - signals.ratio) <= 1.96 * error
    return float(100 * is_inside[SETTLED:].mean())


def figures_of(estimate: Estimate, seeds: int) -> Figures:
    """Measure an estimator; the first pass, which may import and compile, is not counted."""
    warm_up = two_signals(0)
    estimate(warm_up.output, warm_up.regressor)
    steady, delays, outliers, covered, times_ns = [], [], [], [], []
    for seed in range(1, seeds + 1):
        signals = two_signals(seed)
        begun_ns = time.perf_counter_ns()
        ratio, error = estimate(signals.output, signals.regressor)
        times_ns.append((time.perf_counter_ns() - begun_ns) / SAMPLES)
        steady.append(rms_error(ratio, signals))

        signals = two_signals(seed, step=STEP)
        ratio, error = estimate(signals.output, signals.regressor)
        delays.append(delay_of(ratio, signals))
        covered.append(share_covered(ratio, error, signals))

        signals = two_signals(seed, outlier_share=OUTLIER_SHARE)
        ratio, error = estimate(signals.output, signals.regressor)
        outliers.append(rms_error(ratio, signals))
    return Figures(
        statistics.median(steady),
        statistics.median(delays),
        statistics.median(outliers),
        statistics.median(covered),
        min(times_ns),
    )


def two_digits(value: float) -> str:
    """Return a number with two digits, without an exponent."""
    return f"{float(f'{value:.2g}'):,.0f}"


def table(found: dict[str, Figures]) -> str:
    """Return the figures as Markdown."""
    lines = [COLUMNS, "|---|---|---|---|---|---|"]
    for name, each in found.items():
        covered = "no error bar" if np.isnan(each.covered) else f"{each.covered:.0f}"
        lines.append(
            f"| {name} | {each.steady:.2g} | {each.delay:.0f} | {each.outliers:.2g} "
            f"| {covered} | {two_digits(each.sample_ns)} |"
        )
    return "\n".join(lines)


def main() -> None:
    """Measure and print, or write the page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=40)
    parser.add_argument("--write", action="store_true", help=f"put the table into {PAGE.name}")
    options = parser.parse_args()
    found = {}
    for name, estimate in estimators().items():
        found[name] = figures_of(estimate, options.seeds)
    print(table(found))
    if options.write:
        text = PAGE.read_text(encoding="utf-8")
        PAGE.write_text(replace_table(text, MARK, table(found)), encoding="utf-8")


if __name__ == "__main__":
    main()
