"""The session of a recording: specimens, which touch is on which, touches left out, notes."""

from bisect import bisect_left
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, asdict, dataclass, fields
from typing import TYPE_CHECKING, Any, TypeGuard, cast
from unicodedata import category

from palpate.files import Json
from palpate.materials import KnownModulus
from palpate.messages import quoted

if TYPE_CHECKING:
    from palpate.touch import Touch

LONGEST_NAME = 200
"""Characters of a name, a title and a reason, at most."""
LONGEST_NOTE = 2000
"""Characters of a note, at most."""
MOST_TOUCHES = 10_000
MOST_WANTED = 99
PERIOD_S = 0.026
"""From pair to pair, s, of an AD7746 with conversions of 11 ms; for touches without a recording."""


@dataclass(frozen=True)
class Specimen:
    """An object that is touched.

    Attributes
    ----------
    name : str
        1 to 200 characters.
    modulus_MPa : float or None
        Its known modulus; None: unknown.
    wanted : int
        How many touches of it are wanted, 1 to 99.
    modulus_uncertainty : float or None
        Relative standard uncertainty of the modulus, 0 to below 1; None: not stated.
    """

    name: str
    modulus_MPa: float | None = None
    wanted: int = 1
    modulus_uncertainty: float | None = None

    def __post_init__(self) -> None:
        """Check the fields."""
        _require_text("name", self.name, LONGEST_NAME, least=1)
        if self.modulus_MPa is not None and not (
            _is_number(self.modulus_MPa) and self.modulus_MPa > 0
        ):
            raise ValueError(
                f"modulus_MPa: got {quoted(self.modulus_MPa)}, allowed: a number above 0, or null"
            )
        if type(self.wanted) is not int or not 1 <= self.wanted <= MOST_WANTED:
            raise ValueError(
                f"wanted: got {quoted(self.wanted)}, allowed: an integer from 1 to {MOST_WANTED}"
            )
        uncertainty = self.modulus_uncertainty
        if uncertainty is not None and not (_is_number(uncertainty) and 0 <= uncertainty < 1):
            raise ValueError(
                f"modulus_uncertainty: got {quoted(uncertainty)}, allowed: a number from 0 to below "
                "1, or null"
            )

    @property
    def known(self) -> KnownModulus | None:
        """Its modulus with the uncertainty; None: unknown."""
        if self.modulus_MPa is None:
            return None
        return KnownModulus(self.modulus_MPa, self.modulus_uncertainty)


@dataclass(frozen=True)
class Entry:
    """The specimen of a touch, and whether the touch is left out.

    Attributes
    ----------
    start_s : float
        When it began, on the clock of the recording, s.
    specimen : str or None
        Name of the object that was touched; None: unknown.
    left_out : str or None
        Why it was left out by hand; "": it is kept; None: its flags decide.
    """

    start_s: float
    specimen: str | None = None
    left_out: str | None = ""

    def __post_init__(self) -> None:
        """Check the fields."""
        _require_time("start_s", self.start_s)
        if self.specimen is not None:
            _require_text("specimen", self.specimen, LONGEST_NAME, least=1)
        _require_text("left_out", self.left_out or "", LONGEST_NAME)


@dataclass(frozen=True)
class Note:
    """A note: when it was made, on the clock of the recording, s, and its text."""

    t_s: float
    text: str

    def __post_init__(self) -> None:
        """Check the fields."""
        _require_time("t_s", self.t_s)
        _require_text("text", self.text, LONGEST_NOTE, lines=True)


