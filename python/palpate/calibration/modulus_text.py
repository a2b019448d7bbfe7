"""Texts of moduli: a number with a unit or a Shore hardness, and its standard uncertainty."""

import re
from dataclasses import dataclass, replace
from math import inf, nan

from palpate.errors import CalibrationError
from palpate.importers.units import to_number
from palpate.materials import KnownModulus
from palpate.messages import quoted

_UNIT = re.compile(r"(?<![a-z])([a-z]?pa|n ?/ ?mm.?2?|psi|ksi|bar)(?![a-z])", re.IGNORECASE)
_POWERS = {"pa": -6, "kpa": -3, "mpa": 0, "gpa": 3}
# "Shore A", "Shore_OO" or "Sh A", also beside a number; "70 A" without the word.
_SCALE = r"(0{2,3}|o{1,3}|a[mo]?|do?|[bce]|m)"
_SHORE = re.compile(rf"(?<![a-z])sh(?:ore)?\.?[\s_-]*{_SCALE}(?![a-z0-9])", re.IGNORECASE)
_HARDNESS = re.compile(r"([\d.,]+)\s*(o{1,3}|a[mo]?|do?|[bce]|m)", re.IGNORECASE)
_PERCENT = re.compile(r"%|percent", re.IGNORECASE)
_NAME_OF_UNCERTAINTY = re.compile(
    r"uncert|unsicher|±|\+/?-|sigma|(?<![a-z])(?:u|std|sd)(?![a-z])", re.IGNORECASE
)
_EXPANDED = re.compile(r"9[59] ?%|u_?9[59]|k ?= ?[23]|expanded", re.IGNORECASE)
_ALLOWED = "% or Pa, kPa, MPa, GPa"


@dataclass(frozen=True)
class ModulusScale:
    """In which unit the numbers of a column are.

    Attributes
    ----------
    power : int
        Power of ten of the unit in MPa.
    is_shore_a : bool
        Whether they are Shore A hardnesses.
    is_percent : bool
        Whether they are percentages of the modulus.
    """

    power: int = 0
    is_shore_a: bool = False
    is_percent: bool = False


def without_unit(text: str, place: str = "") -> tuple[str, int | None]:
    """Return a text without its unit, and the power of ten of the unit in MPa; None: no unit.

    Raises
    ------
    CalibrationError
        Another unit, with the place where it stands before the sentence.

    Examples
    --------
    >>> without_unit("143 kPa"), without_unit("modulus")
    (('143', -3), ('modulus', None))
    """
    unit = _UNIT.search(text)
    if not unit:
        return text, None
    name = unit[1].lower()
    if name not in _POWERS:
        raise CalibrationError(f"{place}got the unit {quoted(name)}, allowed: Pa, kPa, MPa or GPa")
    return _UNIT.sub("", text, 1).strip(), _POWERS[name]


def scale_of(text: str, place: str = "") -> tuple[str, ModulusScale | None]:
    """Return a text without its unit or Shore scale, and which it is; None: it names none.

    Raises
    ------
    CalibrationError
        A unit or a scale from which there is no modulus.

    Examples
    --------
    >>> scale_of("hardness, Shore A")
    ('hardness,', ModulusScale(power=0, is_shore_a=True, is_percent=False))
    >>> scale_of("70 A")[0]
    '70'
    """
    hardness = _HARDNESS.fullmatch(text.strip())
    if hardness:
        _require_shore_a(hardness[2], text, place)
        return hardness[1], ModulusScale(is_shore_a=True)
    shore = _SHORE.search(text)
    if shore and _UNIT.search(text):
        raise CalibrationError(
            f"{place}got {quoted(text)}, which names a unit and a Shore scale, allowed: one of them"
        )
    if shore:
        _require_shore_a(shore[1], text, place)
        return _SHORE.sub("", text, 1).strip(), ModulusScale(is_shore_a=True)
    bare, power = without_unit(text, place)
    if power is None:
        return bare, None
    return bare, ModulusScale(power)


def _require_shore_a(scale: str, text: str, place: str) -> None:
    """Refuse another Shore scale than A."""
    if scale.upper() != "A":
        name = scale.upper().replace("0", "O")
        raise CalibrationError(
            f"{place}got {quoted(text)}, allowed: a modulus, or Shore A: no relation between Shore "
            f"{name} and the modulus is known here. Measure the modulus of the specimen, by "
            "compression or indentation, or take it from a data sheet"
        )


def number_in(text: str) -> float:
    """Return the number in a text; nan: there is none."""
    try:
        return to_number(text)
    except ValueError:
        return nan


def modulus_in(text: str, scale: ModulusScale, place: str = "") -> KnownModulus | None:
    """Return the modulus in a text without a unit; None: no positive number.

    Raises
    ------
    CalibrationError
        A hardness out of range.
    """
    value = number_in(text)
    if not 0 < value < inf:
        return None
    if not scale.is_shore_a:
        modulus = value * 10.0**scale.power
        return KnownModulus(modulus) if 0 < modulus < inf else None
    try:
        return KnownModulus.of_shore_a(value)
    except ValueError as error:
        raise CalibrationError(
            f"{place}{error}; measure the modulus of the specimen, or its hardness on this scale"
        ) from error


