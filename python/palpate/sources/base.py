"""What every source of samples is."""

from abc import abstractmethod
from collections.abc import Callable, Iterator, Mapping
from typing import Any, Protocol, Self, runtime_checkable

from palpate.samples import Sample


def _silent(_: str) -> None:
    """Tell nobody."""


@runtime_checkable
class Source(Protocol):
    """Something that gives samples: hardware, a simulated board, a file.

    A context manager and an iterator. Its own thread may be another than the one that closes it: `interrupt`
    is called from there. To write one, derive from this class and give it `__iter__` and `describe`; an entry
    point of the group ``palpate.sources`` makes its scheme known, as a function of address and options.

    Attributes
    ----------
    live : bool
        Time runs by itself: who does not keep up loses samples. Otherwise the source waits.
    notify : callable
        Called with a sentence when something happens that a user should know; to be set by who listens.

    Examples
    --------
    >>> class Ramp(Source):
    ...     live = False
    ...     def __iter__(self):
    ...         return (Sample(i, i * 10**7, i * 10**7, -1, -1, 2.5 * i, 1.0 * i) for i in range(3))
    ...     def describe(self):
    ...         return {"name": "ramp"}
    >>> with Ramp() as source:
    ...     [sample.hard for sample in source]
    [0.0, 2.5, 5.0]
    """

    live: bool = True
    notify: Callable[[str], None] = staticmethod(_silent)

    def __enter__(self) -> Self:
        """Begin to measure."""
        return self

    def __exit__(self, *_: object) -> None:
        """Give everything back."""
        self.close()

    @abstractmethod
    def __iter__(self) -> Iterator[Sample]:
        """Return the samples, numbers rising; SourceError where there will be no more for a reason."""
        ...

    @abstractmethod
    def describe(self) -> dict[str, Any]:
        """Return what a recording keeps of the instrument.

        `full_scale_pF` (a reading of this size is saturated) and `period_s` (time from pair to pair) have a meaning
        to `palpate.Stream`.
        """
        ...

    @property
    def counters(self) -> Mapping[str, int]:
        """What went wrong so far: `errors`, `reconnects`."""
        return {}

    def interrupt(self) -> None:
        """Make an iteration that runs in another thread end within 0.3 s."""
        return

    def close(self) -> None:
        """Give everything back; may be called twice."""
        return
