"""A running measurement: source, queue, tracker, and one recording of it at a time."""

import os
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from threading import RLock
from typing import TYPE_CHECKING, Any, Self, Unpack

import numpy as np

from palpate._core import Tracker
from palpate.clocks import Epoch, epoch_at
from palpate.recording.recorder import Recorder, capacity_for
from palpate.recording.sidecar import BEGUN, marked, sidecar_path
from palpate.samples import (
    DTYPE,
    Block,
    Sample,
    refused_samples,
    require_scale,
    saturated_samples,
    settings_for,
)
from palpate.sources import Source
from palpate.sources import open as open_source
from palpate.sources.base import described
from palpate.stream.batches import Batch, Estimate, StreamCounters
from palpate.stream.buffers import NO_BASELINE, Beginning, Memory, SampleQueue
from palpate.stream.listeners import Listener, Listeners
from palpate.stream.pipeline import Feeding
from palpate.stream.reader import Reader
from palpate.touch import Touch

if TYPE_CHECKING:
    from palpate._core import _AnySettings, _Scene

STOP_S = 0.5
_BATCH = 1024  # samples at a time, at most
# how late the consumer may be, in seconds and in samples
_LAG_S = 1.0
_LEAST = 4096
_POLL_S = 0.1  # on Windows a wait hears Ctrl-C at its end only
_LONGEST_ERROR = 2000  # characters in the sidecar


