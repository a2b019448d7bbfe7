"""How often the 95 % interval of an estimator holds the true ratio, by the kind of noise: for stability.py and its test.

The noise is either the same at all depths ("added"), or in proportion to the signal ("a share of it"). The standard
error takes the innovations for equally large at all depths.
"""

import math
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np
import palpate
from numpy.typing import NDArray
from palpate.simulation import scenarios

Array = NDArray[np.float64]
TRUTH = 2.5


class Noise(NamedTuple):
    """A regressor, and the noise of the output on it: a share of the signal, and an added part, pF."""

    name: str
    regressor: Callable[[np.random.Generator], Array]
    share: float
    added: float = 0.0

    def samples(self, seed: int) -> tuple[Array, Array]:
        """Return outputs and regressors."""
        random = np.random.default_rng(seed)
        x = self.regressor(random)
        y = TRUTH * x * (1 + self.share * random.standard_normal(len(x)))
        return y + self.added * random.standard_normal(len(x)), x


def _press(_: np.random.Generator) -> Array:
    k = np.arange(250)
    return np.asarray(0.25 * np.minimum(1, (k + 1) / 20) * (1 + 0.03 * np.sin(1.3 * k)))


def _turns(decades: float) -> Callable[[np.random.Generator], Array]:
    return lambda random: np.asarray(10 ** random.uniform(-decades / 2, decades / 2, 300))


def _sweep(decades: float) -> Callable[[np.random.Generator], Array]:
    return lambda _: np.geomspace(10 ** (decades / 2), 10 ** (-decades / 2), 300)


def _slow(factor: float) -> Callable[[np.random.Generator], Array]:
    return lambda _: 0.25 * factor ** (np.sin(2 * np.pi * np.arange(250) / 60) / 2)


NOISES = (
    *(Noise(f"press, added {added:g} pF", _press, 0, added) for added in (1e-4, 1e-5, 1e-6, 1e-7)),
    *(Noise(f"press, a share of {share:g}", _press, share) for share in (1e-2, 1e-4, 1e-6)),
    *(Noise(f"depth moves {factor:g}-fold, added", _slow(factor), 0, 2.5e-4) for factor in (2, 100)),
    *(Noise(f"depth moves {factor:g}-fold, a share", _slow(factor), 1e-3) for factor in (2, 10, 100)),
    *(Noise(f"depth falls over {decades} decades, a share", _sweep(decades), 1e-3) for decades in (1, 2, 3)),
    *(Noise(f"any depth of {decades} decades, a share", _turns(decades), 1e-3) for decades in (1, 2, 3, 4)),
)


def held(errors: Any, standard_errors: Any) -> float:
    """Return the share of the errors, of those with a standard error, that the 95 % interval holds."""
    ratio = np.abs(np.asarray(errors) / np.asarray(standard_errors))
    return float(np.mean(ratio[np.isfinite(ratio)] < 1.96))


def coverage(kind: Any, noise: Noise, seeds: int, *, divided: bool = False) -> float:
    """Return the coverage of an estimator; `divided`: it gets output / regressor, and 1."""
    errors, sizes = [], []
    for seed in range(seeds):
        output, regressor = noise.samples(seed)
        estimator = kind()
        samples = (output / regressor, np.ones_like(regressor)) if divided else (output, regressor)
        errors.append(estimator.process(*samples)[-1] - TRUTH)
        sizes.append(estimator.standard_error)
    return held(errors, sizes)


def touch_coverage(name: str, share: float, seeds: int) -> float:
    """Return the coverage of the touches of a scenario whose readings have an additional noise, a share of the change."""
    errors, sizes = [], []
    for seed in range(seeds):
        run, random = scenarios.run(name, seed), np.random.default_rng(seed + 10**6)
        channels = []
        for times, values in ((run.t_hard_s, run.hard), (run.t_soft_s, run.soft)):
            idle = values[times < run.presses[0].start_s].mean()
            channels.append(values + share * random.standard_normal(len(values)) * (values - idle))
        [touch] = palpate.touches(palpate.Recording(run.t_hard_s, run.t_soft_s, *channels))
        errors.append(touch.ratio - run.presses[0].ratios[-1][1])
        sizes.append(touch.standard_error)
    return held(errors, sizes)


def coverage_table(seeds: int = 1000) -> Iterator[str]:
    """Print the coverage by the kind of noise."""
    yield f"standard error: of {seeds} seeds, the 95 % interval holds the true ratio in"
    yield f"  {'':42} {'HandoverRls':>12} {'HandoverRls32':>14} {'given y / x and 1':>18}"
    for noise in NOISES:
        cells = [coverage(kind, noise, seeds) for kind in (palpate.HandoverRls, palpate.HandoverRls32)]
        cells.append(coverage(palpate.HandoverRls, noise, seeds, divided=True) if noise.share else math.nan)
        shown = ["" if math.isnan(cell) else f"{100 * cell:.1f} %" for cell in cells]
        yield f"  {noise.name:42} {shown[0]:>12} {shown[1]:>14} {shown[2]:>18}"
    touches = max(1, seeds // 5)
    yield f"  touches of the scene handheld, readings with an additional noise, {touches} seeds"
    for name in ("stiff-steady", "strong-tremor", "light-touch"):
        shares = (0.0, 1e-3, 1e-2)
        cells = [touch_coverage(name, share, touches) for share in shares]
        yield f"  {name:24}" + "".join(
            f"  a share of {share:g}: {100 * cell:.1f} %" for share, cell in zip(shares, cells, strict=True)
        )
