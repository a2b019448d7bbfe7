"""Named scenarios; each is a minimal example of one difficulty."""

from dataclasses import replace
from math import inf
from typing import Any

from palpate.ad7746.registers import NOISE_PF
from palpate.elasticity import SORBOTHANE_MPA, Elasticity
from palpate.simulation.mechanics import Bumps, Gauge
from palpate.simulation.press import Press, Tilt
from palpate.simulation.probe import Scenario, Simulation, simulate
from palpate.simulation.readings import BaselineModel, ConverterModel, Faults, Stamps
from palpate.simulation.signals import Lines
from palpate.uncertainty import TOUCH_SCATTER

PROBE = Elasticity()  # of all scenarios: ratio 10 on a rigid object

_SOFT, _MIDDLE, _STIFF = (PROBE.ratio(SORBOTHANE_MPA[name]) for name in ("30 OO", "70 OO", "70 A"))
_START_S = 2.0  # start of the touch
_STEP_S = 4.0  # from there to the step of the ratio
_NOISE = NOISE_PF[0]
_GAUGES = (Gauge(quadratic_per_pF=0.005), Gauge(quadratic_per_pF=0.005))
_DEPTH_PF = 0.25
_TOUCH = Press(_START_S, [(0.0, _MIDDLE)], depth_pF=_DEPTH_PF)
_HARD_BASELINE, _SOFT_BASELINE = Scenario().baselines


def _with(press: Press = _TOUCH, duration_s: float = 12.0, **parts: Any) -> Scenario:
    return Scenario(presses=[press], duration_s=duration_s, **parts)


def _soft_gauge(**gauge: float) -> Scenario:
    return _with(gauges=(Gauge(), Gauge(**gauge)))


def _hard_baseline(**baseline: float) -> Scenario:
    return _with(baselines=(replace(_HARD_BASELINE, **baseline), _SOFT_BASELINE))


def _soft_baseline(**baseline: float) -> Scenario:
    return _with(baselines=(_HARD_BASELINE, replace(_SOFT_BASELINE, **baseline)))


def _baselines(**both: float) -> Scenario:
    hard = replace(_HARD_BASELINE, **both)
    soft = replace(_SOFT_BASELINE, **both)
    return _with(baselines=(hard, soft))


_PROBES = {
    "not-level": _with(bumps=Bumps(offset=0.02)),
    "bottoms-out": _with(bumps=Bumps(bottoms_pF=(0.75 * _MIDDLE * _DEPTH_PF, inf))),
    "cross-talk": _with(bumps=Bumps(cross_talk=0.01)),
    "power-gauge": _soft_gauge(exponent=0.9, reference_pF=2 * _DEPTH_PF),
    "quadratic-gauge": _soft_gauge(quadratic_per_pF=0.4, reference_pF=2 * _DEPTH_PF),
    "creep": _soft_gauge(creep=0.05, creep_s=5.0),
    "lag": _soft_gauge(lag_s=0.1),
}
_HANDS = {
    "tilted": _with(replace(_TOUCH, tilt_deg=(0.5, 0.0))),
    "tilt-ramp": _with(tilt=Tilt(ramp_per_s=0.02)),
    "rocking": _with(tilt=Tilt(rock=0.05, rock_Hz=0.5)),
    "tilt-walk": _with(tilt=Tilt(walk=0.01)),
    "relaxing": _with(replace(_TOUCH, relaxes=0.2, relaxation_s=1.0)),
    "small-step": _with(replace(_TOUCH, ratios=[(0.0, _MIDDLE), (_STEP_S, 1.01 * _MIDDLE)])),
    "tremor-lines": _with(tremor=0.08, spectrum=Lines()),
    # Five pairs of 0.1 fF, then nothing.
    "tap": _with(
        Press(_START_S, [(0.0, _MIDDLE)], depth_pF=1e-4, rise_s=0.03, hold_s=0.07, fall_s=0.03),
        20.2,
    ),
}
_BASELINES = {
    "drift-hard": _hard_baseline(drift_pF_per_s=3e-4, drift_from_s=_START_S),
    "drift-soft": _soft_baseline(drift_pF_per_s=3e-4, drift_from_s=_START_S),
    "drift-both": _baselines(drift_pF_per_s=3e-4),
    "wander": _baselines(wander_pF=3e-4, wander_s=3.0),
    "jump": _soft_baseline(jump_pF=2e-3, jump_s=_START_S + 3.0),
    "thermal": _soft_baseline(thermal_pF=1e-3, thermal_s=3.0),
}
_CONVERTERS = {
    "bursts": _with(faults=Faults(bursts_per_s=0.5, burst_s=0.3, burst_factor=20.0)),
    "pickup": _with(faults=Faults(pickup_pF=1e-3, pickup_Hz=50.0)),
    "lost-10": _with(faults=Faults(lost=0.1)),
    "lost-runs": _with(faults=Faults(lost=0.3, lost_run=8.0)),
    "coarse-codes": _with(converter=ConverterModel(code_pF=1e-3)),
    "jitter": _with(tremor=0.03, converter=ConverterModel(jitter_s=0.001)),
    "host-stamps": _with(
        tremor=0.08, converter=ConverterModel(jitter_s=0.0), stamps=Stamps(host_s=0.003)
    ),
    "skew": _with(tremor=0.03, stamps=Stamps(skew_s=0.003)),
    # 18 pairs a second
    "slow-converter": _with(converter=ConverterModel(capf=2, bus_s=1 / 36 - 0.02)),
    # 1,000 pairs a second; white noise of a conversion grows with 1 / sqrt(its time).
    "fast-converter": _with(
        converter=ConverterModel(
            together=True, conversion_s=9e-4, bus_s=1e-4, jitter_s=1e-5, noise_pF=140e-6
        )
    ),
    "together": _with(tremor=0.03, converter=ConverterModel(together=True, bus_s=0.015)),
}
# Scenarios with an effect of the probe, the hand, a baseline, or the converter.
EFFECTS: dict[str, Scenario] = _PROBES | _HANDS | _BASELINES | _CONVERTERS