class Stream:
    """A running measurement: one thread reads the source, the caller's thread estimates.

    Parameters
    ----------
    source : str or Source
        A name for `palpate.open`, or a source. The stream closes it, also if the stream cannot start.
    tracker : Tracker, optional
        Default: ``Tracker(scene, **settings)`` with the full scale of the source. A tracker of your own without
        `full_scale` counts saturated samples as refused.
    scene : str
    unit : str, optional
        As in `palpate.read`; for a name of a file, a serial port or a stream. Default: as the source says, else pF.
    record : path-like, optional
        NAME.csv: every sample is written there, also if the consumer is too slow. NAME.json has the description.
    capacity : int, optional
        Most samples that wait for the consumer; more are dropped and counted. A file waits for the consumer. Default:
        the samples of a second, at least 4096.
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
        unit: str | None = None,
        record: str | os.PathLike[str] | None = None,
        capacity: int | None = None,
        keep: int | None = None,
        outlives_recording: bool = False,
        notes: list[str] | None = None,
        notify: Callable[[str], None] | None = None,
        **settings: Unpack["_AnySettings"],
    ) -> None:
        with ExitStack() as on_failure:
            if not isinstance(source, str):
                if not isinstance(source, Source):
                    raise TypeError(
                        f"source: got {source!r:.60}, allowed: a name, or a palpate.Source"
                    )
                on_failure.callback(source.close)
            if tracker is not None and settings:
                raise ValueError(
                    f"settings: got {', '.join(settings)} and a tracker, allowed: only one of them"
                )
            given: dict[str, Any] = dict(settings)
            self.tracker: Tracker = tracker or Tracker(scene, **given)
            if record is not None:
                sidecar_path(Path(record))
            queue = None if capacity is None else SampleQueue(capacity)
            self._memory = None if keep is None else Memory(keep)
            if unit is not None and not isinstance(source, str):
                raise ValueError(
                    f"unit: got {unit!r} and a source, allowed: with a name; palpate.open takes it, too"
                )
            if isinstance(source, str):
                source = open_source(source, **({} if unit is None else {"unit": unit}))
                on_failure.callback(source.close)
            self.source: Source = source
            self._listeners = Listeners(notify or source.notify)
            source.notify = self._listeners.message
            device = described(source)
            if tracker is None:
                require_scale(scene, device.get("unit", "pF"), given)
                self.tracker = Tracker(scene, **{**settings_for(scene, device), **given})
            self._queue = queue or SampleQueue(capacity_for(device, _LAG_S, _LEAST))
            on_failure.pop_all()
        self._feeding = Feeding(self._queue, self.tracker, self._listeners)
        self._first_recording = (record, notes or [])
        self._outlives_recording = outlives_recording
        self._recorder: Recorder | None = None
        self._reader: Reader | None = None
        self._before = StreamCounters()  # when the recording began
        self._recorded: int | None = None  # number of the last sample of the recording before
        self._switching = RLock()  # held while a recording begins or ends, which waits for the disk
        # held while notes and marks are written; taken before the lock of the reader
        self._remarking = RLock()
        self._seen: Sample | None = None  # by the caller, of a source that waits for the caller
        self._begun = self._stop_asked = self._closed = self._raised = False

    def __repr__(self) -> str:
        """Return the state of the measurement, in one line."""
        from palpate.display.text import stream_line

        return stream_line(self)

    def _repr_html_(self) -> str:
        from palpate.display.cards import stream_card

        return stream_card(self)

    def __enter__(self) -> Self:
        """Begin the measurement."""
        if self._closed or self._reader:
            raise ValueError(
                "stream: got a second `with`, or one after close(), allowed: one `with` for each stream"
            )
        try:
            self.source.__enter__()
            self._begun = True  # from here on there may be a recording to close
            device = described(self.source)
            path, notes = self._first_recording
            self._recorder = None if path is None else self._new_recorder(path, notes)
            self._listeners.begun(self)
            self._reader = Reader(
                self.source, device, self._queue, self._memory, outlives=self._outlives_recording
            )
            self._reader.record(self._recorder)
            self._reader.start()
            if self._stop_asked:
                self._reader.stop()
        except BaseException as error:
            self._end(error)
            raise
        return self

    def listen(self, listener: Listener) -> None:
        """Add a listener, which gets all later events of this measurement; see `Listener`."""
        self._listeners.all.append(listener)

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
        reader = self._started()
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
        feeding = self._feeding
        reader = self._reader
        recorder = self._recorder
        of_source = self.source.counters
        delivered = feeding.delivered
        dropped = self._queue.ring.dropped
        read = reader.read  # read last: so `waiting` cannot be negative
        return StreamCounters(
            read=read,
            lost=reader.lost,
            late=reader.late,
            delivered=delivered,
            dropped=dropped,
            waiting=read - delivered - dropped,
            refused=feeding.refused,
            saturated=feeding.saturated,
            recorded=recorder.rows if recorder else 0,
            unrecorded=recorder.dropped if recorder else 0,
            errors=of_source.get("errors", 0),
            reconnects=of_source.get("reconnects", 0),
            retaken=feeding.retaken,
        )

    @property
    def epoch(self) -> Epoch | None:
        """The time t = 0 on the clocks of the computer; None: no sample yet, or the times are not those of a clock."""
        zero_ns = self._zero_ns()
        return None if zero_ns is None else epoch_at(zero_ns)

    def _zero_ns(self) -> int | None:
        return self._reader.zero_ns if self._reader else None

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
            raise RuntimeError(
                "centre: got it in contact, allowed: without contact. Lift the probe, or force=True"
            )
        self.source.centre()

    def tare(self, *, force: bool = False) -> None:
        """Measure the baseline again, and mark it in the recording; from the thread that iterates.

        Parameters
        ----------
        force : bool
            Also in contact: after a jump of the baseline, which looks like a touch without end.

        Raises
        ------
        RuntimeError
            The probe is in contact, and `force` is False.
        """
        with self._feeding.lock, self._remarking:
            self.tracker.tare(force)
            last = self._feeding.last
            if not self._reader or not last:
                return
            with self._reader.lock:  # a recording that begins now has the mark from the memory
                if self._memory:
                    self._memory.marks.append(marked("tare", last, tare=True))
                recorder = self.recorder
            if recorder:
                recorder.mark("tare", last, tare=True)

    @property
    def recorder(self) -> Recorder | None:
        """The recorder; None: no recording."""
        return self._recorder

    def start_recording(
        self,
        record: str | os.PathLike[str],
        notes: list[str] | None = None,
        *,
        earlier: bool = False,
    ) -> Recorder:
        """Record to NAME.csv; from any thread.

        Parameters
        ----------
        record : path-like
        notes : list of str, optional
        earlier : bool
            Begin with the samples that are kept (`keep` of the stream), but for those that the recording before has. If
            they begin with the measurement, a replay has the same touches, bit for bit. Else the recording begins with a
            tare mark: a replay measures the baseline there, so touches may differ until the baseline is measured again
            after a release, a tare or a gap; later ones have the same bits (with times of the computer: they agree within
            their uncertainty). A note in the recording says so.

            False: begin with the next sample. A replay measures the baseline there: begin without contact.

        Raises
        ------
        ValueError, RecordingError
            A recording is running, the stream has ended, the file exists, or no samples are kept.
        """
        reader = self._started()
        if earlier and not self._memory:
            raise ValueError(
                "earlier: got True, allowed: with Stream(..., keep=65536), which keeps so many samples"
            )
        with self._switching:
            if self._closed or self._recorder:
                raise ValueError(
                    "record: already recording, or the stream has ended; allowed: one recording at a time"
                )
            recorder = self._new_recorder(record, notes or [])
            with reader.lock:
                beginning = self._beginning(reader.read, earlier=earlier)
                recorder.begin(*beginning)
                self._before = _counters_before(beginning.block, self.counters)
                self._recorder = recorder
                reader.record(recorder)
            return recorder

    def _beginning(self, read: int, *, earlier: bool) -> Beginning:
        if earlier and self._memory:
            host_stamps = bool(self.tracker.settings.get("host_stamps", False))
            return self._memory.beginning(self._recorded, host_stamps=host_stamps)
        return Beginning(
            np.empty(0, DTYPE), [], f"{BEGUN}{read} pairs; {NO_BASELINE}" if read else ""
        )

    def stop_recording(self) -> Recorder | None:
        """Close the recording and continue the measurement; from any thread. None: there was no recording.

        Raises
        ------
        RecordingError
            A sample that was read could not be recorded.
        """
        reader = self._started()
        with self._switching:
            recorder = self._recorder
            if self._closed or recorder is None:
                return None
            with self._remarking, reader.lock:
                counters = self.counters
                self._recorded = reader.last.seq if reader.last else None
                self._recorder = None  # before it closes, which takes time: a tare is no mark in it
                reader.record(None)
            recorder.close(lambda: self._counted(counters, recorder))
            if recorder.error:
                self._recorded = None  # the next one has all that is kept
                raise recorder.error
            return recorder

    def note(self, text: str) -> None:
        """Add a note to the recording."""
        with self._remarking:
            if self._recorder:
                self._recorder.note(text)

    def mark(self, text: str, t_s: float | None = None) -> int | None:
        """Add a mark to the recording, at the last sample that was read; of a file, at the one that the caller has.

        Parameters
        ----------
        text : str
        t_s : float, optional
            Another time, s, on the clock of the samples, not before the first one of the recording.

        Returns
        -------
        int or None
            Its number, for `rename_mark`; None: there is no recording.

        Raises
        ------
        ValueError
            The recording began after `t_s`, or has no room for more marks.
        """
        with self._remarking:
            if not self._recorder:
                return None
            if t_s is not None:
                return self._recorder.mark_at(t_s, text)
            seen = None if self.source.live else self._seen
            return self._recorder.mark(text, seen or self._started().last)

    def rename_mark(self, number: int, text: str) -> None:
        """Give a mark of the running recording another text.

        Raises
        ------
        ValueError
            There is no recording, or no such mark in it.
        """
        with self._remarking:
            if not self._recorder:
                raise ValueError(
                    f"mark: got number {number}, allowed: those of a running recording; there is none"
                )
            self._recorder.rename_mark(number, text)

    def _new_recorder(self, path: str | os.PathLike[str], notes: list[str]) -> Recorder:
        settings = {"scene": self.tracker.scene, **self.tracker.settings}
        return Recorder(path, described(self.source), settings, notes, zero_ns=self._zero_ns)

    def _counted(self, counters: StreamCounters, recorder: Recorder) -> dict[str, int]:
        """Return the counters of the samples since the recording began."""
        return counters.since(self._before) | {
            "recorded": recorder.rows,
            "unrecorded": recorder.dropped,
        }

    def stop(self) -> bool:
        """End the iteration after the samples read so far; from any thread or signal handler. False before `with`."""
        self._stop_asked = self._begun
        if self._reader:
            self._reader.stop()
        return self._begun

    def close(self) -> None:
        """Stop within 0.5 s, estimate from the remaining samples, and close the recording and the source.

        If one of these fails, the rest is done, too, and the recording has the error.

        Raises
        ------
        RecordingError
            A sample that was read could not be recorded.
        SourceTimeout
            The source did not stop; its thread still runs, and the source stays open.
        RuntimeError
            Called in the thread of the source, for example in `notify`: use `stop` there.
        Exception
            What `interrupt` or `close` of the source raises.
        """
        self._end(None)

    def _end(self, failure: BaseException | None) -> None:
        reader = self._reader
        if self._closed:
            return
        self._closed = True
        # they run from the last one to the first, each also after an error
        with ExitStack() as steps:
            steps.push(
                lambda _, error, __: self._listeners.ended(failure or error or self._source_error)
            )
            steps.callback(self._raise_unrecorded)
            steps.callback(self._close_source)
            steps.push(
                lambda _, error, __: self._close_recording(failure or error or self._source_error)
            )
            if reader:
                steps.callback(self._feeding.drain)
                reader.end(STOP_S)

    @property
    def _source_error(self) -> BaseException | None:
        return self._reader.error if self._reader else None

    def _close_recording(self, error: BaseException | None) -> None:
        with self._switching:
            if recorder := self._recorder:
                own = error is recorder.error  # the recorder knows it
                told = (
                    None
                    if error is None or own
                    else f"{str(error) or type(error).__name__:.{_LONGEST_ERROR}}"
                )
                recorder.close(lambda: self._counted(self.counters, recorder), told)

    def _close_source(self) -> None:
        if not self._begun:
            self.source.close()
        elif self._reader is None or self._reader.join(0):
            self.source.__exit__(None, None, None)

    def _raise_unrecorded(self) -> None:
        if self._recorder and self._recorder.error and not self._raised:
            raise self._recorder.error

    def _started(self) -> Reader:
        if self._reader is None:
            raise ValueError("stream: not started, allowed: with palpate.Stream(...) as stream")
        return self._reader

    def _next(self, most: int) -> Batch | None:
        """Return the next batch; None: there will be no more."""
        while True:
            closed = self._queue.ring.closed
            if batch := self._feeding.take(most):
                return batch
            if closed or self._closed:
                return None
            self._queue.wait_for_samples(_POLL_S)


def _counters_before(block: Block, now: StreamCounters) -> StreamCounters:
    """Return the counters as they were before the newest samples; what happened beside samples counts from now on."""
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
        refused=now.refused - int(np.count_nonzero(refused_samples(taken))),
        saturated=now.saturated - int(np.count_nonzero(saturated_samples(taken))),
    )
