"""Results of a stream: estimates, batches of them, and counters of samples."""

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any, NamedTuple

from numpy.typing import NDArray

from palpate.samples import Block, Sample, samples_of
from palpate.touch import Touch


class Estimate(NamedTuple):
    """The state of the tracker after a sample.

    Attributes
    ----------
    sample : Sample
    ratio, standard_error : float
        Of the present touch, or of the last one; nan if unknown.
    alarm, contact : bool
        Whether a change was detected at this sample; whether the probe is in contact.
    touch : int
        Number of the present touch, from 1; 0: no touch.
    ended : Touch or None
        The touch that ended with this sample (of a forced tare: with the sample before).
    revised : Touch or None
        The last touch, revised with this sample: the baseline after it is known now.

    Examples
    --------
    >>> from palpate import Stream
    >>> with Stream("sim:stiff-steady?seed=1") as stream:
    ...     first = next(iter(stream))
    >>> first.contact, first.touch, first.ended
    (False, 0, None)
    """

    sample: Sample
    ratio: float
    standard_error: float
    alarm: bool
    contact: bool
    touch: int
    ended: Touch | None = None
    revised: Touch | None = None


class Batch(NamedTuple):
    """Several consecutive samples with their estimates, as arrays.

    Attributes
    ----------
    samples : numpy.ndarray of `SampleRing.dtype`, shape (n,)
    rows : numpy.ndarray, shape (n,)
        Rows of `Tracker.process`, one for each sample.
    touches : sequence of Touch
        Touches that ended in this batch. The end of the stream may add a last batch: a touch without samples.
    first : int
        Number of the first of these touches.
    revised : sequence of (int, Touch)
        Touches, of this batch or an earlier one, that were revised in this batch, with their numbers from 1.

    Examples
    --------
    >>> from palpate import Stream
    >>> with Stream("sim:stiff-steady?seed=1") as stream:
    ...     batch = next(stream.batches())
    >>> len(batch.samples) == len(batch.rows)
    True
    """

    samples: Block
    rows: NDArray[Any]
    touches: Sequence[Touch]
    first: int
    revised: Sequence[tuple[int, Touch]] = ()

    def estimates(self) -> Iterator[Estimate]:
        """Return an `Estimate` for each sample."""
        numbers = self.rows["touch"].tolist()
        last = {number: i for i, number in enumerate(numbers)}
        ended = {last.get(self.first + k, 0): touch for k, touch in enumerate(self.touches)}
        touches = (touch for _, touch in self.revised)
        for i, (sample, row) in enumerate(
            zip(samples_of(self.samples), self.rows.tolist(), strict=True)
        ):
            ratio, error, alarm, contact, number = row[:5]
            yield Estimate(
                sample,
                ratio,
                error,
                alarm,
                contact,
                number,
                ended.get(i),
                next(touches) if row[-1] else None,
            )


@dataclass(frozen=True)
class StreamCounters:
    """Numbers of samples that a stream read, used, dropped and lost.

    `read + lost` is the sequence number after the last sample (minus the first one, if a file begins later);
    `read = delivered + dropped + waiting`; with a recording, `read = recorded + unrecorded` when it is closed.

    Attributes
    ----------
    read : int
        Samples read from the source.
    lost : int
        Samples lost before they were read (gaps in `seq`).
    late : int
        Samples that arrived more than half a period too late.
    delivered, dropped, waiting : int
        Sent to the tracker; dropped, because the consumer was too slow; still in the queue. At the end none is waiting.
    retaken : int
        How often the channels fell far below the baseline, so that it was measured again.
    refused, saturated : int
        Delivered samples that were not used: without a valid value; outside the range of the converter.
    recorded, unrecorded : int
        Samples in the file; samples that are not in it.
    errors, reconnects : int
        Errors and reconnections of the source.
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
    retaken: int = 0

    def as_dict(self) -> dict[str, int]:
        """Return the counters by name."""
        return asdict(self)

    def since(self, before: "StreamCounters") -> dict[str, int]:
        """Return the counters, by name, of the samples that were read after an earlier state.

        Samples that were waiting in the earlier state are not counted.

        Parameters
        ----------
        before : StreamCounters
            The earlier state.

        Returns
        -------
        dict of str to int

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
        return passed | {
            "waiting": self.waiting,
            "recorded": self.recorded,
            "unrecorded": self.unrecorded,
        }
