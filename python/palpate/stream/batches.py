"""Results of a stream: an estimate for each sample, and batches of them."""

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

from numpy.typing import NDArray

from palpate.judgements import Judgement
from palpate.samples import Block, Sample, samples_of
from palpate.touch import Touch


class Estimate(NamedTuple):
    """The state of the tracker after a sample.

    In the scenes handheld and sliding it is about the sample two before: a reading is judged when
    the next two are known.

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
        Touches that ended in this batch. The end of the stream may add a last batch: a touch
        without samples.
    first : int
        Number of the first of these touches.
    revised : sequence of (int, Touch)
        Touches, of this batch or an earlier one, that were revised in this batch, with their
        numbers from 1.
    judgements : sequence of Judgement
        What was judged of the readings in this batch; it may be about earlier ones.

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
    judgements: Sequence[Judgement] = ()

    def estimates(self) -> Iterator[Estimate]:
        """Return an `Estimate` for each sample."""
        rows = self.rows.tolist()
        last_row = {number: place for place, number in enumerate(self.rows["touch"].tolist())}
        ended = {}
        for number, touch in enumerate(self.touches, self.first):
            ended[last_row.get(number, 0)] = touch
        revisions = iter(self.revised)
        for place, (sample, row) in enumerate(zip(samples_of(self.samples), rows, strict=True)):
            revised = next(revisions)[1] if row[-1] else None
            yield Estimate._make((sample, *row[:5], ended.get(place), revised))
