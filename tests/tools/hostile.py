"""Sources that fail: samples that nothing can store, false descriptions, calls that raise or hang."""

import math
from collections.abc import Iterator
from typing import Any, Self

import numpy as np
from palpate import Sample, Source
from recording_bench import sample


def bad(good: Sample) -> list[Any]:
    """Return what a source may yield in place of a sample: nothing of it can be stored."""
    return [good._replace(t_hard_ns=2**63), good._replace(soft=math.nan), good._replace(status=99), None]


def unusual(good: Sample) -> list[Any]:
    """Return what can be stored as well as a sample."""
    no_codes = good._replace(hard_raw=-1, soft_raw=-1)
    return [
        no_codes._replace(seq=np.int64(good.seq), hard=np.float32(1.5), status=np.uint8(0)),
        no_codes._replace(hard=1, soft=math.inf),
        tuple(good),
    ]


class Liar(Source):
    """A source with a script: items are yielded, errors raised, functions called; `lies`: in place of methods of these names."""

    def __init__(self, script: list[Any], *, live: bool = False, lies: dict[str, Any] | None = None) -> None:
        self.live = live
        self.script, self.lies, self.closed = script, lies or {}, 0

    def _lie(self, name: str, otherwise: Any) -> Any:
        lie = self.lies.get(name, otherwise)
        if isinstance(lie, BaseException):
            raise lie
        return lie

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

    def interrupt(self) -> None:
        self._lie("interrupt", None)

    def close(self) -> None:
        self.closed += 1
        self._lie("close", None)


def good(count: int, first: int = 0) -> list[Any]:
    """Return good samples."""
    return [sample(first + i) for i in range(count)]
