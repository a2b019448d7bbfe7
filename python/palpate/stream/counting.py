"""The counters of a stream, from its parts."""

from dataclasses import replace

import numpy as np

from palpate.recording.recorder import Recorder
from palpate.samples import Block, refused, saturated
from palpate.stream.estimate import StreamCounters
from palpate.stream.feeding import Feeding
from palpate.stream.instrument import Instrument
from palpate.stream.intake import Intake


def counters_of(intake: Intake, feeding: Feeding, recorder: Recorder | None, instrument: Instrument) -> StreamCounters:
    """Return the counters; from any thread."""
    errors, reconnects = instrument.counts()
    delivered, dropped = feeding.delivered, feeding.dropped
    read = intake.read  # read last: so `waiting` cannot be negative
    return StreamCounters(
        read=read,
        lost=intake.lost,
        late=intake.late,
        delivered=delivered,
        dropped=dropped,
        waiting=read - delivered - dropped,
        refused=feeding.refused,
        saturated=feeding.saturated,
        recorded=recorder.rows if recorder else 0,
        unrecorded=recorder.dropped if recorder else 0,
        errors=errors,
        reconnects=reconnects,
        retaken=feeding.retaken,
    )


def before(block: Block, now: StreamCounters) -> StreamCounters:
    """Return the counters as they were before the newest samples; what happened beside samples counts from now on.

    Examples
    --------
    >>> from palpate.samples import blank
    >>> before(blank(10), StreamCounters(read=25, lost=2, delivered=20, waiting=5)).as_dict()["delivered"]
    15
    """
    if len(block) == now.read:
        return StreamCounters()
    taken = block[: max(0, len(block) - now.waiting)]
    lost = int(block["seq"][-1] - block["seq"][0]) + 1 - len(block) if len(block) else 0
    return replace(
        now,
        read=now.read - len(block),
        lost=now.lost - lost,
        delivered=max(0, now.delivered + now.waiting - len(block)),
        waiting=0,
        refused=now.refused - int(np.count_nonzero(refused(taken))),
        saturated=now.saturated - int(np.count_nonzero(saturated(taken))),
    )
