"""Sources that lie: samples that nothing can store, false descriptions and counters, calls that raise or hang."""

import math
from collections.abc import Callable, Iterator, Mapping
from threading import Event
from typing import Any, NoReturn, Self

import numpy as np
from palpate import Sample, Source
from recording_bench import sample


class Restless(Sample):
    """A sample that cannot be iterated over."""

    def __iter__(self) -> NoReturn:
        """Refuse."""
        raise RuntimeError("no iteration")


class Mute(Exception):
    """An error whose text raises another one."""

    def __str__(self) -> NoReturn:
        """Refuse."""
        raise RuntimeError("no text")


class Odd:
    """A value that cannot be printed, and is no number."""

    def __repr__(self) -> NoReturn:
        """Refuse."""
        raise RuntimeError("no text")

    def __index__(self) -> NoReturn:
        """Refuse."""
        raise RuntimeError("no number")


def bad(good: Sample) -> dict[str, Any]:
    """Return what a source may yield in place of a sample, by name: nothing of it can be stored."""
    with_field: Callable[..., Any] = good._replace
    return {
        "time of 65 bits": with_field(t_hard_ns=2**63),
        "time of -65 bits": with_field(t_soft_ns=-(2**63) - 1),
        "infinite time": with_field(t_hard_ns=math.inf),
        "nan in an integer": with_field(t_soft_ns=math.nan),
        "real number for an integer": with_field(seq=float(good.seq)),
        "text for a number": with_field(hard="1.5"),
        "None for a number": with_field(soft=None),
        "complex": with_field(soft=1j),
        "beyond a float": with_field(hard=10**400),
        "beyond all digits": with_field(hard_raw=10**5000),
        "long text": with_field(hard_raw="a" * 10**6),
        "bool for an integer": with_field(status=False),
        "bool for a real number": with_field(hard=True),
        "numpy bool": with_field(seq=np.bool_(True)),
        "array": with_field(hard=np.zeros(3)),
        "odd object": with_field(soft_raw=Odd()),
        "seq of 65 bits": with_field(seq=2**63),
        "seq below 0": with_field(seq=-1),
        "code of 32 bits": with_field(hard_raw=2**31),
        "code above that of the converter": with_field(hard_raw=2**24),
        "value that is not that of its code": with_field(hard=good.hard + 1e-9),
        "code without a value": with_field(soft=math.nan),
        "code below -1": with_field(soft_raw=-2),
        "status 99": with_field(status=99),
        "status below 0": with_field(status=-1),
        "no sample": None,
        "a list": list(good),
        "7 fields": tuple(good)[:7],
        "9 fields": (*good, 0),
        "text": "a line",
        "object": Odd(),
    }


def unusual(good: Sample) -> dict[str, Any]:
    """Return what can be stored as well as a sample, by name."""
    with_field: Callable[..., Any] = good._replace
    return {
        "numpy's integers": with_field(seq=np.int64(good.seq), hard_raw=np.int32(good.hard_raw), status=np.uint8(0)),
        "numpy's real numbers": with_field(hard=np.float32(1.5), soft=np.float64(2.5), hard_raw=-1, soft_raw=-1),
        "integers for real numbers": with_field(hard=1, soft=2, hard_raw=-1, soft_raw=-1),
        "a plain tuple": tuple(good),
        "no iteration": Restless(*good),
        "last time": with_field(t_hard_ns=2**63 - 1, t_soft_ns=-(2**63)),
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
