"""The counters of a stream, from its parts."""

from palpate.recording.recorder import Recorder
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
