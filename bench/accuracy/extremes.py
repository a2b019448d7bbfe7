"""How large errors are with extreme inputs, and for which inputs an estimator is right.

    python -m bench.accuracy.extremes

Prints, for `AdaptiveRls` and `AdaptiveRls32`, how each case ends with its largest errors in eps; and the range of each estimator.
Exact values are from the reference, with so many digits that its cancellation does not matter (700: a regressor of
1e153 changes a covariance from 1e4 to 1e-306). A case must end in one of these ways: right (within a number of eps),
refused (samples counted, the state unchanged), or unexcited (the regressor is so small that the prior dominates: the ratio
is the initial one, and the covariance stays near its initial value). tests/core/test_extremes.py checks all of them.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from decimal import Decimal, localcontext
from typing import Any

import numpy as np
import palpate
from numpy.typing import NDArray
from palpate import reference

Array = NDArray[np.float64]
TWINS: dict[Any, Any] = {np.float64: palpate.AdaptiveRls, np.float32: palpate.AdaptiveRls32}
ESTIMATORS = ("Rls", "AdaptiveRls", "HandoverRls", "Rls32", "AdaptiveRls32", "HandoverRls32")


@dataclass(frozen=True)
class Case:
    """Samples, the settings for them, and the largest allowed rounding error, eps."""

    name: str
    output: Array
    regressor: Array
    settings: dict[str, float] = field(default_factory=dict)
    ratio_eps: float = 16.0
    covariance_eps: float = 16.0
    ends: str = "right"


def press(
    size: int, ratio: float = 2.5, scale: float = 1.0, noise: float = 1e-4, seed: int = 1
) -> tuple[Array, Array]:
    """Return a held press with tremor."""
    rng = np.random.default_rng(seed)
    regressor = 0.25 * (1 + 0.03 * np.sin(1.3 * np.arange(size)))
    return (ratio * regressor + noise * rng.standard_normal(size)) * scale, regressor * scale


def stepped() -> tuple[Array, Array]:
    """Return a press with a step of the ratio from 2.5 to 3, 300 samples before its end."""
    before = press(100)
    after = press(300, 3.0, seed=2)
    return np.r_[before[0], after[0]], np.r_[before[1], after[1]]


def scaled(name: str, regressor: Array, seed: int = 2, **more: Any) -> Case:
    """Return a case of ratio 2.5 with a relative noise of 1e-4 on a given regressor, in units of any size."""
    noise = 1 + 1e-4 * np.random.default_rng(seed).standard_normal(len(regressor))
    return Case(name, 2.5 * regressor * noise, regressor, **more)


def exact_cases(kind: Any) -> Iterator[Case]:
    """Yield all cases that are short enough for the reference."""
    yield Case("ordinary press", *press(400))
    for ratio in (0.0, -3.0, 1e6, 1 + 1e-9, 11.06):
        yield Case(f"ratio {ratio:.10g}", *press(300, ratio, noise=1e-4 * max(abs(ratio), 1)))
    # After a large x the information is x^2, and the contribution of a small x is lost by rounding: the error of the
    # sums grows with the memory, not with the range of x.
    jump = np.where(np.arange(600) % 2, 1e4, 1e-4)
    decades = 10 ** np.random.default_rng(3).uniform(-3, 3, 600)
    yield scaled("regressor 1e4 and 1e-4 in turn", jump, ratio_eps=64, covariance_eps=128)
    yield scaled("regressor over six decades", decades, ratio_eps=64, covariance_eps=128)
    yield scaled(
        "four decades, then none",
        np.r_[decades[:300], np.zeros(300)],
        ratio_eps=64,
        covariance_eps=128,
    )
    for power in (-12, -6, 0, 6, 12, 20):
        prior = {"initial_covariance": 10.0**power, "max_covariance": 10.0 ** max(power, 6)}
        yield Case(f"initial covariance 1e{power}", *press(300), settings=prior)
    for power in (9, 18):
        prior = {"initial_covariance": 10.0**power, "max_covariance": 10.0**power}
        yield Case(f"initial covariance 1e{power}, a step", *stepped(), settings=prior)
    output, regressor = press(400)
    flicker = output + np.where(np.arange(400) % 2, 0.06, -0.06)
    yield Case(
        "alarm flickering every sample", flicker, regressor, {"drift": 0.055, "threshold": 0.002}
    )
    yield Case(
        "always in alarm",
        output + 0.1 * np.sign(np.sin(np.arange(400.0))),
        regressor,
        {"alarmed": 0.5},
    )
    yield Case("farads instead of picofarads", *press(300, scale=1e-12), ends="unexcited")
    yield Case("1e-30 pF", *press(300, scale=1e-30), ends="unexcited")
    info = np.finfo(kind)
    large = float(info.max) / 8
    small = float(info.tiny)
    root = float(info.max) ** 0.5 / 8
    yield Case(f"regressor {large:.0e}", *press(60, scale=large), ends="refused")
    yield Case(f"regressor {small:.0e}", *press(60, scale=small), ends="unexcited")
    yield Case("subnormal", *press(60, scale=small / 64), ends="unexcited")
    yield scaled(f"regressor {root:.0e}, whose square fits", root * np.ones(100))


@dataclass(frozen=True)
class Outcome:
    """Result of an estimator in a case. Errors in eps of its type, the largest of all samples."""

    ends: str
    ratio: float
    ratio_eps: float = 0.0
    covariance_eps: float = 0.0
    alarms_differ: int = 0


def exactly(output: Any, regressor: Any, digits: int, **settings: float) -> reference.Trace:
    """Run the reference."""
    with localcontext(prec=digits):
        return reference.adaptive_rls(
            np.array([Decimal(v) for v in output.tolist()]),
            np.array([Decimal(v) for v in regressor.tolist()]),
            number=Decimal,
            **settings,
        )


def largest_error(found: Any, exact: Any, eps: float, floor: float) -> float:
    """Return the largest |found - exact| in eps of |exact|, or of `floor` where that is larger."""
    pairs = ((Decimal(float(a)), b) for a, b in zip(found, exact, strict=True))
    return max(float(abs(a - b) / max(abs(b), Decimal(floor))) / eps for a, b in pairs)


def outcome(kind: Any, estimator: Any, case: Case, floor: float = 1.0) -> Outcome:
    """Run a case: errors of the ratio relative to it, or to `floor` (the initial ratio) where that is larger."""
    with np.errstate(over="ignore", under="ignore"):
        output = case.output.astype(kind)
        regressor = case.regressor.astype(kind)
    settings = {
        name: float(kind(value))
        for name, value in {**estimator().settings, **case.settings}.items()
    }
    info = np.finfo(kind)
    one = estimator(**settings)
    rows = one.trace(output, regressor)
    if one.rejected:
        untouched = (one.rejected, one.ratio) == (len(output), settings["initial_ratio"])
        return Outcome("refused" if untouched else "partly refused", one.ratio)
    exact = exactly(output, regressor, 700 if "square" in case.name else 60, **settings)
    moved = abs(one.ratio - settings["initial_ratio"]) > 1e-3
    # the bound may be the initial covariance itself
    held = one.covariance >= 0.9 * settings["initial_covariance"]
    return Outcome(
        "unexcited" if held and not moved else "right",
        one.ratio,
        largest_error(rows["ratio"], exact.ratio, float(info.eps), floor),
        largest_error(rows["covariance"], exact.covariance, float(info.eps), float(info.tiny)),
        int(np.count_nonzero(rows["alarm"] != exact.alarm)),
    )


def ending(estimator: Any, scale: float) -> str:
    """Return how a press of a quarter of `scale`, pF, ends with the default settings; "wrong" must not occur."""
    kind = np.float32 if estimator.__name__.endswith("32") else np.float64
    with np.errstate(over="ignore", under="ignore"):
        output, regressor = (part.astype(kind) for part in press(60, scale=scale))
    one = estimator()
    one.process(output, regressor)
    if one.rejected:
        return "refused" if (one.rejected, one.ratio) == (60, 1.0) else "partly refused"
    if abs(one.ratio / 2.5 - 1) < 1e-3:
        return "right"
    return "unexcited" if 1 - 1e-6 <= one.ratio < 2.5 else "wrong"


def powers(estimator: Any) -> range:
    """Return the powers of ten of a type without its subnormal numbers."""
    info = np.finfo(np.float32 if estimator.__name__.endswith("32") else np.float64)
    return range(round(np.log10(info.tiny)) + 1, round(np.log10(info.max)))


def ranges() -> Iterator[str]:
    """Yield a line for each estimator: the regressors, pF, with which it is right."""
    for name in ESTIMATORS:
        kind = getattr(palpate, name)
        ends = {0.25 * 10.0**power: ending(kind, 10.0**power) for power in powers(kind)}
        right, refused = (
            [size for size, end in ends.items() if end == wanted] for wanted in ("right", "refused")
        )
        yield f"{name:14} right from {min(right):.1e} to {max(right):.0e} pF, refused from {min(refused):.1e} pF"


@dataclass(frozen=True)
class NoisyCase:
    """Samples with noise, and the coefficients behind them: of HandoverRls and HandoverRls32, or (two or more) of VectorRls."""

    name: str
    output: Array
    regressors: Array
    true: Array

    def ends(self, estimator: Any, blocks: int = 1) -> str:
        """Return how the estimator ends: right is within 4.5 standard errors, unknown without one; "wrong" must not occur."""
        for _ in range(blocks):
            estimator.process(self.output, self.regressors)
        if estimator.rejected:
            return "refused"
        vector = isinstance(estimator, palpate.VectorRls)
        found = estimator.coefficients if vector else np.array([estimator.ratio])
        errors = estimator.standard_errors if vector else np.array([estimator.standard_error])
        if np.isnan(errors).any():
            return "unknown"
        return "right" if (np.abs(found - self.true) <= 4.5 * errors).all() else "wrong"


def noisy_cases(size: int) -> Iterator[NoisyCase]:
    """Yield what numbers with few digits make hard: each of this size."""
    random = np.random.default_rng(4)
    noise = random.standard_normal(size)
    x = random.standard_normal((size, 2))
    ones = np.ones(size)
    level = np.array([2.5])
    yield NoisyCase("an ordinary press", 2.5 + 1e-3 * noise, ones, level)
    yield NoisyCase("a level of 1e6 sd", 2.5 + 2.5e-6 * noise, ones, level)
    yield NoisyCase("a level of 1e6 sd around 0", (2.5 + 2.5e-6 * noise) * x[:, 0], x[:, 0], level)
    for power in (-30, -12, 12, 30):
        scale = 10.0**power
        yield NoisyCase(
            f"regressors of 1e{power}", scale * (2.5 + 1e-3 * noise), scale * ones, level
        )
    both = np.array([1.0, 2.0])
    for power in (-3, -6, -9):
        near = np.stack([x[:, 0], x[:, 0] + 10.0**power * x[:, 1]], axis=1)
        yield NoisyCase(f"collinear but for 1e{power}", near @ both + 1e-3 * noise, near, both)
    far = x + np.array([1e6, 0.0])
    yield NoisyCase("an offset of 1e6 sd", far @ both + 1e-3 * noise, far, both)
    tiny = 1e-30 * x
    yield NoisyCase("two regressors of 1e-30", tiny @ both + 1e-33 * noise, tiny, both)


def noisy_endings(size: int = 3000) -> Iterator[tuple[str, str, str]]:
    """Yield the estimator, the case, and how it ends."""
    with np.errstate(over="ignore", under="ignore"):
        for case in noisy_cases(size):
            if case.regressors.ndim == 2:
                yield "VectorRls", case.name, case.ends(palpate.VectorRls(2))
                continue
            single = replace(
                case, output=case.output.astype("f4"), regressors=case.regressors.astype("f4")
            )
            yield "HandoverRls", case.name, case.ends(palpate.HandoverRls())
            yield "HandoverRls32", case.name, single.ends(palpate.HandoverRls32())


def long_endings(blocks: int = 100, size: int = 1_000_000) -> Iterator[tuple[str, str, str]]:
    """Yield how 1e8 samples end: the same block again and again, around 0, with noise that is as often up as down."""
    random = np.random.default_rng(5)
    x = random.standard_normal(size)
    noise = random.standard_normal(size)
    noise -= (noise @ x) / (x @ x) * x  # else the same error in each block would be no noise
    case = NoisyCase(f"{blocks * size:.0e} samples", 2.5 * x + 0.1 * noise, x, np.array([2.5]))
    single = replace(case, output=case.output.astype("f4"), regressors=x.astype("f4"))
    yield "HandoverRls", case.name, case.ends(palpate.HandoverRls(), blocks)
    yield "HandoverRls32", case.name, single.ends(palpate.HandoverRls32(), blocks)
    column = replace(case, regressors=x[:, None])
    yield "VectorRls", case.name, column.ends(palpate.VectorRls(1), blocks)


def main() -> None:
    """Print all tables."""
    for kind, estimator in TWINS.items():
        for case in exact_cases(kind):
            found = outcome(kind, estimator, case)
            print(
                f"{kind.__name__} {case.name:36} {found.ends:10} ratio {found.ratio_eps:5.1f} eps, covariance {found.covariance_eps:6.1f} eps"
            )
    print(*ranges(), sep="\n")
    for name, noisy, ends in (*noisy_endings(), *long_endings()):
        print(f"{name:14} {noisy:28} {ends}")


if __name__ == "__main__":
    main()
