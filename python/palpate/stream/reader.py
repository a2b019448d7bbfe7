"""The thread that reads a source, independent of the disk and of the consumer."""

from collections.abc import Callable
from contextlib import suppress
from threading import Thread, current_thread
from typing import Any

from palpate.errors import ProtocolError, SourceTimeout
from palpate.sources import Source
from palpate.sources.blocks import blocks_of
from palpate.stream.intake import Intake
from palpate.stream.limited import ended, limited
from palpate.stream.waiting import Waiting


class Reader:
    """Reads a source in a thread, in blocks if it can.

    Parameters
    ----------
    source : Source
        After `__enter__`.
    intake : Intake
        Gets the samples.
    waiting : Waiting
        Closed at the end of the source.

    Attributes
    ----------
    intake : Intake
    error : BaseException or None
        The error that ended the thread.
    """

    def __init__(self, source: Source, intake: Intake, waiting: Waiting) -> None:
        self.intake = intake
        self.error: BaseException | None = None
        self._source, self._waiting = source, waiting
        self._thread = Thread(target=self._run, name="palpate-reader", daemon=True)

    @property
    def is_this_thread(self) -> bool:
        """Whether the caller is the thread that reads."""
        return self._thread is current_thread()

    def start(self) -> None:
        """Start the thread."""
        self._thread.start()

    def stop(self) -> None:
        """Request the end; returns at once. Later samples are neither counted nor stored."""
        self.intake.stop()
        self._source.interrupt()

    def end(self, limit_s: float) -> None:
        """Request the end, and wait for it.

        Raises
        ------
        SourceTimeout
            The source did not stop within this time; its thread still runs.
        Exception
            What its `interrupt` raises.
        """
        what = "the source did not stop"
        try:
            limited(self.stop, limit_s, what)
        finally:
            if not self.join(limit_s):
                raise SourceTimeout(f"{what} within {limit_s:g} s; it still runs")

    def join(self, timeout_s: float) -> bool:
        """Wait for the end; return whether the thread has ended."""
        if self._thread.ident is not None:
            ended(self._thread, timeout_s)
        with self.intake.lock:  # a sample that is being stored is complete now
            return not self._thread.is_alive()

    def _run(self) -> None:
        try:
            self._read()
        except BaseException as error:  # noqa: BLE001  the consumer gets any error of a source
            self.error = _told(error)
        finally:
            self._finish()
            self._waiting.close()

    def _read(self) -> None:
        blocks = blocks_of(self._source)
        take: Callable[[Any], None] = self.intake.take if blocks is None else self.intake.take_block
        for each in self._source if blocks is None else blocks:
            take(each)
            if self.intake.stopping.is_set():
                return

    def _finish(self) -> None:
        """Pass on what the source measured at its end."""
        with self.intake.lock:
            try:
                self.intake.pass_conditions()
            except ProtocolError as error:
                self.error = self.error or error


def _told(error: BaseException) -> BaseException:
    """Return the error of a source; another one for it, if it cannot be printed or a generator cannot raise it."""
    with suppress(Exception):  # of the error's own text
        str(error)
        if not isinstance(error, StopIteration):
            return error
    told = ProtocolError(f"source: raised {type(error).__name__}, allowed: an error with a text, SourceError")
    told.__cause__ = error
    return told
