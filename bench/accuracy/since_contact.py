"""The Fisher bound beside errors: of the running ratio against time since contact, and of the named scenarios."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from palpate.benchmark import LENGTH_S, SCENES, SETTLED_S, STEP_S, Estimate
from palpate.simulation import Simulation
from palpate.simulation.scenarios import SCENARIOS

from bench.accuracy.bound import Array, Setup, bound
from bench.accuracy.must_hold.presses import RATIO, held, recordings, running
from bench.aligned import contact
from bench.rivals import RIVALS

TREMORS = (0.0, 0.08, 0.12)
SINCE_S = (0.15, 0.2, 0.3, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0)
SHOWN = ("stiff-steady", "tremor", "strong-tremor", "light-touch", "step-up")
BOUND = "Fisher bound"
Curves = dict[str, list[float]]


def since_contact(seeds: int) -> dict[str, Curves]:
    """Return the rms error of each scene at SINCE_S, and the bound, for each of TREMORS."""
    return {f"{100 * tremor:g} %": _curves(tremor, seeds) for tremor in TREMORS}


def _curves(tremor: float, seeds: int) -> Curves:
    runs = list(recordings(held(tremor), range(seeds)))
    found: Curves = {BOUND: bound(Setup(ratio=RATIO, tremor=tremor), SINCE_S).tolist()}
    for scene in SCENES:
        errors = [[result.error for result in running(run, SINCE_S, scene)] for run in runs]
        found[f"{scene} scene"] = np.sqrt(np.mean(np.square(errors), axis=0)).tolist()
    for name, estimate in RIVALS.items():
        errors = [_rival(estimate, run) for run in runs]
        found[name] = np.sqrt(np.mean(np.square(errors), axis=0)).tolist()
    return found


def _rival(estimate: Estimate, run: Simulation) -> list[float]:
    """Return the errors of a rival, with the last pair at each of SINCE_S."""
    at, output, regressor = contact(run)
    ratio, _ = estimate(output, regressor)
    last = np.searchsorted(run.t_soft_s[at] - run.presses[0].start_s, SINCE_S, "right") - 1
    return list(ratio[last] / run.true_ratio[at[last]] - 1)


def table(found: dict[str, Curves], since_s: Sequence[float] = SINCE_S) -> str:
    """Return the errors as text, per cent."""
    lines = ["rms error at a time since contact, %, ratio 2.8" + "".join(f"{since:>7} s" for since in since_s)]
    for tremor, curves in found.items():
        for name, errors in curves.items():
            lines.append(f"tremor {tremor:5} {name:34} " + "".join(f"{100 * error:9.4f}" for error in errors))
    return "\n".join(lines)


def steady_bounds() -> dict[str, float]:
    """Return the bound of the steady rms error in the scenarios of SHOWN: those whose readings follow the model of the bound."""
    return {name: steady_bound(name) for name in SHOWN}


def steady_bound(name: str) -> float:
    """Return the median steady rms error of an estimator on the bound; after a step its memory begins anew."""
    scenario = SCENARIOS[name]
    press = scenario.presses[0]
    setup = Setup(ratio=press.ratios[0][1], depth_pF=press.depth_pF, rise_s=press.rise_s, tremor=scenario.tremor)
    if len(press.ratios) == 1:
        return _median_rms(bound(setup, np.arange(SETTLED_S, LENGTH_S, 0.5)))
    after = replace(setup, ratio=press.ratios[1][1], rise_s=1e-3)
    parts = ((setup, STEP_S), (after, LENGTH_S - STEP_S))
    return _median_rms(*(bound(part, np.arange(SETTLED_S, end, 0.5)) for part, end in parts))


def _median_rms(*parts: Array) -> float:
    """Return the median of the rms over time, for running errors with these standard deviations.

    Errors of efficient estimators on growing data have Cov(e(s), e(t)) = Var(e(t)) for s < t: from the end of the data
    back to their beginning, independent increments are added.
    """
    random, errors = np.random.default_rng(1), []
    for deviations in parts:
        increments = np.maximum(0, -np.diff(deviations**2, append=0))
        steps = np.sqrt(increments) * random.standard_normal((10_000, len(deviations)))
        errors.append(np.cumsum(steps[:, ::-1], axis=1))
    return float(np.median(np.sqrt(np.mean(np.hstack(errors) ** 2, axis=1))))
