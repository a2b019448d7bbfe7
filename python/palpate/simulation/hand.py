"""Simulation of a hand that touches an object several times, each time differently."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.random import Generator

from palpate.elasticity import SORBOTHANE_MPA, Elasticity
from palpate.simulation.mechanics import Gauge, Substrate
from palpate.simulation.press import Press
from palpate.simulation.probe import Scenario, Simulation, simulate
from palpate.simulation.scenarios import PROBE, TWO_ROUNDS
from palpate.uncertainty import TOUCH_SCATTER

FIRST_S = 1.5  # start of the first touch
EVERY_S = 8.9  # from the start of a touch to the start of the next one
LAST_S = 0.6  # idle time after the last touch
SLIP_S = 3.2  # time of a slip after the start of a touch: half-way


@dataclass(frozen=True)
class Hand:
    """Statistics of the touches of one hand.

    Attributes
    ----------
    press_pF : float
        Median of the change of the hard plus the soft channel (a hand controls the force, not the
        depth).
    press_spread : float
        Standard deviation of the logarithm of the press; a press is limited to 1/20 to 2.2 times
        the median.
    oblique : float
        Standard deviation of a random factor on the ratio, one for each touch: scatter that nothing
        else shows.
    firm : float
        Exponent: a firm press has less oblique scatter, oblique * (press / press_pF) ** -firm.
    slips : float
        Fraction of the touches in which the probe slips half-way; from then on it has another
        oblique factor.
    tremor : float
        As in `palpate.simulation.Scenario`.
    nonlinearity : float, 1/pF
        `quadratic_per_pF` of both gauges, with a calibration in the limit of small forces. Of two
        plates at rest with C_0 it is 1 / C_0.
    tilt_deg : float, degrees
        Standard deviation of the tilt, in the plane through both bumps and at right angles to it:
        oblique contact.
    shallow : float
        A touch that is held more obliquely is less deep: its press is divided by exp(shallow angle
        / tilt_deg).
    substrate : Substrate
        Distance of the bumps, tremor of the angle.
    """

    press_pF: float = 1.0
    press_spread: float = 0.35
    oblique: float = TOUCH_SCATTER
    firm: float = 0.0
    slips: float = 0.0
    tremor: float = 0.02
    nonlinearity: float = 0.005
    tilt_deg: float = 0.0
    shallow: float = 0.0
    substrate: Substrate = field(default_factory=Substrate)

    def touches(self, ratio: float, count: int, random: Generator) -> Scenario:
        """Return a scenario of `count` random touches on an object with this ratio."""
        firmness = np.exp(self.press_spread * random.standard_normal(count))
        share = np.clip(firmness, 0.05, 2.2)
        angles = np.zeros((count, 2))
        if self.tilt_deg:
            angles = random.standard_normal((count, 2))
        obliqueness = np.hypot(*angles.T)
        share = share * np.exp(-self.shallow * obliqueness)
        scatter = self.oblique * share**-self.firm
        factors = 1 + scatter * random.standard_normal((2, count))
        factors = np.maximum(factors, 0.1)
        slips = random.random(count) < self.slips
        presses = []
        for i in range(count):
            before = ratio * factors[0, i]
            after = ratio * factors[int(slips[i]), i]
            along, across = (self.tilt_deg * angles[i]).tolist()
            depth_pF = self.press_pF * share[i] / (1 + ratio)
            press = Press(
                FIRST_S + EVERY_S * i,
                [(0.0, before), (SLIP_S, after)],
                depth_pF=float(depth_pF),
                tilt_deg=(along, across),
            )
            presses.append(press)
        last_s = presses[-1].stop_s - presses[-1].start_s
        gauge = Gauge(quadratic_per_pF=self.nonlinearity)
        return Scenario(
            presses=presses,
            duration_s=FIRST_S + EVERY_S * (count - 1) + last_s + LAST_S,
            tremor=self.tremor,
            substrate=self.substrate,
            gauges=(gauge, gauge),
        )


def session(
    seed: int = 0,
    *,
    hand: Hand | None = None,
    moduli: Mapping[str, float] = SORBOTHANE_MPA,
    touches: int = 4,
    probe: Elasticity = PROBE,
    progress: Callable[[int, int], None] | None = None,
) -> dict[str, Simulation]:
    """Simulate several touches on each of several objects.

    Parameters
    ----------
    seed : int
        The same seed gives the same recordings.
    hand : Hand, optional
        Default: `Hand()`.
    moduli : mapping of str to float, MPa
        Name -> modulus of each object. Default: Table I of the paper.
    touches : int
        Number of touches on each object, 1 or more.
    probe : Elasticity
        The true parameters of the probe.
    progress : function, optional
        Called with the number of finished objects, and the number of all objects.

    Returns
    -------
    dict of str to Simulation
        Name -> recording, in the order of `moduli`.

    Raises
    ------
    ValueError
        `touches` is below 1, or a modulus is negative.

    Examples
    --------
    >>> recordings = session(seed=1, moduli={"gel": 1.1}, touches=2)
    >>> len(recordings["gel"].presses)
    2
    """
    if touches < 1:
        raise ValueError(f"touches: got {touches}, allowed: 1 or more")
    hand = hand or Hand()
    recordings = {}
    for number, (name, modulus) in enumerate(moduli.items()):
        if progress:
            progress(number, len(moduli))
        random = np.random.default_rng([seed, number])
        scenario = hand.touches(probe.ratio(modulus), touches, random)
        recordings[name] = simulate(scenario, seed=int(random.integers(2**63)))
    return recordings


TOUCHES = 4  # of each specimen
# Time before the first touch: to measure the baseline on a busy computer too, and to enter the
# specimens.
FREE_S = 8.0


def ten_specimens() -> Scenario:
    """Return four touches on each specimen of Table I of the paper, in order: 6.1 minutes."""
    random = np.random.default_rng(0)
    hand = Hand()
    presses: list[Press] = []
    for number, (name, modulus) in enumerate(SORBOTHANE_MPA.items()):
        part = hand.touches(PROBE.ratio(modulus), TOUCHES, random)
        earlier_s = TOUCHES * EVERY_S * number
        for press in part.presses:
            start_s = press.start_s + FREE_S + earlier_s
            presses.append(replace(press, start_s=start_s, name=name))
    duration_s = FREE_S + part.duration_s + TOUCHES * EVERY_S * (len(SORBOTHANE_MPA) - 1)
    return replace(part, presses=presses, duration_s=duration_s)


# In addition to `palpate.simulation.SCENARIOS`: to rehearse a whole session, not to compare
# estimators.
SESSIONS: dict[str, Scenario] = {"ten-specimens": ten_specimens(), "two-rounds": TWO_ROUNDS}
