"""A running measurement: source, queue, tracker, and one recording of it at a time."""

import os
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self, Unpack, cast

from palpate._core import Tracker
from palpate.clocks import Epoch, epoch_at
from palpate.recording.recorder import Recorder, capacity_for
from palpate.recording.sidecar import sidecar_path
from palpate.samples import Instrument, Sample, require_scale, settings_for
from palpate.sources import Source
from palpate.sources import open as open_source
from palpate.sources.base import described
from palpate.stream.batches import Batch, Estimate
from palpate.stream.buffers import Backlog, SampleQueue
from palpate.stream.counters import StreamCounters, current_counters
from palpate.stream.listeners import Listener, Listeners
from palpate.stream.pipeline import Pipeline
from palpate.stream.reader import Reader
from palpate.stream.recording_control import RecordingControl
from palpate.touch import Touch

if TYPE_CHECKING:
    from palpate._core import _AnySettings, _Scene

STOP_S = 0.5
_BATCH = 1024  # samples at a time, at most
# how late the consumer may be, in seconds and in samples
_LAG_S = 1.0
_LEAST = 4096
_POLL_S = 0.1  # on Windows a wait hears Ctrl-C at its end only


class Stream:
    """A running measurement: one thread reads the source, the caller's thread estimates.

    Parameters
    ----------
    source : str or Source
        A name for `palpate.open`, or a source. The stream closes it, also if the stream cannot
        start.
    tracker : Tracker, optional
        Default: ``Tracker(scene, **settings)`` with the full scale of the source. A tracker of your
        own without `full_scale` counts saturated samples as refused.
    scene : str
    unit : str, optional
        As in `palpate.read`; for a name of a file, a serial port or a stream. Default: as the
        source says, else pF.
    record : path-like, optional
        NAME.csv: every sample is written there, also if the consumer is too slow. NAME.json has the
        description.
    capacity : int, optional
        Most samples that wait for the consumer; more are dropped and counted. A file waits for the
        consumer. Default: the samples of a second, at least 4096.
    keep : int, optional
        How many of the newest samples are kept in memory, 1024 to 2**24, so that a recording that
        is started later can begin with them: see `start_recording`. Default: none.
    outlives_recording : bool
        Go on without a recording whose file is removed or changed; `stop_recording` then raises its
        error. Default: its error ends the measurement. A disk that fails or is full ends neither:
        see `Recorder`.
    notes : list of str, optional
        Notes in the recording.
    notify : callable, optional
        Called with a message when a device is unplugged or back, when the baseline is found to be
        wrong or is measured again, when a channel is outside the range of the converter without a
        touch, and when a recording or a listener fails.
    **settings
        As in `Tracker`.

    Attributes
    ----------
    source : Source
    tracker : Tracker

    Raises
    ------
    ValueError, TypeError, SourceError, RecordingError, MissingExtra
        As from `palpate.open` and `Tracker`. `with` raises RecordingError if the recording already
        exists. The iteration raises the error of the source, after its last sample; ProtocolError
        at a sample that cannot be stored.

    Notes
    -----
    `palpate.touches` computes from the recording, with the same settings, the same touches as the
    stream, bit for bit, if no sample was dropped.

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
            if isinstance(source, Source):
                on_failure.callback(source.close)
            elif not isinstance(source, str):
                raise TypeError(f"source: got {source!r:.60}, allowed: a name, or a palpate.Source")
            if tracker is None:
                Tracker(scene, **cast(Any, settings))  # before a device is opened
            elif settings:
                raise ValueError(
                    f"settings: got {', '.join(settings)} and a tracker, allowed: only one of them"
                )
            if record is not None:
                sidecar_path(Path(record))
            queue = None if capacity is None else SampleQueue(capacity)
            backlog = None if keep is None else Backlog(keep)
            if isinstance(source, str):
                options = {} if unit is None else {"unit": unit}
                source = open_source(source, **options)
                on_failure.callback(source.close)
            elif unit is not None:
                raise ValueError(
                    f"unit: got {unit!r} and a source, allowed: with a name; "
                    "palpate.open takes it, too"
                )
            self.source: Source = source
            self._listeners = Listeners(notify or source.notify)
            source.notify = self._listeners.message
            instrument = Instrument.of(described(source))
            if tracker is None:
                require_scale(scene, instrument.unit, settings)
                complete: Any = settings_for(scene, instrument) | settings
                tracker = Tracker(scene, **complete)
            self.tracker: Tracker = tracker
            if queue is None:
                queue = SampleQueue(capacity_for(instrument.period_s, _LAG_S, _LEAST))
            on_failure.pop_all()
        self._queue = queue
        self._pipeline = Pipeline(queue, tracker, self._listeners)
        self._reader = Reader(source, queue, backlog, outlives=outlives_recording)
        self._first_recording = (record, notes or [])
        self._recording = RecordingControl(
            source,
            tracker,
            self._reader,
            backlog,
            lambda: self.counters,
            self._listeners.message,
        )
        self._seen: Sample | None = None  # by the caller, of a source that waits for the caller
        self._begun = False
        self._stop_requested = False
        self._raised = False

    def __repr__(self) -> str:
        """Return the state of the measurement, in one line."""
        from palpate.display.text import stream_line

        return stream_line(self)

    def _repr_html_(self) -> str:
        from palpate.display.cards import stream_card

        return stream_card(self)

    def __enter__(self) -> Self:
        """Begin the measurement."""
        if self._recording.is_ended or self._begun:
            raise ValueError(
                "stream: got a second `with`, or one after close(), "
                "allowed: one `with` for each stream"
            )
        try:
            self.source.__enter__()
            self._begun = True  # from here on there may be a recording to close
            device = described(self.source)
            self._listeners.opened(device)
            path, notes = self._first_recording
            if path is not None:
                self._recording.start(path, notes)
            self._listeners.begun(self)
            self._reader.start(device)
            if self._stop_requested:
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
        """Return an estimate after each sample.

        Of a file, `tare` in the loop is at this sample, in each run.
        """
        for batch in self._batches(_BATCH if self.source.live else 1):
            for estimate in batch.estimates():
                self._seen = estimate.sample
                yield estimate

    def batches(self) -> Iterator[Batch]:
        """Return samples and estimates as arrays: all samples that wait, or the next ones."""
        return self._batches(_BATCH)

    def _batches(self, limit: int) -> Iterator[Batch]:
        self._require_started()
        while batch := self._next(limit):
            self._seen = self._pipeline.last
            yield batch
        last = self._pipeline.finish()
        if last:
            yield last
        error = self._reader.error
        if error is not None and not self._raised:
            self._raised = True
            raise error

    def _next(self, limit: int) -> Batch | None:
        """Return the next batch; None: there will be no more."""
        while True:
            is_last = self._queue.ring.closed or self._recording.is_ended
            batch = self._pipeline.take(limit)
            if batch or is_last:
                return batch
            self._queue.wait_for_samples(_POLL_S)

    def _require_started(self) -> None:
        if not self._reader.is_started:
            raise ValueError("stream: not started, allowed: with palpate.Stream(...) as stream")

    @property
    def touches(self) -> list[Touch]:
        """All touches that have ended, in order of time; revised ones replace the first results."""
        return self._pipeline.touches

    @property
    def counters(self) -> StreamCounters:
        """Numbers of samples so far; may be read from any thread."""
        if not self._reader.is_started:
            return StreamCounters()
        of_source = self.source.counters
        return current_counters(self._reader, self._pipeline, self._queue, self.recorder, of_source)

    @property
    def epoch(self) -> Epoch | None:
        """The time t = 0 on the clocks of the computer.

        None: there is no sample yet, or the times are not those of a clock.
        """
        zero_ns = self._reader.zero_ns
        return None if zero_ns is None else epoch_at(zero_ns)

    @property
    def error(self) -> BaseException | None:
        """The error that ended the source; None: it has not ended, or it has none."""
        return self._reader.error

    @property
    def out_of_range(self) -> tuple[str, ...]:
        """The channels outside the converter's range without a touch; see `centre`."""
        return self._pipeline.range.channels

    def centre(self, *, force: bool = False) -> None:
        """Set the range of the converter again, around the signal without contact.

        May be called from any thread. The source does it before its next sample (a simulation
        without `speed` is read ahead, by up to 2048 samples, with `capacity` 2 by as few). It is a
        gap: the baseline is measured again, and the recording has a mark with the CAPDACs.

        Parameters
        ----------
        force : bool
            Also in contact: after a jump of the baseline, which looks like a touch without end.

        Raises
        ------
        RuntimeError
            The probe is in contact, and `force` is False; or the source cannot set its range.
        """
        in_contact = self.tracker.state in ("contact", "done")
        if in_contact and not force and not self.out_of_range:
            raise RuntimeError(
                "centre: got it in contact, allowed: without contact. Lift the probe, or force=True"
            )
        self.source.centre()

    def tare(self, *, force: bool = False) -> None:
        """Measure the baseline again, and mark it in the recording; from the thread that iterates.

        Parameters
        ----------
        force : bool
            As in `centre`.

        Raises
        ------
        RuntimeError
            The probe is in contact, and `force` is False.
        """
        with self._pipeline.lock:
            self._recording.tare(self._pipeline.last, force=force)

    @property
    def recorder(self) -> Recorder | None:
        """The recorder; None: no recording."""
        return self._recording.recorder

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
            Begin with the samples that are kept (`keep` of the stream), but for those that the
            recording before has. If they begin with the measurement, a replay has the same touches,
            bit for bit. Else the recording begins with a tare mark: a replay measures the baseline
            there, so touches may differ until the baseline is measured again after a release, a
            tare or a gap; later ones have the same bits (with times of the computer: they agree
            within their uncertainty). A note in the recording says so.

            False: begin with the next sample. A replay measures the baseline there: begin without
            contact.

        Raises
        ------
        ValueError, RecordingError
            A recording is running, the stream has ended, the file exists, or no samples are kept.
        """
        self._require_started()
        return self._recording.start(record, notes or [], earlier=earlier)

    def stop_recording(self) -> Recorder | None:
        """Close the recording and continue the measurement; from any thread. None: there was none.

        Raises
        ------
        RecordingError
            A sample that was read could not be recorded.
        """
        self._require_started()
        return self._recording.stop()

    def note(self, text: str) -> None:
        """Add a note to the recording."""
        self._recording.note(text)

    def mark(self, text: str, t_s: float | None = None) -> int | None:
        """Add a mark to the recording, at the last sample that was read.

        Of a file: at the sample that the caller has.

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
        sample = self._reader.last
        if self._seen and not self.source.live:
            sample = self._seen
        return self._recording.mark(text, sample, t_s)

    def rename_mark(self, number: int, text: str) -> None:
        """Give a mark of the running recording another text.

        Raises
        ------
        ValueError
            There is no recording, or no such mark in it.
        """
        self._recording.rename_mark(number, text)

    def stop(self) -> bool:
        """End the iteration after the samples read so far; return False before `with`.

        May be called from any thread or signal handler.
        """
        self._stop_requested = self._begun
        if self._reader.is_started:
            self._reader.stop()
        return self._begun

    def close(self) -> None:
        """Stop within 0.5 s, estimate from the remaining samples, close recording and source.

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
        if self._recording.is_ended:
            return
        self._recording.is_ended = True
        # they run from the last one to the first, each also after an error
        with ExitStack() as steps:
            steps.push(
                lambda _, error, __: self._listeners.ended(failure or error or self._reader.error)
            )
            steps.callback(self._raise_unrecorded)
            steps.callback(self._close_source)
            steps.push(
                lambda _, error, __: self._recording.close(failure or error or self._reader.error)
            )
            if self._reader.is_started:
                steps.callback(self._pipeline.drain)
                self._reader.end(STOP_S)

    def _close_source(self) -> None:
        if not self._begun:
            self.source.close()
        elif self._reader.join(0):
            self.source.__exit__(None, None, None)

    def _raise_unrecorded(self) -> None:
        recorder = self.recorder
        if recorder and recorder.error and not self._raised:
            raise recorder.error
