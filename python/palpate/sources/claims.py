"""Checks of the description and the counters of a source."""

import itertools
import json
import math
from collections.abc import Mapping
from numbers import Integral
from typing import Any, NamedTuple

from palpate.errors import ProtocolError
from palpate.recording.codes import codes_of
from palpate.sources.base import Gap, Source

_LONGEST = 100_000  # characters of a description as JSON: the sidecar of a recording has a limit, too
_LONGEST_TEXT = 2000  # characters of the text of a gap
_MOST_CONDITIONS, _MOST_VALUES, _LONGEST_NAME = 2000, 16, 60
_STAMPS = ("converter", "host")


class Conditions(NamedTuple):
    """Those conditions of a source that are kept, and how many it gave."""

    kept: list[dict[str, float]]
    given: int


def is_source(value: object) -> bool:
    """Return whether a value has the methods of a source; no property is read, which may raise.

    Examples
    --------
    >>> from palpate import open
    >>> is_source("sim:"), is_source(open("sim:"))
    (False, True)
    """
    methods = ("__enter__", "__exit__", "__iter__", "describe", "interrupt", "close")
    return all(callable(getattr(value, name, None)) for name in methods)


def described(source: Source) -> dict[str, Any]:
    """Return the description of a source, checked.

    Returns
    -------
    dict of str
        A copy of JSON's types, which the source cannot change later; other values as text.

    Raises
    ------
    ProtocolError
        It is not a dict, it cannot be stored in a recording, or one of its values is outside its range.

    Examples
    --------
    >>> from palpate import open
    >>> described(open("sim:soft-steady"))["stamps"]
    'converter'
    """
    given: Any = source.describe()
    if not isinstance(given, dict):
        raise _wrong(given, "a dict")
    try:
        text = json.dumps(given, default=str)
    except Exception as error:
        raise ProtocolError(f"source: describe() cannot be stored in a recording: {error!s:.60}") from error
    if len(text) > _LONGEST:
        raise _wrong(f"{len(text)} characters of JSON", f"{_LONGEST} at most")
    description: dict[str, Any] = json.loads(text)
    if not _number(full_scale := description.get("full_scale_pF", math.inf)) > 0:
        raise _wrong(full_scale, "a number above 0, pF, or no such key", "full_scale_pF")
    if not 0 < _number(period := description.get("period_s", 1)) < math.inf:
        raise _wrong(period, "a number above 0, s, or no such key", "period_s")
    if (stamps := description.get("stamps", "converter")) not in _STAMPS:
        raise _wrong(stamps, " or ".join(_STAMPS), "stamps")
    try:
        codes_of(description)
    except ValueError as error:
        raise ProtocolError(f"source: describe(): {error}") from error
    return description


def counted(source: Source) -> tuple[int, int]:
    """Return the errors and the reconnections that a source has counted, checked.

    Raises
    ------
    ProtocolError
        `counters` is not a mapping, or one of them is not an integer from 0.
    """
    try:
        own: Any = source.counters
        if not isinstance(own, Mapping):
            raise _wrong(own, "a mapping", "counters")
        return _count("errors", own.get("errors", 0)), _count("reconnects", own.get("reconnects", 0))
    except ProtocolError:
        raise
    except Exception as error:
        raise ProtocolError(f"source: its counters cannot be read: {type(error).__name__}") from error


def zero_of(source: Source) -> int | None:
    """Return `zero_ns` of a source, checked.

    Raises
    ------
    ProtocolError
        It is neither an integer nor None.
    """
    zero_ns: Any = getattr(source, "zero_ns", None)
    if zero_ns is not None and (isinstance(zero_ns, bool) or not isinstance(zero_ns, Integral)):
        raise _wrong(zero_ns, "an integer or None", "zero_ns")
    return None if zero_ns is None else int(zero_ns)


def gap_of(source: Source, number: int) -> Gap | None:
    """Return a gap of a source, by its number from 0, checked; None: there is no such gap so far.

    Raises
    ------
    ProtocolError
        `gaps` is not a sequence of `Gap`.
    """
    try:
        gaps = getattr(source, "gaps", ())
        if len(gaps) <= number:
            return None
        seq, text = gaps[number]
        return Gap(int(seq), f"{text:.{_LONGEST_TEXT}}")
    except Exception as error:
        raise ProtocolError(
            f"source: its gaps cannot be read ({type(error).__name__}), allowed: a sequence of palpate.sources.base.Gap"
        ) from error


def conditions_of(source: Source, known: Conditions) -> Conditions:
    """Return the conditions of a source, checked; `known` again if there are no more. Of very many every second is left.

    Raises
    ------
    ProtocolError
        `conditions` is not a sequence of names and finite numbers.
    """
    try:
        given = getattr(source, "conditions", ())
        if len(given) <= known.given:
            return known
        found = [_condition(each) for each in itertools.islice(given, known.given, None)]
    except Exception as error:
        allowed = "allowed: a sequence of names and finite numbers"
        raise ProtocolError(f"source: its conditions cannot be read ({type(error).__name__}), {allowed}") from error
    kept = [*known.kept, *found]
    while len(kept) > _MOST_CONDITIONS:
        del kept[1:-1:2]
    return Conditions(kept, known.given + len(found))


def _condition(given: Mapping[str, float]) -> dict[str, float]:
    found = {str(name)[:_LONGEST_NAME]: float(value) for name, value in itertools.islice(given.items(), _MOST_VALUES)}
    if not all(map(math.isfinite, found.values())):
        raise ValueError
    return found


def _count(name: str, value: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, Integral) or value < 0:
        raise _wrong(value, "an integer from 0", f"counters[{name!r}]")
    return int(value)


def _number(value: Any) -> float:
    """Return a real number; nan for anything else."""
    try:
        return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else math.nan
    except OverflowError:
        return math.nan


def _wrong(value: Any, allowed: str, name: str = "describe()") -> ProtocolError:
    try:
        got = f"{value!r:.60}"
    except Exception:  # noqa: BLE001  of the value's own text
        got = f"a value of type {type(value).__name__}"
    return ProtocolError(f"source: {name}: got {got}, allowed: {allowed}")
