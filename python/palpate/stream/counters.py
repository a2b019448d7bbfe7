"""Counters of a stream: how many samples it read, lost, used, dropped and recorded."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace

import numpy as np

from palpate.recording.recorder import Recorder
from palpate.samples import Block, refused_samples, saturated_samples
from palpate.stream.buffers import SampleQueue
from palpate.stream.pipeline import Pipeline
from palpate.stream.reader import Reader


@dataclass(frozen=True)
class StreamCounters:
    """Numbers of samples that a stream read, used, dropped and lost.

    `read + lost` is the sequence number after the last sample (minus the first one, if a file
    begins later); `read = delivered + dropped + waiting`; with a recording,
    `read = recorded + unrecorded` when it is closed.

    Attributes
    ----------
    read : int
        Samples read from the source.
    lost : int
        Samples lost before they were read (gaps in `seq`).
    late : int
        Samples that arrived more than half a period too late.
    delivered, dropped, waiting : int
        Sent to the tracker; dropped, because the consumer was too slow; still in the queue. At the
        end none is waiting.
    retaken : int
        How often the channels fell far below the baseline, so that it was measured again.
    refused, saturated : int
        Delivered samples that were not used: without a valid value; outside the range of the
        converter.
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
        >>> before = StreamCounters(read=5, delivered=3, waiting=2)
        >>> later = StreamCounters(read=9, delivered=9).since(before)
        >>> later["read"], later["delivered"], later["waiting"]
        (4, 4, 0)
        """
        earlier = before.as_dict()
        earlier["delivered"] += earlier.pop("waiting")
        counts = self.as_dict()
        for name, count in earlier.items():
            counts[name] -= count
        return counts

    def without(self, newest: Block) -> "StreamCounters":
        """Return the counters as they were before the newest samples, which have been read.

        Nothing shows when late samples, errors, reconnections and wrong baselines were: they stay,
        unless there are only newest samples.
        """
        if len(newest) == self.read:
            return StreamCounters()
        delivered = newest[: max(0, len(newest) - self.waiting)]
        lost = 0
        if len(newest):
            lost = int(newest["seq"][-1] - newest["seq"][0]) + 1 - len(newest)
        return replace(
            self,
            read=self.read - len(newest),
            lost=self.lost - lost,
            delivered=max(0, self.delivered + self.waiting - len(newest)),
            waiting=0,
            refused=self.refused - int(np.count_nonzero(refused_samples(delivered))),
            saturated=self.saturated - int(np.count_nonzero(saturated_samples(delivered))),
        )


def current_counters(
    reader: Reader,
    pipeline: Pipeline,
    queue: SampleQueue,
    recorder: Recorder | None,
    of_source: Mapping[str, int],
) -> StreamCounters:
    """Return the counters of a running measurement; from any thread."""
    delivered = pipeline.delivered
    dropped = queue.ring.dropped
    recorded = 0
    unrecorded = 0
    if recorder:
        recorded = recorder.rows
        unrecorded = recorder.dropped
    read = reader.read  # read last: so `waiting` cannot be negative
    return StreamCounters(
        read=read,
        lost=reader.lost,
        late=reader.late,
        delivered=delivered,
        dropped=dropped,
        waiting=read - delivered - dropped,
        refused=pipeline.refused,
        saturated=pipeline.saturated,
        recorded=recorded,
        unrecorded=unrecorded,
        errors=of_source.get("errors", 0),
        reconnects=of_source.get("reconnects", 0),
        retaken=pipeline.retaken,
    )