@dataclass(frozen=True)
class Plan:
    """The session of a recording: the planned specimens, and the touches.

    Attributes
    ----------
    title, operator : str
    specimens : tuple of Specimen
        Each name once.
    touches : tuple of Entry
    notes : tuple of Note
    ratio : str
        Which ratio of a touch is shown: "hold", or "level", the one over the swept depth, by the
        calibration.

    Raises
    ------
    ValueError
        A field is not of this kind.

    Examples
    --------
    >>> plan = Plan(specimens=(Specimen("30 OO", 0.143, wanted=4),), touches=(Entry(12.5, "30 OO"),))
    >>> plan.as_dict()["specimens"]
    [{'name': '30 OO', 'modulus_MPa': 0.143, 'wanted': 4, 'modulus_uncertainty': None}]
    >>> plan_of({"session": plan.as_dict()}) == plan
    True
    """

    title: str = ""
    operator: str = ""
    specimens: tuple[Specimen, ...] = ()
    touches: tuple[Entry, ...] = ()
    notes: tuple[Note, ...] = ()
    ratio: str = "hold"

    def __post_init__(self) -> None:
        """Check the fields."""
        _require_text("title", self.title, LONGEST_NAME)
        _require_text("operator", self.operator, LONGEST_NAME)
        if self.ratio not in ("hold", "level"):
            raise ValueError(f"ratio: got {quoted(self.ratio)}, allowed: hold or level")
        names = [specimen.name for specimen in self.specimens]
        if len(set(names)) < len(names):
            twice = next(name for number, name in enumerate(names) if name in names[:number])
            raise ValueError(f"specimens: got {quoted(twice)} twice, allowed: each name once")

    @property
    def moduli(self) -> dict[str, KnownModulus]:
        """The known moduli by the name of the specimen."""
        return {one.name: one.known for one in self.specimens if one.known}

    def as_dict(self) -> Json:
        """Return the plan as the entry `session` of a sidecar."""
        plan = asdict(self)
        for name in _KINDS:
            plan[name] = list(plan[name])
        return plan

    def matched(self, touches: "Sequence[Touch]", period_s: float = PERIOD_S) -> list[Entry | None]:
        """Return the entry nearest to each touch, within its length; None: there is none.

        An entry belongs to one touch: the one that is nearest to it.

        Parameters
        ----------
        touches : sequence of Touch
        period_s : float
            Time from pair to pair, s: it makes a length of the samples of a touch.

        Examples
        --------
        >>> import palpate
        >>> touches = palpate.touches(palpate.read("tests/data/four-specimens.csv"))
        >>> plan = Plan(touches=(Entry(touches[1].start_s, "70 OO"),))
        >>> [entry and entry.specimen for entry in plan.matched(touches)]
        [None, '70 OO', None, None]
        """
        near = []
        starts = sorted((entry.start_s, number) for number, entry in enumerate(self.touches))
        for at, touch in enumerate(touches):
            length_s = (touch.samples + touch.saturated + touch.refused) * period_s
            for start_s, number in starts[bisect_left(starts, (touch.start_s - length_s,)) :]:
                apart_s = start_s - touch.start_s
                if not apart_s <= length_s:  # also nan, without times
                    break
                near.append((abs(apart_s), at, number))
        found = dict[int, Entry]()
        used = set[int]()
        for _, at, number in sorted(near):
            if at not in found and number not in used:
                found[at] = self.touches[number]
                used.add(number)
        return [found.get(at) for at in range(len(touches))]


_KINDS: dict[str, type[Specimen | Entry | Note]] = {
    "specimens": Specimen,
    "touches": Entry,
    "notes": Note,
}


def plan_of(document: Mapping[str, Any]) -> Plan:
    """Return the plan in a sidecar, or an empty one; ValueError: a part is not of its kind."""
    return cast("Plan", _parsed("session", document.get("session", {}), Plan))


def _parsed(place: str, given: Any, kind: type[Any]) -> Any:
    """Return a dataclass of names and values; ValueError with the place of the fault."""
    if not isinstance(given, Mapping):
        raise ValueError(f"{place}: got {quoted(given)}, allowed: names and values")  # noqa: TRY004  of a file
    known = dict[str, object]()
    for each in fields(kind):
        if each.name in given:
            known[each.name] = given[each.name]
        elif each.default is MISSING:
            raise ValueError(f"{place}: got no {each.name}, allowed: one in each")
    if kind is Plan:
        for name, part in _KINDS.items():
            known[name] = _listed(f"{place}: {name}", known.get(name, []), part)
    try:
        return kind(**known)
    except ValueError as error:
        raise ValueError(f"{place}: {error}") from error


def _listed(place: str, given: object, kind: type[Any]) -> tuple[Any, ...]:
    if not isinstance(given, list):
        raise ValueError(f"{place}: got {quoted(given)}, allowed: a list")  # noqa: TRY004  of a file
    return tuple(_parsed(f"{place}, {at}", one, kind) for at, one in enumerate(given, 1))


def _require_text(
    name: str, text: object, most: int, *, least: int = 0, lines: bool = False
) -> None:
    if not isinstance(text, str) or not least <= len(text) <= most:
        raise ValueError(
            f"{name}: got {quoted(text)}, allowed: a text of {least} to {most} characters"
        )
    for character in text:
        if lines and character == "\n":
            continue
        if category(character) in _NOT_SHOWN:
            raise ValueError(
                f"{name}: got the character {character!a}, allowed: characters that can be shown"
            )


def _require_time(name: str, value: object) -> None:
    if not _is_number(value):
        raise ValueError(f"{name}: got {quoted(value)}, allowed: a finite number, s")


def _is_number(value: object) -> TypeGuard[float]:
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < _LARGEST


_LARGEST = 1e18  # also false for nan
_NOT_SHOWN = frozenset({"Cc", "Cf", "Cs", "Co", "Cn", "Zl", "Zp"})  # categories of Unicode
