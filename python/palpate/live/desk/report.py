"""The button Report: a report of the newest recording, beside it."""

from collections.abc import Callable, Sequence
from pathlib import Path
from threading import Lock
from typing import Any

from palpate.live.protocol import Command, Refused
from palpate.live.recordings import Recordings

MOST = 50
"""Reports of one run."""
Writing = Callable[[Path, Sequence[Path], Path | None], object]


class Report:
    """Writes reports of recordings, also of the one that runs: what is on the disk so far.

    Parameters
    ----------
    recordings : Recordings
    write : callable
        Takes the path of the report, the recordings, and the file of the calibration or None; writes the report.
    calibration : callable
        Returns the file of the calibration in use, or None.

    Attributes
    ----------
    orders : dict
        Name of a command -> function; it takes seconds.
    """

    def __init__(self, recordings: Recordings, write: Writing, calibration: Callable[[], Path | None]) -> None:
        self.orders: dict[str, Callable[[Command], dict[str, Any]]] = {"report": lambda _: self._do_report()}
        self._recordings, self._write, self._calibration = recordings, write, calibration
        self._writing = Lock()

    def _do_report(self) -> dict[str, Any]:
        recordings = [found for name in self._recordings.names if (found := self._recordings.find(name))]
        if not recordings:
            raise Refused("report: nothing is recorded yet, allowed: after Record")
        if not self._writing.acquire(blocking=False):
            raise Refused("report: one is being written; wait for it")
        try:
            path = _free(recordings[-1])
            self._write(path, recordings[-1:], self._calibration())
            self._recordings.made(path, "report")
        except OSError as error:
            raise Refused(f"report: cannot be written: {error.strerror}") from error
        finally:
            self._writing.release()
        return {"message": f"The report is {path.name}.", "file": path.name}


def _free(recording: Path) -> Path:
    """Return a name that no file has: NAME-report.html, then NAME-report-2.html."""
    numbers = ("", *(f"-{number}" for number in range(2, MOST + 1)))
    paths = (recording.with_name(f"{recording.stem}-report{number}.html") for number in numbers)
    path = next((path for path in paths if not path.exists()), None)
    if path is None:
        raise Refused(f"report: got {MOST} reports of {recording.name}, allowed: no more; move them away")
    return path
