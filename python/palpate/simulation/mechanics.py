"""From forces to capacitance: the substrate under both bumps, the bumps, their gauges."""

from dataclasses import dataclass
from math import inf

import numpy as np

from palpate.elasticity import Elasticity
from palpate.simulation.signals import Array, Course, follow, require_positive, require_within

_Values = Array | float
_SOFTEST = 1e-6  # least stiffness of an object, relative to the soft bump; at r = 1 it would be 0
_STEPS = 12  # of Newton's method: the forces add up to 1e-9 pF


@dataclass(frozen=True)
class Substrate:
    """Places of the bumps, and how a tilt shares the force between them.

    The truth is the ratio of level bumps.

    A substrate tilted by an angle a puts the hard bump deeper than the soft one by g = spacing tan
    a. With the depth d between the bumps, F_1 = r K (d + g/2)^s and F_2 = K (d - g/2)^s, each 0
    before its bump is reached; K is the stiffness of soft bump and object in series, eq. (1): K =
    k_s (1 - 1/r) / (1 - 1/rigid_ratio). The hand sets the force F = F_1 + F_2, not d. For s = 1,
    with both bumps in contact, F_1 = r F_2 + r K g: an offset.

    In the layout "soft-hard-soft" the soft bump is split: half of it on each side of the hard bump,
    on one line, at the same distance, both wired to the soft channel. With d the depth of the hard
    bump, F_2 = K ((d + g)^s + (d - g)^s) / 2: for s = 1 with both halves in contact g cancels, for
    s = 1.5 F_2 is larger by 3/8 (g/d)^2 of it.

    Attributes
    ----------
    spacing_mm : float, mm
        Distance between the middles of the hard bump and of the soft bump, or of each half of it.
    soft_pF_per_mm : float, pF/mm
        Stiffness k_s of the soft bump, as the capacitance of a linear gauge; of a press 1 mm deep.
    rigid_ratio : float, above 1
        k_h / k_s.
    exponent : float, 1 or more
        s: 1 for bumps with a flat end, 1.5 for domes (Hertz).
    tremor_deg : float, degrees
        Tremor of the angle, rms, with the spectrum of the scenario, independent of the tremor of
        the force.
    settles, settle_s : float, s
        At contact the tilt is 1 + settles times the held tilt, which it approaches with this time
        constant.
    layout : str
        "hard-soft" or "soft-hard-soft".
    misplaced : float, in [-1, 1]
        Place of the hard bump on the line, in spacings from the middle between the halves; above 0
        a tilt above 0 puts it deeper. With layout "hard-soft" 0.
    unequal : float, in [-1, 1]
        The halves have the stiffness (1 - unequal) K / 2 and (1 + unequal) K / 2; a tilt above 0
        puts the second one deeper. With layout "hard-soft" 0.

    Raises
    ------
    ValueError
        A value is outside its range.

    Notes
    -----
    The default values are choices of this simulator: bumps 3 mm apart, and a press of 1 pF in both
    channels together that is 0.3 mm deep on a rigid object. The paper gives neither.

    Examples
    --------
    >>> level = np.array([0.0, 0.1, 0.2])
    >>> Substrate().pressed(level, 5.0, 0.5, hard=False).round(4)
    array([0.    , 0.0942, 0.1942])
    >>> Substrate(layout="soft-hard-soft").pressed(level, 5.0, 0.5, hard=False).round(4)
    array([0. , 0.1, 0.2])
    """

    spacing_mm: float = 3.0
    soft_pF_per_mm: float = 0.3
    rigid_ratio: float = Elasticity().rigid_ratio
    exponent: float = 1.0
    tremor_deg: float = 0.0
    settles: float = 0.0
    settle_s: float = 0.3
    layout: str = "hard-soft"
    misplaced: float = 0.0
    unequal: float = 0.0

    def __post_init__(self) -> None:
        """Check the ranges."""
        require_positive(
            spacing_mm=self.spacing_mm, soft_pF_per_mm=self.soft_pF_per_mm, settle_s=self.settle_s
        )
        require_within(0, inf, tremor_deg=self.tremor_deg, settles=self.settles)
        require_within(1, 3, exponent=self.exponent)
        if not self.rigid_ratio > 1:
            raise ValueError(f"rigid_ratio: got {self.rigid_ratio}, allowed: above 1")
        if self.layout not in ("hard-soft", "soft-hard-soft"):
            raise ValueError(f'layout: got "{self.layout}", allowed: "hard-soft", "soft-hard-soft"')
        most = int(self.layout == "soft-hard-soft")
        require_within(-most, most, misplaced=self.misplaced, unequal=self.unequal)

    def angle_deg(self, held_deg: float, since_s: Array) -> Array:
        """Return the tilt at times since the contact, s, without tremor; degrees."""
        since_s = np.maximum(since_s, 0)
        rest = np.exp(-since_s / self.settle_s)
        return held_deg * (1 + self.settles * rest)

    def pressed(self, level: Array, ratio: _Values, angle_deg: _Values, *, hard: bool) -> Array:
        """Return the force of the soft bump, or the force of the hard bump divided by the ratio.

        Parameters
        ----------
        level : numpy.ndarray, pF
            The same without a tilt.
        ratio : numpy.ndarray or float
            Ratio of level bumps.
        angle_deg : numpy.ndarray or float, degrees
            Tilt in the plane through the bumps; above 0 the hard bump of the layout "hard-soft" is
            deeper.
        hard : bool
            Which bump.

        Returns
        -------
        numpy.ndarray, pF
        """
        softness = np.maximum(1 - 1 / ratio, _SOFTEST)
        stiffness = self.soft_pF_per_mm * softness / (1 - 1 / self.rigid_ratio)
        slope = self.spacing_mm * np.tan(np.radians(angle_deg))
        if self.exponent == 1 and self.layout == "hard-soft":
            shift = stiffness * slope / (1 + ratio)
            whole = level * (1 + ratio)
            if hard:
                return np.clip(level + shift, 0, whole / ratio)
            return np.clip(level - ratio * shift, 0, whole)
        hard_bump, *soft_bumps = self._places()
        bumps = [hard_bump] if hard else soft_bumps
        depth = self._depth_mm(level / stiffness, ratio, slope)
        force: _Values = 0.0
        for place, share in bumps:
            own = np.maximum(depth + place * slope, 0)
            force = force + share * own**self.exponent
        return stiffness * force

    def _places(self) -> list[tuple[float, float]]:
        """Return place, in spacings, and share of the stiffness, of each bump, hard first."""
        if self.layout == "hard-soft":
            return [(0.5, 1.0), (-0.5, 1.0)]
        return [
            (self.misplaced, 1.0),
            (-1.0, (1 - self.unequal) / 2),
            (1.0, (1 + self.unequal) / 2),
        ]

    def _depth_mm(self, reduced: Array, ratio: _Values, slope: _Values) -> Array:
        """Return the depth of the press, mm: the force of all bumps is (1 + ratio) reduced."""
        # Newton's method for r (d + x_1 slope)_+^s + sum w_i (d + x_i slope)_+^s = (1 + r) reduced.
        # The left side is convex and rises with d, and it is too large at the first value: the
        # steps go down to the root.
        s = self.exponent
        (hard_at, _), *soft = self._places()
        bumps = [(hard_at, ratio), *soft]
        farthest = max(abs(place) for place, _ in bumps)
        depth = reduced ** (1 / s) + farthest * np.abs(slope)
        for _ in range(_STEPS):
            force: _Values = 0.0
            rise: _Values = 0.0
            for place, weight in bumps:
                own = np.maximum(depth + place * slope, 0)
                in_contact = own > 0
                force = force + weight * own**s
                rise = rise + weight * in_contact * own ** (s - 1)
            excess = force - (1 + ratio) * reduced
            steepness = np.maximum(s * rise, 1e-12)
            depth = depth - excess / steepness
        return depth


