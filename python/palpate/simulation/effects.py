"""Named scenarios in which the readings do not follow C1 = r C2, or the converter's times; one effect each.

The object has the ratio 2.84 (70 OO), and is pressed 0.25 pF deep with a tremor of 1 %, unless the effect is another.
"""

from dataclasses import replace
from math import inf
from typing import Any

from palpate.elasticity import SORBOTHANE_MPA, Elasticity
from palpate.simulation.baseline import Baseline
from palpate.simulation.bumps import Bumps, Gauge
from palpate.simulation.converter import Converter, Stamps
from palpate.simulation.faults import Faults
from palpate.simulation.press import Press
from palpate.simulation.scenario import Scenario
from palpate.simulation.tilt import Tilt
from palpate.simulation.tremor import Lines

_RATIO = Elasticity().ratio(SORBOTHANE_MPA["70 OO"])
_START_S, _STEP_S = 2.0, 4.0  # start of the touch; from there to the step of the ratio
_DEPTH_PF = 0.25
_TOUCH = Press(_START_S, [(0.0, _RATIO)], depth_pF=_DEPTH_PF)
_HARD, _SOFT = Scenario().baselines


def _with(press: Press = _TOUCH, duration_s: float = 12.0, **parts: Any) -> Scenario:
    return Scenario(presses=[press], duration_s=duration_s, **parts)


def _soft(**baseline: float) -> tuple[Baseline, Baseline]:
    return _HARD, replace(_SOFT, **baseline)


def _both(**baseline: float) -> tuple[Baseline, Baseline]:
    return replace(_HARD, **baseline), replace(_SOFT, **baseline)


_PROBES = {
    "not-level": _with(bumps=Bumps(offset=0.02)),
    "bottoms-out": _with(bumps=Bumps(bottoms_pF=(0.75 * _RATIO * _DEPTH_PF, inf))),
    "cross-talk": _with(bumps=Bumps(cross_talk=0.01)),
    "power-gauge": _with(gauges=(Gauge(), Gauge(exponent=0.9, reference_pF=2 * _DEPTH_PF))),
    "quadratic-gauge": _with(gauges=(Gauge(), Gauge(quadratic_per_pF=0.4, reference_pF=2 * _DEPTH_PF))),
    "creep": _with(gauges=(Gauge(), Gauge(creep=0.05, creep_s=5.0))),
    "lag": _with(gauges=(Gauge(), Gauge(lag_s=0.1))),
}
_HANDS = {
    "tilted": _with(replace(_TOUCH, tilt_deg=(0.5, 0.0))),
    "tilt-ramp": _with(tilt=Tilt(ramp_per_s=0.02)),
    "rocking": _with(tilt=Tilt(rock=0.05, rock_Hz=0.5)),
    "tilt-walk": _with(tilt=Tilt(walk=0.01)),
    "relaxing": _with(replace(_TOUCH, relaxes=0.2, relaxation_s=1.0)),
    "small-step": _with(replace(_TOUCH, ratios=[(0.0, _RATIO), (_STEP_S, 1.01 * _RATIO)])),
    "tremor-lines": _with(tremor=0.08, spectrum=Lines()),
    # Five pairs of 0.1 fF, then nothing.
    "tap": _with(Press(_START_S, [(0.0, _RATIO)], depth_pF=1e-4, rise_s=0.03, hold_s=0.07, fall_s=0.03), 20.2),
}
_BASELINES = {
    "drift-hard": _with(baselines=(replace(_HARD, drift_pF_per_s=3e-4, drift_from_s=_START_S), _SOFT)),
    "drift-soft": _with(baselines=_soft(drift_pF_per_s=3e-4, drift_from_s=_START_S)),
    "drift-both": _with(baselines=_both(drift_pF_per_s=3e-4)),
    "wander": _with(baselines=_both(wander_pF=3e-4, wander_s=3.0)),
    "jump": _with(baselines=_soft(jump_pF=2e-3, jump_s=_START_S + 3.0)),
    "thermal": _with(baselines=_soft(thermal_pF=1e-3, thermal_s=3.0)),
}
_CONVERTERS = {
    "bursts": _with(faults=Faults(bursts_per_s=0.5, burst_s=0.3, burst_factor=20.0)),
    "pickup": _with(faults=Faults(pickup_pF=1e-3, pickup_Hz=50.0)),
    "lost-10": _with(faults=Faults(lost=0.1)),
    "lost-runs": _with(faults=Faults(lost=0.3, lost_run=8.0)),
    "coarse-codes": _with(converter=Converter(code_pF=1e-3)),
    "jitter": _with(tremor=0.03, converter=Converter(jitter_s=0.001)),
    "host-stamps": _with(tremor=0.08, converter=Converter(jitter_s=0.0), stamps=Stamps(host_s=0.003)),
    "skew": _with(tremor=0.03, stamps=Stamps(skew_s=0.003)),
    "slow-converter": _with(converter=Converter(capf=2, bus_s=1 / 36 - 0.02)),  # 18 pairs a second
    # 1,000 pairs a second; white noise of a conversion grows with 1 / sqrt(its time).
    "fast-converter": _with(
        converter=Converter(together=True, conversion_s=9e-4, bus_s=1e-4, jitter_s=1e-5, noise_pF=140e-6)
    ),
    "together": _with(tremor=0.03, converter=Converter(together=True, bus_s=0.015)),
}
EFFECTS: dict[str, Scenario] = _PROBES | _HANDS | _BASELINES | _CONVERTERS
"""Scenarios with an effect of the probe, the hand, a baseline, or the converter."""
