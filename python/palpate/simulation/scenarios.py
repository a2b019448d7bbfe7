"""Named scenarios; each is a minimal example of one difficulty."""

from dataclasses import replace

from palpate.ad7746.datasheet import NOISE_PF
from palpate.elasticity import SORBOTHANE_MPA, Elasticity
from palpate.simulation.baseline import Baseline
from palpate.simulation.bumps import Gauge
from palpate.simulation.effects import EFFECTS
from palpate.simulation.faults import Faults
from palpate.simulation.press import Press
from palpate.simulation.probe import Simulation, simulate
from palpate.simulation.scenario import Scenario
from palpate.simulation.tilt import Tilt

PROBE = Elasticity()
"""The probe of all scenarios: ratio 10 on a rigid object."""

_SOFT, _MIDDLE, _STIFF = (PROBE.ratio(SORBOTHANE_MPA[name]) for name in ("30 OO", "70 OO", "70 A"))
_START_S, _STEP_S = 2.0, 4.0  # start of the touch; from there to the step of the ratio
_NOISE = NOISE_PF[0]
_GAUGES = (Gauge(quadratic_per_pF=0.005), Gauge(quadratic_per_pF=0.005))


def _drifting(hard_pF_per_s: float, soft_pF_per_s: float) -> tuple[Baseline, Baseline]:
    return (Baseline(0.62, drift_pF_per_s=hard_pF_per_s), Baseline(-0.41, drift_pF_per_s=soft_pF_per_s))


def _one(*ratios: tuple[float, float], depth_pF: float = 0.25, creep: float = 0.0) -> Scenario:
    return Scenario(presses=[Press(_START_S, ratios, depth_pF=depth_pF, creep=creep)], duration_s=10.5)


def _four() -> Scenario:
    names = ("30 OO", "70 OO", "40 A", "70 A")
    presses = [Press(2.0 + 9.0 * i, [(0.0, PROBE.ratio(SORBOTHANE_MPA[n]))]) for i, n in enumerate(names)]
    return Scenario(presses=presses, duration_s=37.5, tilt=Tilt(oblique=0.01), gauges=_GAUGES)


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
    presses = [Press(2.0 + 9.0 * i, r, depth_pF=d) for i, (r, d) in enumerate(zip(ratios, depths, strict=True))]
    return Scenario(
        presses=presses,
        duration_s=46.5,
        tremor=0.03,
        tilt=Tilt(oblique=0.01, ramp_per_s=0.001),
        gauges=_GAUGES,
        baselines=_drifting(2e-5, -1e-5),
        faults=Faults(spikes_per_s=0.1, spike_pF=100 * _NOISE, lost=0.01),
    )


_CREEPING = replace(_one((0.0, _MIDDLE), creep=-0.1), tilt=Tilt(ramp_per_s=0.005))

FOLLOWING: dict[str, Scenario] = {
    "soft-steady": _one((0.0, _SOFT)),
    "stiff-steady": _one((0.0, _STIFF)),
    "near-rigid": _one((0.0, 0.98 * PROBE.rigid_ratio)),
    "step-up": _one((0.0, _MIDDLE), (_STEP_S, 1.3 * _MIDDLE)),
    "step-down": _one((0.0, _MIDDLE), (_STEP_S, 0.7 * _MIDDLE)),
    "slow-drift": replace(_CREEPING, baselines=_drifting(5e-5, -3e-5)),
    "slow-drift-back": replace(_CREEPING, baselines=_drifting(-5e-5, 3e-5)),
    "tremor": replace(_one((0.0, _MIDDLE)), tremor=0.03),
    "strong-tremor": replace(_one((0.0, _MIDDLE)), tremor=0.08),
    "light-touch": _one((0.0, _MIDDLE), depth_pF=5 * _NOISE),
    "spikes": replace(_one((0.0, _MIDDLE)), faults=Faults(spikes_per_s=0.5, spike_pF=100 * _NOISE)),
    "dropouts": replace(_one((0.0, _MIDDLE)), faults=Faults(lost=0.05)),
    "saturating": _one((0.0, _STIFF), depth_pF=0.45),
    "four-specimens": _four(),
    "sliding": _sliding(),
    "all": _all(),
}
"""The readings follow C1 = r C2 up to the noise, a slow drift and single faults."""

SCENARIOS: dict[str, Scenario] = FOLLOWING | EFFECTS
"""All scenarios: those of `FOLLOWING`, and those of `palpate.simulation.effects`."""


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