def _drifting(hard_pF_per_s: float, soft_pF_per_s: float) -> tuple[BaselineModel, BaselineModel]:
    hard = replace(_HARD_BASELINE, drift_pF_per_s=hard_pF_per_s)
    soft = replace(_SOFT_BASELINE, drift_pF_per_s=soft_pF_per_s)
    return hard, soft


def _one(ratio: float, depth_pF: float = _DEPTH_PF, **parts: Any) -> Scenario:
    press = Press(_START_S, [(0.0, ratio)], depth_pF=depth_pF)
    return _with(press, 10.5, **parts)


def _step(share: float) -> Scenario:
    ratios = [(0.0, _MIDDLE), (_STEP_S, share * _MIDDLE)]
    return _with(Press(_START_S, ratios), 10.5)


def _creeping(hard_pF_per_s: float, soft_pF_per_s: float) -> Scenario:
    press = replace(_TOUCH, creep=-0.1)
    baselines = _drifting(hard_pF_per_s, soft_pF_per_s)
    return _with(press, 10.5, tilt=Tilt(ramp_per_s=0.005), baselines=baselines)


def _specimens(times: int, oblique: float) -> Scenario:
    presses = []
    for number, name in enumerate(times * ("30 OO", "70 OO", "40 A", "70 A")):
        ratio = PROBE.ratio(SORBOTHANE_MPA[name])
        presses.append(Press(2.0 + 9.0 * number, [(0.0, ratio)]))
    return Scenario(
        presses=presses,
        duration_s=1.5 + 9.0 * len(presses),
        tilt=Tilt(oblique=oblique),
        gauges=_GAUGES,
    )


TWO_ROUNDS = replace(_specimens(2, TOUCH_SCATTER), gauges=(Gauge(), Gauge()))
"""Two touches on each of four specimens: a short session.

The hand scatters by `palpate.uncertainty.TOUCH_SCATTER`, and no touch has a flag.
"""


def _sliding() -> Scenario:
    ratios = [(0.0, _SOFT), (5.0, _MIDDLE), (9.0, 1.3 * _MIDDLE), (13.0, _SOFT)]
    return Scenario(presses=[Press(2.0, ratios, hold_s=16.5)], duration_s=20.5, tremor=0.02)


def _all() -> Scenario:
    """Return five touches with all difficulties except saturation."""
    rigid = PROBE.rigid_ratio
    ratios = [
        [(0.0, _SOFT)],
        [(0.0, _MIDDLE), (_STEP_S, 1.3 * _MIDDLE)],
        [(0.0, _STIFF)],
        [(0.0, 0.95 * rigid)],
        [(0.0, _MIDDLE)],
    ]
    depths = (0.25, 0.25, 0.2, 0.2, 0.05)
    presses = []
    for number, depth_pF in enumerate(depths):
        presses.append(Press(2.0 + 9.0 * number, ratios[number], depth_pF=depth_pF))
    return Scenario(
        presses=presses,
        duration_s=46.5,
        tremor=0.03,
        tilt=Tilt(oblique=0.01, ramp_per_s=0.001),
        gauges=_GAUGES,
        baselines=_drifting(2e-5, -1e-5),
        faults=Faults(spikes_per_s=0.1, spike_pF=100 * _NOISE, lost=0.01),
    )


# The readings follow C1 = r C2 up to the noise, a slow drift and single faults.
FOLLOWING: dict[str, Scenario] = {
    "soft-steady": _one(_SOFT),
    "stiff-steady": _one(_STIFF),
    "near-rigid": _one(0.98 * PROBE.rigid_ratio),
    "step-up": _step(1.3),
    "step-down": _step(0.7),
    "slow-drift": _creeping(5e-5, -3e-5),
    "slow-drift-back": _creeping(-5e-5, 3e-5),
    "tremor": _one(_MIDDLE, tremor=0.03),
    "strong-tremor": _one(_MIDDLE, tremor=0.08),
    "light-touch": _one(_MIDDLE, depth_pF=5 * _NOISE),
    "spikes": _one(_MIDDLE, faults=Faults(spikes_per_s=0.5, spike_pF=100 * _NOISE)),
    "dropouts": _one(_MIDDLE, faults=Faults(lost=0.05)),
    "saturating": _one(_STIFF, depth_pF=0.52),
    "four-specimens": _specimens(1, 0.01),
    "sliding": _sliding(),
    "all": _all(),
}

SCENARIOS: dict[str, Scenario] = FOLLOWING | EFFECTS


def run(name: str, seed: int = 0) -> Simulation:
    """Simulate a named scenario.

    Parameters
    ----------
    name : str
        One of `SCENARIOS`.
    seed : int
        The same seed gives the same recording.

    Returns
    -------
    Simulation

    Raises
    ------
    ValueError
        `name` is not in `SCENARIOS`.

    Examples
    --------
    >>> run("tremor", seed=3).hard.shape
    (403,)
    """
    if name not in SCENARIOS:
        raise ValueError(f"scenario: got {name!r}, allowed: {', '.join(SCENARIOS)}")
    return simulate(SCENARIOS[name], seed)
