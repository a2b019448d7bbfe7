"""Sources that fail: samples that nothing can store, false descriptions and counters, calls that raise or hang."""

import math
from collections.abc import Callable, Iterator, Mapping
from threading import Event
from typing import Any, Self

import numpy as np
from palpate import Sample, Source
from recording_bench import sample


def bad(good: Sample) -> dict[str, Any]:
    """Return what a source may yield in place of a sample, by name: nothing of it can be stored."""
    with_field: Callable[..., Any] = good._replace
    return {
        "time of 65 bits": with_field(t_hard_ns=2**63),
        "nan in an integer": with_field(t_soft_ns=math.nan),
        "text for a number": with_field(hard="1.5"),
        "None for a number": with_field(soft=None),
        "bool for a real number": with_field(hard=True),
        "array": with_field(hard=np.zeros(3)),
        "seq of 65 bits": with_field(seq=2**63),
        "code above that of the converter": with_field(hard_raw=2**24),
        "value that is not that of its code": with_field(hard=good.hard + 1e-9),
        "code without a value": with_field(soft=math.nan),
        "status 99": with_field(status=99),
        "no sample": None,
        "7 fields": tuple(good)[:7],
    }


def unusual(good: Sample) -> dict[str, Any]:
    """Return what can be stored as well as a sample, by name."""
    with_field: Callable[..., Any] = good._replace
    return {
        "numpy's integers": with_field(seq=np.int64(good.seq), hard_raw=np.int32(good.hard_raw), status=np.uint8(0)),
        "numpy's real numbers": with_field(hard=np.float32(1.5), soft=np.float64(2.5), hard_raw=-1, soft_raw=-1),
        "integers for real numbers": with_field(hard=1, soft=2, hard_raw=-1, soft_raw=-1),
        "a plain tuple": tuple(good),
        "infinite reading": with_field(hard=math.inf, soft=-math.inf, hard_raw=-1, soft_raw=-1),
    }


class Liar(Source):
    """A source with a script: items are yielded, errors raised, and functions called.

    Parameters
    ----------
    script : list
    live : bool
    lies : dict
        In place of the methods and properties of the same names: a value to return, an error to raise, or a function to call.
    """

    def __init__(self, script: list[Any], *, live: bool = False, lies: dict[str, Any] | None = None) -> None:
        self.live = live
        self.script, self.lies, self.released = script, lies or {}, Event()
        self.closed = 0

    def _lie(self, name: str, otherwise: Any) -> Any:
        lie = self.lies.get(name, otherwise)
        if isinstance(lie, BaseException):
            raise lie
        return lie() if callable(lie) else lie

    def __enter__(self) -> Self:
        """Begin, or lie."""
        self._lie("enter", None)
        return self

    def __iter__(self) -> Iterator[Any]:
        """Return the items of the script."""
        for item in self.script:
            if isinstance(item, BaseException):
                raise item
            if callable(item):
                item()
            else:
                yield item

    def describe(self) -> Any:
        return self._lie("describe", {"name": "liar"})

    @property
    def counters(self) -> Mapping[str, int]:
        lied: Mapping[str, int] = self._lie("counters", {})
        return lied

    def interrupt(self) -> None:
        self._lie("interrupt", None)

    def close(self) -> None:
        self.closed += 1
        self._lie("close", None)


def good(count: int, first: int = 0) -> list[Any]:
    """Return good samples."""
    return [sample(first + i) for i in range(count)]
