"""What a stream says after each sample, and the count of what became of them."""

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any, NamedTuple

from numpy.typing import NDArray

from palpate._core import Touch
from palpate.samples import Block, Sample, samples_of


class Estimate(NamedTuple):
    """The state after a sample.

    Attributes
    ----------
    sample : Sample
    ratio, standard_error : float
        Of the running touch, or of the last one; nan where not known.
    alarm, contact : bool
        A change was detected; something is touched.
    touch : int
        Number of the touch that is measured, from 1; 0 where none is.
    ended : Touch or None
        The touch that ended with this sample.
    """

    sample: Sample
    ratio: float
    standard_error: float
    alarm: bool
    contact: bool
    touch: int
    ended: Touch | None = None


class Batch(NamedTuple):
    """Samples that came together.

    Attributes
    ----------
    samples : numpy.ndarray of `SampleRing.dtype`, shape (n,)
    rows : numpy.ndarray, shape (n,)
        `Tracker.process`'s of each.
    touches : sequence of Touch
        Those that ended in it, or, in a last batch without samples, by the end of the stream.
    first : int
        Number of the first of these touches.
    """

    samples: Block
    rows: NDArray[Any]
    touches: Sequence[Touch]
    first: int

    def estimates(self) -> Iterator[Estimate]:
        """Return an estimate for each sample."""
        numbers = self.rows["touch"].tolist()
        last = {number: i for i, number in enumerate(numbers)}
        ended = {last[self.first + k]: touch for k, touch in enumerate(self.touches) if self.first + k in last}
        for i, (sample, row) in enumerate(zip(samples_of(self.samples), self.rows.tolist(), strict=True)):
            ratio, error, alarm, contact, number = row[:5]
            yield Estimate(sample, ratio, error, alarm, contact, number, ended.get(i))


@dataclass(frozen=True)
class StreamCounters:
    """What became of the samples.

    `read + lost` is the number after the last sample's (from the first one's, where a file begins later);
    `read = delivered + dropped + waiting`; with a recording, `read = recorded + unrecorded` when it is closed.

    Attributes
    ----------
    read : int
        Samples that the source has given.
    lost : int
        Numbers that it has left out.
    late : int
        Samples that came more than half a period late.
    delivered, dropped, waiting : int
        Handed to the tracker; not handed to it, as the consumer was too slow; neither yet. None waits at the end.
    refused, saturated : int
        Those of the delivered without a usable value, and beyond the converter's range: not estimated from.
    recorded, unrecorded : int
        In the file; not in it.
    errors, reconnects : int
        The source's.
    """

    read: int = 0
    lost: int = 0
    late: int = 0
    delivered: int = 0
    dropped: int = 0
    waiting: int = 0
    refused: int = 0
    saturated: int = 0
    recorded: int = 0
    unrecorded: int = 0
    errors: int = 0
    reconnects: int = 0

    def as_dict(self) -> dict[str, int]:
        """Return them by name."""
        return asdict(self)

    def since(self, before: "StreamCounters") -> dict[str, int]:
        """Return by name what has become of the samples read since then, what waited then left out.

        Examples
        --------
        >>> then, now = StreamCounters(read=5, delivered=3, waiting=2), StreamCounters(read=9, delivered=9)
        >>> then_read = now.since(then)
        >>> then_read["read"], then_read["delivered"], then_read["waiting"]
        (4, 4, 0)
        """
        earlier = before.as_dict()
        earlier["delivered"] += earlier["waiting"]
        passed = {name: value - earlier[name] for name, value in self.as_dict().items()}
        return passed | {"waiting": self.waiting, "recorded": self.recorded, "unrecorded": self.unrecorded}
