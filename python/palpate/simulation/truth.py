"""True capacitances of the two bumps as functions of time."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from palpate.simulation.bumps import Gauged
from palpate.simulation.press import Press
from palpate.simulation.ranges import stream
from palpate.simulation.scenario import Scenario
from palpate.simulation.tilt import Tilting
from palpate.simulation.tremor import Peaks

# Gauss-Legendre points in units of half a conversion time: exact to 1e-8 for the press and the tremor.
_MANY, _FEW = np.polynomial.legendre.leggauss(4), np.polynomial.legendre.leggauss(2)
_SHORT_S = 0.001


class Truth:
    """True capacitances of the two bumps as functions of time, without converter and noise.

    Parameters
    ----------
    scenario : Scenario
    random : numpy.random.Generator
        For the factors of oblique contact and the tremor of two peaks.
    seed : int, 0 or more
        For all other effects, each of which has its own random numbers.

    Attributes
    ----------
    presses : tuple of Press
        The presses, with the factor of oblique contact in their ratios.
    """

    def __init__(self, scenario: Scenario, random: np.random.Generator, seed: int = 0) -> None:
        self.presses: tuple[Press, ...] = tuple(
            _oblique(press, 1 + scenario.tilt.oblique * random.standard_normal()) for press in scenario.presses
        )
        self._scenario = scenario
        peaks = Peaks().course(random)  # always: the numbers after them stay the same
        own = scenario.spectrum != Peaks()
        self._tremor = scenario.spectrum.course(stream(seed, "tremor")) if own else peaks
        self._nod = scenario.spectrum.course(stream(seed, "angle"))
        self._tilting = Tilting(scenario.tilt, scenario.duration_s, stream(seed, "walk"))
        self._baselines = [
            baseline.course(scenario.contact_s, scenario.duration_s, stream(seed, f"wander {channel}"))
            for channel, baseline in enumerate(scenario.baselines)
        ]
        self._phase = stream(seed, "pickup").uniform(0, 2 * np.pi)
        self._gauged = (
            Gauged(scenario.gauges[0], self._hard_force, scenario.duration_s),
            Gauged(scenario.gauges[1], self._soft_force, scenario.duration_s),
        )

    def ratio(self, press: Press, t: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the true ratio of one press at times t, s: that of level, linear bumps without cross-talk."""
        return press.ratio(t) * self._tilting.factor(press.start_s, t)

    def mean_pF(self, channel: int, middles: NDArray[np.float64], span_s: float) -> NDArray[np.float64]:
        """Return the mean capacitance during each conversion.

        Parameters
        ----------
        channel : int
            0 hard, 1 soft.
        middles : numpy.ndarray, shape (n,)
            Middles of the conversions, s.
        span_s : float
            Duration of a conversion, s.

        Returns
        -------
        numpy.ndarray, shape (n,), pF
        """
        points, weights = _FEW if span_s <= _SHORT_S else _MANY
        change = self._change(channel, middles[:, None] + span_s / 2 * points) @ weights / 2
        mean = self._baselines[channel](middles, span_s) + change
        if self._scenario.faults.pickup_pF:
            mean += self._scenario.faults.pickup(self._phase, middles, span_s)
        return np.asarray(mean)

    def _change(self, channel: int, t: NDArray[np.float64]) -> NDArray[np.float64]:
        change = self._gauged[channel](t)
        if self._scenario.bumps.cross_talk:
            change = change + self._scenario.bumps.cross_talk * self._gauged[1 - channel](t)
        return change

    def _hard_force(self, t: NDArray[np.float64]) -> NDArray[np.float64]:
        return self._force(t, hard=True)

    def _soft_force(self, t: NDArray[np.float64]) -> NDArray[np.float64]:
        return self._force(t, hard=False)

    def _force(self, t: NDArray[np.float64], *, hard: bool) -> NDArray[np.float64]:
        total = np.zeros_like(t)
        shaken = 1 + self._scenario.tremor * self._tremor(t) if self._scenario.tremor else 1.0
        for press in self.presses:
            pressed = press.depth_pF * press.profile(t) * shaken
            ratio = self.ratio(press, t)
            tilted = self._tilted(press, pressed, ratio, t, hard=hard)
            total += self._scenario.bumps.force(tilted, press.depth_pF, ratio, hard=hard)
        return total

    def _tilted(
        self,
        press: Press,
        level: NDArray[np.float64],
        ratio: NDArray[np.float64],
        t: NDArray[np.float64],
        *,
        hard: bool,
    ) -> NDArray[np.float64]:
        substrate, (along, across) = self._scenario.substrate, np.radians(press.tilt_deg)
        if not (substrate.tremor_deg or along or across):
            return level
        angle = substrate.angle_deg(press.tilt_deg[0], t - press.start_s)
        if substrate.tremor_deg:
            angle = angle + substrate.tremor_deg * self._nod(t)
        normal = np.cos(along) * np.cos(across)  # the gauges see the part of the force normal to the substrate
        return substrate.pressed(level * normal, ratio, angle, hard=hard)


def _oblique(press: Press, factor: float) -> Press:
    return replace(press, ratios=tuple((after, ratio * factor) for after, ratio in press.ratios))
