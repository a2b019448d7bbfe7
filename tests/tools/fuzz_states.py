"""Fuzz target of pickled states: estimators and touches, as a function of bytes."""

import copy
import functools
import math
import struct
from collections.abc import Callable
from contextlib import suppress
from typing import Any

import numpy as np
import palpate

_PICKLED = (
    "Rls",
    "AdaptiveRls",
    "HandoverRls",
    "Rls32",
    "HandoverRls32",
    "RlsBank",
    "AdaptiveRlsBank",
    "HandoverRlsBank32",
)
_VALUES: list[Callable[[bytes], Any]] = [
    lambda raw: struct.unpack("<d", raw)[0],
    lambda raw: int.from_bytes(raw, "little", signed=True),
    lambda raw: int.from_bytes(raw[:1], "little") - 2,
    lambda raw: 2.0 ** (int.from_bytes(raw[:2], "little", signed=True) % 2100 - 1080),
    lambda raw: np.frombuffer(raw, np.float64),
    lambda raw: np.zeros([b % 7 for b in raw[:3]], [np.float64, np.uint64, np.object_, np.float32][raw[3] % 4]),
    lambda raw: (raw, None, "drift", (), [], {}, {"drift": 0.1}, math.nan)[raw[0] % 8],
]


def state(data: bytes) -> None:
    """Set states as an untrusted pickle could: a valid state with other values at places that the bytes select."""
    kind, valid = _states()[data[0] % len(_states()) if data else 0]
    for at in range(1, len(data) - 10, 11):
        where, path, what = data[at : at + 3]
        valid = _replaced(valid, [where, path], _VALUES[what % len(_VALUES)](data[at + 3 : at + 11]))
    made, taken = kind.__new__(kind), False
    # AttributeError: attributes of a subclass, for an object that is not of a subclass.
    with suppress(ValueError, TypeError, AttributeError), np.errstate(over="ignore"):
        made.__setstate__(valid)
        taken = True
    if taken:
        _use(made)


def _use(made: Any) -> None:
    """Check that an accepted state works, and that its pickle gives the same state."""
    assert repr(made)
    assert copy.deepcopy(made) is not made
    if isinstance(made, palpate.Touch):
        assert isinstance(made.flags, tuple)
        assert isinstance(made.as_dict(), dict)
    elif hasattr(made, "streams"):
        ratios = made.process([[0.5] * made.streams] * 3, [[0.25] * made.streams] * 3)
        assert ratios.shape == (3, made.streams)
    else:
        assert math.isfinite(made.update(0.5, 0.25))
        assert len(made.process([0.5] * 3, [0.25] * 3)) == 3


@functools.cache
def _states() -> list[tuple[Any, Any]]:
    """Return the classes with a valid state of each."""
    found: list[tuple[Any, Any]] = []
    for name in _PICKLED:
        kind = getattr(palpate, name)
        bank = "Bank" in name
        made = kind(3) if bank else kind()
        made.process([[0.5] * 3] if bank else [0.5], [[0.25] * 3] if bank else [0.25])
        found.append((kind, made.__getstate__()))
    with palpate.Stream("sim:stiff-steady") as stream:
        list(stream)
    return [*found, (palpate.Touch, stream.touches[0].__getstate__())]


def _replaced(given: Any, path: list[int], value: Any) -> Any:
    """Return a state with another value at a place, without that place, or with one more."""
    items = list(given.items()) if isinstance(given, dict) else list(given) if isinstance(given, tuple | list) else None
    if not items or not path:
        return value
    at = path[0] % (len(items) + 1)
    if isinstance(given, dict):
        return dict(items[:at]) | ({items[at][0]: value} if at < len(items) else {}) | dict(items[at + 1 :])
    if path[0] > 250:
        return tuple(items[:at])
    return (*items[:at], _replaced(items[at], path[1:], value) if at < len(items) else value, *items[at + 1 :])