# Grids of lag and creep. A lag keeps the tremor: a line between two points loses a share of
# (2 pi 12 Hz step)^2 / 12 = 5e-4 of it at 12 Hz. Creep is slow.
_LAG_STEP_S = 0.001
_CREEP_STEP_S = 0.005


@dataclass(frozen=True)
class Bumps:
    """Contact of the two bumps with the object. The truth: level bumps without cross-talk.

    Attributes
    ----------
    offset : float
        One bump is reached first: by this share of the depth, the soft bump if above 0, the hard
        bump if below. With c0 = offset * depth_pF: C1 = r (C2 - c0).
    bottoms_pF : (float, float), pF
        Largest force of the hard and the soft bump, which bottoms out there, as a capacitance of a
        linear gauge.
    cross_talk : float
        Share of the capacitance change of each channel that is added to the other.

    Raises
    ------
    ValueError
        A value is outside its range.

    Examples
    --------
    >>> Bumps(offset=0.02).force(np.array([0.0, 0.005, 0.25]), 0.25, 3.0, hard=True).round(3)
    array([0.   , 0.   , 0.735])
    """

    offset: float = 0.0
    bottoms_pF: tuple[float, float] = (inf, inf)
    cross_talk: float = 0.0

    def __post_init__(self) -> None:
        """Check the ranges."""
        require_within(-1, 1, offset=self.offset)
        require_within(0, inf, bottoms_pF=self.bottoms_pF)
        require_within(0, 1, cross_talk=self.cross_talk)

    def force(self, press: Array, depth_pF: float, ratio: Array | float, *, hard: bool) -> Array:
        """Return the force of one bump.

        Parameters
        ----------
        press : numpy.ndarray, pF
            Force of the soft bump if it is reached first or the bumps are level.
        depth_pF : float, pF
            Its value during the hold.
        ratio : numpy.ndarray or float
            Ratio of level bumps.
        hard : bool
            Which bump.

        Returns
        -------
        numpy.ndarray, pF
        """
        limit, soft_limit = self.bottoms_pF
        offset = self.offset
        if not hard:
            limit = soft_limit
            offset = -offset
        force = press
        if offset > 0:
            gap = offset * depth_pF
            force = np.maximum(press - gap, 0)
        if hard:
            force = force * ratio
        return np.minimum(force, limit)