def known_modulus(text: str, uncertainty: str = "") -> KnownModulus:
    """Return the modulus in a text with its unit, or of a Shore A hardness.

    Parameters
    ----------
    text : str
    uncertainty : str
        Its standard uncertainty (k = 1), with % or a unit; "": not stated.

    Raises
    ------
    CalibrationError
        No positive number, no unit, or another one.

    Examples
    --------
    >>> print(known_modulus("143 kPa", "5 %"))
    0.143 MPa +-5 %
    >>> known_modulus("1.1")
    Traceback (most recent call last):
    palpate.errors.CalibrationError: got '1.1', allowed: a positive number with Pa, kPa, MPa or GPa, \
or a Shore A hardness, as '1.1 MPa' or '50 A'
    """
    bare, scale = scale_of(text)
    known = modulus_in(bare, scale) if scale else None
    if known is None:
        raise CalibrationError(
            f"got {quoted(text)}, allowed: a positive number with Pa, kPa, MPa or GPa, or a Shore A "
            "hardness, as '1.1 MPa' or '50 A'"
        )
    if not uncertainty:
        return known
    return with_uncertainty(known, uncertainty, None)


def uncertainty_column(header: str, place: str = "") -> ModulusScale | None:
    """Return the unit of a column of standard uncertainties; None: it is another column.

    Raises
    ------
    CalibrationError
        An uncertainty without a unit, or an expanded one.

    Examples
    --------
    >>> uncertainty_column("u(E), %")
    ModulusScale(power=0, is_shore_a=False, is_percent=True)
    >>> uncertainty_column("supplier") is None
    True
    """
    if not _NAME_OF_UNCERTAINTY.search(header):
        return None
    if _EXPANDED.search(header):
        raise CalibrationError(
            f"{place}got {quoted(header)}, allowed: standard uncertainties (k = 1): half of an "
            "expanded one (k = 2) or of the half width of a 95 % interval"
        )
    if _PERCENT.search(header):
        return ModulusScale(is_percent=True)
    _, scale = scale_of(header, place)
    if scale is None:
        raise CalibrationError(
            f"{place}got {quoted(header)} without a unit, allowed: {_ALLOWED}: for example "
            "'uncertainty, %'"
        )
    return scale


def has_uncertainty(text: str) -> bool:
    """Return whether a text is a number with a unit or a percent sign."""
    if _PERCENT.search(text):
        return number_in(_PERCENT.sub("", text).strip("± ")) >= 0
    bare, scale = scale_of(text)
    return scale is not None and number_in(bare.strip("± ")) >= 0


def with_uncertainty(
    known: KnownModulus, text: str, column: ModulusScale | None, place: str = ""
) -> KnownModulus:
    """Return a modulus with the standard uncertainty in a text, which replaces the one it has.

    Raises
    ------
    CalibrationError
        No number, no unit, or not from 0 to below 100 %.

    Examples
    --------
    >>> print(with_uncertainty(KnownModulus(2.0), "0.1 MPa", None))
    2 MPa +-5 %
    """
    scale = column
    bare = text.strip("± ")
    if _PERCENT.search(bare):
        scale = ModulusScale(is_percent=True)
        bare = _PERCENT.sub("", bare).strip()
    else:
        bare, own = scale_of(bare, place)
        scale = own or scale
    value = number_in(bare)
    if scale is None or not 0 <= value < inf:
        raise CalibrationError(
            f"{place}got {quoted(text)} as a standard uncertainty, allowed: a number, 0 or more, "
            f"with {_ALLOWED}"
        )
    if scale.is_shore_a:
        return _with_points(known, value, text, place)
    relative = value / 100 if scale.is_percent else value * 10.0**scale.power / known.modulus
    if not relative < 1:
        raise CalibrationError(
            f"{place}got {quoted(text)} as the standard uncertainty of {known.modulus:g} MPa, "
            "allowed: below 100 % of it"
        )
    return replace(known, uncertainty=relative, common=0.0)


def _with_points(known: KnownModulus, points: float, text: str, place: str) -> KnownModulus:
    """Return a modulus from Shore A with the uncertainty of its hardness in points."""
    if known.hardness is None:
        raise CalibrationError(
            f"{place}got {quoted(text)} as the uncertainty of a modulus, allowed: {_ALLOWED}; "
            "points of Shore A only for a hardness"
        )
    return KnownModulus.of_shore_a(known.hardness, points)


def percent_in(text: str) -> float:
    """Return the relative uncertainty in a text with a percent sign.

    Raises
    ------
    ValueError
        No percent sign, no number, or not from 0 to below 100 %.

    Examples
    --------
    >>> percent_in("5 %")
    0.05
    >>> percent_in("0.05")
    Traceback (most recent call last):
    ValueError: got '0.05', allowed: a standard uncertainty in per cent of the modulus, 0 to below 100, with its sign: 5%
    """
    value = nan
    if text.rstrip().endswith("%"):
        value = number_in(text.strip().removesuffix("%").strip())
    if not 0 <= value < 100:
        raise ValueError(
            f"got {quoted(text)}, allowed: a standard uncertainty in per cent of the modulus, 0 to "
            "below 100, with its sign: 5%"
        )
    return value / 100
