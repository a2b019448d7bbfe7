"""The files that a run of `palpate live` makes: their names, and reports; nothing is overwritten, no other file is read."""

import re
from datetime import date
from itertools import chain, count
from pathlib import Path
from typing import Any, Literal

from palpate.live.compare import LETTERS
from palpate.live.feed import RefusedCommand
from palpate.messages import quoted
from palpate.recording.sidecar import sidecar_path
from palpate.report import ReportOptions, write_report

Kind = Literal["recording", "settings", "calibration", "report"]
LONGEST = 100  # characters of a name, at most
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9 _.-]*\.csv")
_ALLOWED = f"at most {LONGEST} of A-Z, a-z, 0-9, space, _, . and -, a letter or digit first, and .csv at the end"


class RunFiles:
    """The files of one run of `palpate live`.

    `first` is the first recording, NAME.csv, which begins with the measurement; NAME-2.csv, NAME-3.csv, ... are proposed for the next ones. Without it, names
    with the date are proposed, palpate-2026-11-22-1.csv. `folder`: the folder of `first`, or the present one.

    Examples
    --------
    >>> files = RunFiles("run.csv")
    >>> files.made(files.next(), "recording").name, files.next().name, files.next("gel 1.csv").name
    ('run.csv', 'run-2.csv', 'gel 1.csv')
    >>> files.find("run.json") == Path("run.json"), files.find("../run.csv")
    (True, None)
    """

    def __init__(self, first: Path | str | None = None, folder: Path | str | None = None) -> None:
        self.first: Path | None = None if first is None else Path(first)
        if self.first:
            sidecar_path(self.first)
        self._folder = (
            Path(folder) if folder is not None else self.first.parent if self.first else Path()
        )
        self._made: dict[Path, Kind] = {}
        self._stopped = False
        self.calibration: Path | None = None  # for reports
        self.accept: tuple[str, ...] = ()  # of the calibration, for reports
        self._head: dict[str, Any] = {}  # of reports
        self.progress: str = ""  # of the report that is written
        self.others: list[Path] = []  # recordings to compare with the first one

    def as_dict(self) -> dict[str, Any]:
        """Return what the page shows of them."""
        return {"files": self.named, "progress": self.progress, "comparable": len(self.compared())}

    def compared(self) -> list[Path]:
        """Return the recordings to compare: the first one and the others, else the newest of this run."""
        return self.others or self.recordings()[-len(LETTERS) :]

    @property
    def named(self) -> list[dict[str, str]]:
        """Names and kinds of all files made, in order of time; after each recording its sidecar, the settings."""
        return [{"name": path.name, "kind": kind} for path, kind in self._made.copy().items()]

    def next(self, name: str | None = None) -> Path:
        """Return the path of the next recording; without a name: the proposed one.

        The first is the one that the user gave, even if that file exists. ValueError if the name is not allowed, or there
        is such a file.
        """
        if name is not None:
            if len(name) > LONGEST or not _NAME.fullmatch(name):
                raise ValueError(f"name: got {quoted(name)}, allowed: {_ALLOWED}")
            if not self._is_free(path := self._folder / name):
                raise ValueError(
                    f"name: got {quoted(name)}, and there is such a file; choose another name"
                )
            return path
        if self.first:
            return self.free(self.first.name) if self.recordings() else self.first
        paths = (
            self._folder / f"palpate-{date.today():%Y-%m-%d}-{number}.csv" for number in count(1)
        )
        return next(path for path in paths if self._is_free(path))

    def free(self, name: str) -> Path:
        """Return the path of a new file of this name, with a number behind it if there is such a file."""
        path = self._folder / name
        numbered = (path.with_stem(f"{path.stem}-{number}") for number in count(2))
        return next(each for each in chain([path], numbered) if self._is_free(each))

    def made(self, path: Path, kind: Kind) -> Path:
        """Remember a file that was made, for the page; return its path."""
        self._made[path] = kind
        if kind == "recording":
            self._made[sidecar_path(path)] = "settings"
        return path

    def find(self, name: str) -> Path | None:
        """Return the path of a file of this run; None for any other name."""
        return {path.name: path for path in self._made.copy()}.get(name)

    def settings(self, **head: Any) -> str:
        """Take the settings of later reports: fields of `palpate.report.ReportOptions`."""
        self._head = head
        return ""

    def report(self) -> dict[str, str]:
        """Write a report of the newest recording beside it, also of one that runs; return the answer to the page."""
        if not (recordings := self.recordings()):
            raise RefusedCommand("report: nothing is recorded yet, allowed: after Record")
        if self.progress:
            raise RefusedCommand("report: one is being written; wait for it")
        newest, self._stopped = recordings[-1], False
        path = self.free(f"{newest.stem}-report.html")
        self._tell(newest.name)
        try:
            options = ReportOptions(self.calibration, accept=self.accept, **self._head)
            write_report(path, [newest], options, progress=self._tell)
        except OSError as error:
            raise RefusedCommand(f"report: cannot be written: {error.strerror}") from error
        finally:
            self.progress = ""
        self.made(path, "report")
        return {"message": f"The report is {path.name}.", "file": path.name}

    def stop_report(self) -> str:
        """Stop the report that is written; return the message."""
        self._stopped = True
        return "The report is stopped."

    def _tell(self, progress: str) -> None:
        if self._stopped:
            raise RefusedCommand("report: stopped; nothing is written")
        self.progress = f"Report: {progress}"

    def stated(self, name: str) -> str:
        """Return a field of the settings of reports: probe, site or operator; "": not stated."""
        return str(self._head.get(name, ""))

    def recordings(self) -> list[Path]:
        """Return the recordings, in order of time."""
        return [path for path, kind in self._made.copy().items() if kind == "recording"]

    def _is_free(self, path: Path) -> bool:
        beside = path.with_suffix(".json")
        return (
            path not in self._made
            and not path.exists()
            and (path.suffix != ".csv" or not beside.exists())
        )