@dataclass(frozen=True)
class Gauge:
    """How the capacitance of one bump follows its force f, here in pF of a linear gauge.

    c = f (f / reference)^(exponent - 1) (1 + quadratic f) / (1 + quadratic reference): at the
    reference force, where the gauge was calibrated, c = f. The truth is the ratio of the forces.

    Attributes
    ----------
    exponent : float, above 0
        Other than 1 only with a reference force.
    quadratic_per_pF : float, 1/pF
    reference_pF : float, pF
        Force of the calibration; 0: the limit of small forces.
    creep, creep_s : float
        Standard linear solid: after a step of the force the bump continues by this share of it,
        with this time constant, s.
    lag_s : float, s
        First-order lag of the bump behind its force.

    Raises
    ------
    ValueError
        A value is outside its range.

    Examples
    --------
    >>> Gauge(exponent=0.9, reference_pF=0.5).curve(np.array([0.25, 0.5])).round(3)
    array([0.268, 0.5  ])
    """

    exponent: float = 1.0
    quadratic_per_pF: float = 0.0
    reference_pF: float = 0.0
    creep: float = 0.0
    creep_s: float = 5.0
    lag_s: float = 0.0

    def __post_init__(self) -> None:
        """Check the ranges."""
        require_positive(exponent=self.exponent, creep_s=self.creep_s)
        require_within(0, inf, reference_pF=self.reference_pF, lag_s=self.lag_s)
        if self.exponent != 1 and not self.reference_pF:
            got = f"got 0 with exponent {self.exponent}"
            raise ValueError(f"reference_pF: {got}, allowed: above 0, or exponent 1")

    def curve(self, force: Array) -> Array:
        """Return the capacitance change, pF, at constant forces, pF."""
        at_reference = 1 + self.quadratic_per_pF * self.reference_pF
        change = force * (1 + self.quadratic_per_pF * force) / at_reference
        if self.exponent != 1:
            # 0^(p - 1) is infinite for p below 1; the smallest normal number keeps 0 * x^(p - 1) at
            # 0.
            share = np.maximum(force / self.reference_pF, np.finfo(float).tiny)
            change *= share ** (self.exponent - 1)
        return change


def gauged(gauge: Gauge, force: Course, duration_s: float) -> Course:
    """Return the capacitance change of one bump, pF, as a function of time, s."""
    if not (gauge.creep or gauge.lag_s):
        return lambda t: gauge.curve(force(t))
    step_s = min(_CREEP_STEP_S, gauge.creep_s / 10)
    if gauge.lag_s:
        step_s = _LAG_STEP_S
    count = int(duration_s / step_s) + 2
    times = step_s * np.arange(float(count))
    lagged = force(times)
    if gauge.lag_s:
        lagged = follow(lagged, step_s, gauge.lag_s)
    crept = gauge.creep * follow(lagged, step_s, gauge.creep_s)

    def change(t: Array) -> Array:
        moved = np.interp(t, times, lagged) if gauge.lag_s else force(t)
        creep = np.interp(t, times, crept)
        return gauge.curve(moved + creep)

    return change
