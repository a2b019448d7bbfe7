"""Young's modulus of rubber from its Shore A hardness, and known moduli with their uncertainty."""

from dataclasses import dataclass
from math import hypot, nan, sqrt
from statistics import NormalDist

RELATIONS = ("gent", "ruess", "error_function")
"""Published relations; see `modulus_of_shore_a`."""
BUMPS_SHORE_A = (40.0, 6.0)
"""Shore A hardness of the hard and the soft bump of the paper (Sec. II).

They are of urethane rubber, PMC-724 of Smooth-On.
"""
SPECIMENS_SHORE_A = (20.0, 90.0)
"""Hardnesses from which a modulus of a specimen is computed.

Outside of them ISO 48-4 takes the scales AO and D.
"""
DUROMETER_POINTS = 2.0
"""Standard uncertainty of a Shore A hardness, in points, where none is stated.

A durometer (ISO 48-4, ASTM D2240) is read in whole points, and its spring may be off by one;
laboratories are assumed to differ by two. The hardness that a manufacturer names often has a
tolerance of five points: that is an uncertainty of three.
"""
RELATION_UNCERTAINTY = 0.2
"""Relative standard uncertainty of a modulus by Gent's relation.

On the specimens of the paper (Table I, 30 A to 70 A) the relation differs by 4 to 45 % from a
rheometer, by 25 % rms. How much of its error specimens share, is not known: half of its square.
"""


def modulus_of_shore_a(hardness: float, relation: str = "gent") -> float:
    """Return Young's modulus of a rubber with this Shore A hardness, MPa.

    Parameters
    ----------
    hardness : float, 1 to 95
        Shore A hardness.
    relation : str
        "gent": E = 0.0981 (56 + 7.62336 S) / (0.137505 (254 - 2.54 S)), a rigid punch that the
        spring of the durometer presses into a half-space (A. N. Gent, Rubber Chem. Technol. 31,
        896, 1958). Below 40 it departs from measurements. The quotient of the moduli at two
        hardnesses does not depend on the radius of the punch: the spring presses with
        0.55 N + 0.075 N S, and the depth is 2.5 mm (1 - S / 100) (ASTM D2240).
        "ruess": log10 E = 0.0235 S - 0.6403, a line fitted to measurements (Ruess; in K. Larson,
        "Can you estimate modulus from durometer hardness for silicones?", Dow).
        "error_function": S = 100 erf(3.186e-4 sqrt(E / Pa)) (BS 903). It gives E = 0 at S = 0,
        where the spring of a durometer presses with 0.55 N: it is not for the soft end of the
        scale.

    Returns
    -------
    float
        Modulus, MPa.

    Raises
    ------
    ValueError
        `hardness` is outside its range, or an unknown relation.

    Examples
    --------
    >>> hard, soft = (modulus_of_shore_a(hardness) for hardness in BUMPS_SHORE_A)
    >>> round(hard, 2), round(soft, 2), round(hard / soft, 1)
    (1.69, 0.3, 5.6)
    """
    if not 1 <= hardness <= 95:
        raise ValueError(f"hardness: got {hardness}, allowed: 1 to 95, Shore A")
    if relation not in RELATIONS:
        raise ValueError(f"relation: got {relation!r}, allowed: {', '.join(RELATIONS)}")
    if relation == "gent":
        return 0.0981 * (56 + 7.62336 * hardness) / (0.137505 * (254 - 2.54 * hardness))
    if relation == "ruess":
        return float(10 ** (0.0235 * hardness - 0.6403))
    quantile = NormalDist().inv_cdf((1 + hardness / 100) / 2)
    inverse = quantile / sqrt(2)  # erf(z) = 2 Phi(sqrt(2) z) - 1
    return (inverse / 3.186e-4) ** 2 / 1e6


def shore_a_of_modulus(modulus: float) -> float:
    """Return the Shore A hardness of a rubber with this modulus, by Gent's relation.

    This is the inverse of `modulus_of_shore_a`.

    Parameters
    ----------
    modulus : float, MPa

    Returns
    -------
    float
        1 to 95; nan if the hardness is outside this range.

    Examples
    --------
    >>> round(shore_a_of_modulus(1.54), 1), shore_a_of_modulus(100.0)
    (37.6, nan)
    """
    numerator = 254 * 0.137505 * modulus - 56 * 0.0981
    denominator = 7.62336 * 0.0981 + 2.54 * 0.137505 * modulus
    hardness = numerator / denominator
    return hardness if 1 <= hardness <= 95 else nan


@dataclass(frozen=True)
class KnownModulus:
    """The modulus of a specimen, with its standard uncertainty (k = 1).

    Attributes
    ----------
    modulus : float, MPa
    uncertainty : float or None
        Relative standard uncertainty, independent of other specimens; None: not stated.
    common : float
        The same of an error that all such specimens share.
    hardness : float or None
        The Shore A hardness from which Gent's relation gave it; None: it was stated.

    Examples
    --------
    >>> print(KnownModulus(1.1), KnownModulus(1.1, 0.05), sep="; ")
    1.1 MPa; 1.1 MPa +-5 %
    """

    modulus: float
    uncertainty: float | None = None
    common: float = 0.0
    hardness: float | None = None

    @property
    def own(self) -> float:
        """The independent uncertainty; 0 if none is stated."""
        return self.uncertainty or 0.0

    @property
    def whole(self) -> float:
        """The whole uncertainty."""
        return hypot(self.own, self.common)

    def __str__(self) -> str:
        """Return the modulus, and its uncertainty if it has one."""
        if self.hardness is not None:
            return f"{self.modulus:.3g} MPa +-{100 * self.whole:.2g} %"
        if self.whole:
            return f"{self.modulus:g} MPa +-{100 * self.whole:.2g} %"
        return f"{self.modulus:g} MPa"

    @classmethod
    def of_shore_a(cls, hardness: float, points: float = DUROMETER_POINTS) -> "KnownModulus":
        """Return the modulus of a specimen from its Shore A hardness, by Gent's relation.

        Parameters
        ----------
        hardness : float, 20 to 90
        points : float
            Standard uncertainty of the hardness.

        Raises
        ------
        ValueError
            The hardness is outside its range.

        Examples
        --------
        >>> found = KnownModulus.of_shore_a(50.0)
        >>> print(found)
        2.46 MPa +-21 %
        """
        low, high = SPECIMENS_SHORE_A
        if not low <= hardness <= high:
            raise ValueError(f"hardness: got {hardness:g}, allowed: {low:g} to {high:g}, Shore A")
        # d log E / dS of Gent's relation
        by_point = 7.62336 / (56 + 7.62336 * hardness) + 2.54 / (254 - 2.54 * hardness)
        part = RELATION_UNCERTAINTY / sqrt(2)
        return cls(
            modulus_of_shore_a(hardness),
            hypot(by_point * points, part),
            part,
            hardness,
        )
