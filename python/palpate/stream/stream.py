"""A running measurement: source, ring, tracker, and a recording of it."""

import math
import os
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self, Unpack

from palpate._core import Touch, Tracker
from palpate.epoch import Epoch, at
from palpate.recording.codes import codes_of
from palpate.recording.sidecar import sidecar_path
from palpate.samples import settings_for
from palpate.sources import Source
from palpate.sources import open as open_source
from palpate.sources.base import Gap
from palpate.sources.claims import described, is_source
from palpate.stream.beginning import Memory
from palpate.stream.counting import counters_of
from palpate.stream.estimate import Batch, Estimate, StreamCounters
from palpate.stream.feeding import Feeding
from palpate.stream.instrument import Instrument
from palpate.stream.intake import Intake
from palpate.stream.reader import Reader
from palpate.stream.recording_slot import RecordingSlot
from palpate.stream.recording_stream import RecordingStream
from palpate.stream.waiting import Waiting, capacity_for

if TYPE_CHECKING:
    from palpate._core import _AnySettings, _Scene

STOP_S = 0.5
_BATCH = 1024  # samples at a time, at most
_POLL_S = 0.1  # on Windows a wait hears Ctrl-C at its end only


class Stream(RecordingStream):
    """A running measurement: one thread reads the source, the caller's thread estimates.

    Parameters
    ----------
    source : str or Source
        A name for `palpate.open`, or a source. The stream closes it, also if the stream cannot start.
    tracker : Tracker, optional
        Default: ``Tracker(scene, **settings)`` with the full scale of the source. A tracker of your own without
        `full_scale` counts saturated samples as refused.
    scene : str
    record : path-like, optional
        NAME.csv: every sample is written there, also if the consumer is too slow. NAME.json has the description.
    capacity : int, optional
        Most samples that wait for the consumer; more are dropped and counted. A file waits for the consumer. Default:
        those of a second, at least 4096.
    keep : int, optional
        How many of the newest samples are kept in memory, 1024 to 2**24, so that a recording that is started later can
        begin with them: see `start_recording`. Default: none.
    outlives_recording : bool
        Go on without a recording that fails, for example on a full disk; `stop_recording` then raises its error. Default:
        its error ends the measurement.
    notes : list of str, optional
        Notes in the recording.
    notify : callable, optional
        Called with a message when a device is unplugged or back, when the baseline is found to be wrong or is measured
        again, and when a channel is outside the range of the converter without a touch.
    **settings
        As in `Tracker`.

    Attributes
    ----------
    source : Source
    tracker : Tracker

    Raises
    ------
    ValueError, TypeError, SourceError, RecordingError, MissingExtra
        As from `palpate.open` and `Tracker`. `with` raises RecordingError if the recording already exists. The
        iteration raises the error of the source, after its last sample; ProtocolError at a sample that cannot be stored.

    Notes
    -----
    `palpate.touches` computes from the recording, with the same settings, the same touches as the stream, bit for bit,
    if no sample was dropped.

    Examples
    --------
    >>> with Stream("sim:stiff-steady?seed=1") as stream:
    ...     for estimate in stream:
    ...         if estimate.ended:
    ...             print(estimate.ended.samples, estimate.ended.flags)
    208 ()
    """

    def __init__(
        self,
        source: str | Source,
        tracker: Tracker | None = None,
        *,
        scene: "_Scene" = "handheld",
        record: str | os.PathLike[str] | None = None,
        capacity: int | None = None,
        keep: int | None = None,
        outlives_recording: bool = False,
        notes: list[str] | None = None,
        notify: Callable[[str], None] | None = None,
        **settings: Unpack["_AnySettings"],
    ) -> None:
        with ExitStack() as on_failure:
            if not isinstance(source, str) and not is_source(source):
                raise TypeError(f"source: got {source!r:.60}, allowed: a name, or a palpate.Source")
            if not isinstance(source, str):
                on_failure.callback(Instrument(source).close)
            if tracker is not None and settings:
                raise ValueError(f"settings: got {', '.join(settings)} and a tracker, allowed: only one of them")
            given: dict[str, Any] = dict(settings)
            self.tracker: Tracker = tracker or Tracker(scene, **given)
            if record is not None:
                sidecar_path(Path(record))
            waiting = None if capacity is None else Waiting(capacity)
            self._memory, self._outlives = None if keep is None else Memory(keep), outlives_recording
            if isinstance(source, str):
                source = open_source(source)
                on_failure.callback(Instrument(source).close)
            self.source = source
            if notify:
                self.source.notify = notify
            device = described(self.source)
            if tracker is None:
                self.tracker = Tracker(scene, **{**settings_for(scene, device), **given})
            self._waiting = waiting or Waiting(capacity_for(device))
            on_failure.pop_all()
        self._gaps: deque[Gap] = deque()
        self._recordings = RecordingSlot(
            self.source, self.tracker, lambda: self.counters, record, notes or [], lambda: self._zero_ns
        )
        places = self._memory.places if self._memory else None
        self._feeding = Feeding(self._waiting, self.tracker, self._gaps, self.source.notify, places)
        self._instrument = Instrument(self.source)
        super().__init__()
        self._begins = self._stop_asked = False

    def __repr__(self) -> str:
        """Return the state of the measurement, in one line."""
        from palpate.display import text

        return text.stream(self)

    def _repr_html_(self) -> str:
        from palpate.display import cards

        return cards.stream(self)

    def __enter__(self) -> Self:
        """Begin the measurement."""
        if self._closed or self._reader:
            raise ValueError("stream: got a second `with`, or one after close(), allowed: one `with` for each stream")
        try:
            device = self._instrument.begin()
            self._begins = True  # from here on there may be a recording to close
            self._recordings.first()
            period_s, codes = float(device.get("period_s", math.nan)), codes_of(device)
            kept = self._memory.kept if self._memory else None
            intake = Intake(
                self.source, self._waiting, self._gaps, self.recorder, period_s, codes, kept, outlives=self._outlives
            )
            self._reader = Reader(self.source, intake, self._waiting)
            self._reader.start()
            if self._stop_asked:
                self._reader.stop()
        except BaseException as error:
            self._end(error)
            raise
        return self

    def __exit__(self, *_: object) -> None:
        """Stop, and close the recording and the source."""
        self.close()

    def __iter__(self) -> Iterator[Estimate]:
        """Return an estimate after each sample; of a file, also `tare` in the loop is at this sample, in each run."""
        for batch in self._batches(_BATCH if self.source.live else 1):
            for estimate in batch.estimates():
                self._seen = estimate.sample
                yield estimate

    def batches(self) -> Iterator[Batch]:
        """Return samples and estimates as arrays: each batch has all samples that wait, or the next ones."""
        return self._batches(_BATCH)

    def _batches(self, most: int) -> Iterator[Batch]:
        reader = self._begun()
        while (batch := self._next(most)) is not None:
            self._seen = self._feeding.last
            yield batch
        if last := self._feeding.finish():
            yield last
        if reader.error is not None and not self._raised:
            self._raised = True
            raise reader.error

    @property
    def touches(self) -> list[Touch]:
        """All touches that have ended, in order of time; revised ones in place of the first results."""
        return self.tracker.touches

    @property
    def counters(self) -> StreamCounters:
        """Numbers of samples so far; may be read from any thread."""
        if self._reader is None:
            return StreamCounters()
        return counters_of(self._reader.intake, self._feeding, self.recorder, self._instrument)

    @property
    def epoch(self) -> Epoch | None:
        """The time t = 0 on the clocks of the computer; None: no sample yet, or the times are not those of a clock."""
        return None if self._zero_ns is None else at(self._zero_ns)

    @property
    def _zero_ns(self) -> int | None:
        return self._reader.intake.zero_ns if self._reader else None

    @property
    def out_of_range(self) -> tuple[str, ...]:
        """Those of "hard" and "soft" that are outside the converter's range, and not by a touch; see `centre`."""
        return self._feeding.range.channels

    def centre(self, *, force: bool = False) -> None:
        """Set the range of the converter again, around the signal without contact; from any thread.

        The source does it before its next sample (a simulation without `speed` is read ahead, by up to 2048 samples, with
        `capacity` 2 by as few). It is a gap: the baseline is measured again, and the recording has a mark with the CAPDACs.

        Parameters
        ----------
        force : bool
            Also in contact: after a jump of the baseline, which looks like a touch without end.

        Raises
        ------
        RuntimeError
            The probe is in contact, and `force` is False; or the source cannot set its range.
        """
        if not force and not self.out_of_range and self.tracker.state in ("contact", "done"):
            raise RuntimeError("centre: got it in contact, allowed: without contact. Lift the probe, or force=True")
        self.source.centre()

    def stop(self) -> bool:
        """End the iteration after the samples read so far; from any thread or signal handler. False before `with`."""
        self._stop_asked = self._begins
        if self._reader:
            self._reader.stop()
        return self._begins

    def close(self) -> None:
        """Stop within 0.5 s, estimate from the remaining samples, and close the recording and the source.

        If one of these fails, the others are done, too, and the recording has the error.

        Raises
        ------
        RecordingError
            A sample that was read could not be recorded.
        SourceTimeout
            The source did not stop, or did not close within 2 s; its thread still runs.
        RuntimeError
            Called in the thread of the source, for example in `notify`.
        Exception
            What `interrupt` or `close` of the source raises.
        """
        self._end(None)

    def _end(self, failure: BaseException | None) -> None:
        reader = self._reader
        if reader and reader.is_this_thread:
            raise RuntimeError("stream: got close() in the thread of the source, allowed: stop()")
        if self._closed:
            return
        self._closed = True
        with ExitStack() as steps:  # they run from the last one to the first, each also after an error
            steps.callback(self._raise_unrecorded)
            steps.callback(self._close_source)
            steps.push(lambda _, error, __: self._close_recording(failure or error))
            if reader:
                steps.callback(self._feeding.drain)
                reader.end(STOP_S)

    def _close_source(self) -> None:
        if self._reader is None or self._reader.join(0):
            self._instrument.close()

    def _next(self, most: int) -> Batch | None:
        """Return the next batch; None: there will be no more."""
        while True:
            closed = self._waiting.ring.closed
            if batch := self._feeding.take(most):
                return batch
            if closed or self._closed:
                return None
            self._waiting.wait_for_samples(_POLL_S)
