"""How a hand touches an object several times: no two presses are alike. Simulated, with known truth."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from palpate.elasticity import SORBOTHANE_MPA, Elasticity
from palpate.simulation.probe import Press, Scenario, Simulation, simulate
from palpate.simulation.scenarios import PROBE

FIRST_S, EVERY_S, LAST_S = 1.5, 8.9, 0.6  # the first touch starts; one after the other; idle after the last
SLIP_S = 3.2  # after the start of a touch: half-way


@dataclass(frozen=True)
class Hand:
    """What differs from touch to touch.

    Attributes
    ----------
    press_pF : float
        Median of the press: change of the hard and the soft channel together, as a hand governs the force.
    press_spread : float
        Standard deviation of its logarithm; a press is between 1/20 and 2.2 times the median.
    oblique : float
        Standard deviation of a factor on the ratio, new for each touch: oblique contact.
    firm : float
        Exponent with which the oblique scatter falls for a firm press: scatter times (press / press_pF) ** -firm.
    slips : float
        Share of the touches in which the probe slips half-way: another oblique factor from then on.
    tremor, nonlinearity : float
        As in `palpate.simulation.probe.Scenario`.
    """

    press_pF: float = 1.0
    press_spread: float = 0.35
    oblique: float = 0.03
    firm: float = 0.0
    slips: float = 0.0
    tremor: float = 0.02
    nonlinearity: float = 0.005

    def touches(self, ratio: float, count: int, random: np.random.Generator) -> Scenario:
        """Return the scenario of several touches on an object with this ratio."""
        share = np.clip(np.exp(self.press_spread * random.standard_normal(count)), 0.05, 2.2)
        scatter = self.oblique * share**-self.firm
        factors = np.maximum(1 + scatter * random.standard_normal((2, count)), 0.1)
        slips = random.random(count) < self.slips
        presses = [
            Press(
                FIRST_S + EVERY_S * i,
                [(0.0, ratio * factors[0, i]), (SLIP_S, ratio * factors[int(slips[i]), i])],
                depth_pF=float(self.press_pF * share[i] / (1 + ratio)),
            )
            for i in range(count)
        ]
        duration = FIRST_S + EVERY_S * (count - 1) + (presses[-1].stop_s - presses[-1].start_s) + LAST_S
        return Scenario(presses=presses, duration_s=duration, tremor=self.tremor, nonlinearity=self.nonlinearity)


def session(
    seed: int = 0,
    *,
    hand: Hand | None = None,
    moduli: Mapping[str, float] = SORBOTHANE_MPA,
    touches: int = 4,
    probe: Elasticity = PROBE,
) -> dict[str, Simulation]:
    """Simulate a session: several touches on each of some objects.

    Parameters
    ----------
    seed : int
        The same seed gives the same recordings.
    hand : Hand, optional
        `Hand()` by default.
    moduli : mapping of str to float, MPa
        The objects; Table I of the paper by default.
    touches : int
        On each object.
    probe : Elasticity
        Its true parameters.

    Returns
    -------
    dict of str to Simulation
        A recording for each object, in the order given.

    Examples
    --------
    >>> recordings = session(seed=1, moduli={"gel": 1.1}, touches=2)
    >>> len(recordings["gel"].presses)
    2
    """
    if touches < 1:
        raise ValueError(f"touches: got {touches}, allowed: 1 or more")
    made = {}
    for number, (name, modulus) in enumerate(moduli.items()):
        random = np.random.default_rng([seed, number])
        scenario = (hand or Hand()).touches(probe.ratio(modulus), touches, random)
        made[name] = simulate(scenario, seed=int(random.integers(2**63)))
    return made
