"""The files that a run of `palpate live` makes: their names, and reports; nothing is overwritten, no other file is read."""

import re
from copy import copy
from datetime import date
from pathlib import Path
from typing import Literal

from palpate.live.page_commands import SettingsCommand
from palpate.live.protocol import RefusedCommand, RunFile
from palpate.messages import quoted
from palpate.recording.sidecar import sidecar_path
from palpate.report import ReportOptions, write_report

FileKind = Literal["recording", "settings", "calibration", "report"]
MOST_COMPARED = 4  # recordings beside each other
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
        self.first: Path | None = None
        self._folder = Path()
        if first is not None:
            self.first = Path(first)
            sidecar_path(self.first)
            self._folder = self.first.parent
        if folder is not None:
            self._folder = Path(folder)
        self._made: dict[Path, FileKind] = {}
        self._stopped = False
        self.calibration: Path | None = None  # for reports
        self.accept: tuple[str, ...] = ()  # of the calibration, for reports
        self._settings = SettingsCommand()  # of reports
        self.progress: str = ""  # of the report that is written
        self.others: list[Path] = []  # recordings to compare with the first one

    def again(self) -> "RunFiles":
        """Return the files for another measurement of this run: it knows those that were made."""
        files = copy(self)
        files.progress = ""
        return files

    def compared(self) -> list[Path]:
        """Return the recordings to compare: the first one and the others, else the newest of this run."""
        return self.others or self.recordings()[-MOST_COMPARED:]

    @property
    def named(self) -> list[RunFile]:
        """Names and kinds of all files made, in order of time; after each recording its sidecar, the settings."""
        return [RunFile(path.name, kind) for path, kind in self._made.copy().items()]

    def next(self, name: str | None = None) -> Path:
        """Return the path of the next recording; without a name: the proposed one.

        The first is the one that the user gave, even if that file exists. ValueError if the name is not allowed, or there
        is such a file.
        """
        if name is not None:
            return self._checked(name)
        if self.first and not self.recordings():
            return self.first
        if self.first:
            return self.free(self.first.name)
        number = 1
        while True:
            path = self._folder / f"palpate-{date.today():%Y-%m-%d}-{number}.csv"
            if self._is_free(path):
                return path
            number += 1

    def _checked(self, name: str) -> Path:
        """Return the path of a name that the user has chosen."""
        if len(name) > LONGEST or not _NAME.fullmatch(name):
            raise ValueError(f"name: got {quoted(name)}, allowed: {_ALLOWED}")
        path = self._folder / name
        if not self._is_free(path):
            raise ValueError(
                f"name: got {quoted(name)}, and there is such a file; choose another name"
            )
        return path

    def free(self, name: str) -> Path:
        """Return the path of a new file of this name, with a number behind it if there is such a file."""
        path = self._folder / name
        stem = path.stem
        number = 2
        while not self._is_free(path):
            path = path.with_stem(f"{stem}-{number}")
            number += 1
        return path

    def made(self, path: Path, kind: FileKind) -> Path:
        """Remember a file that was made, for the page; return its path."""
        self._made[path] = kind
        if kind == "recording":
            self._made[sidecar_path(path)] = "settings"
        return path

    def find(self, name: str) -> Path | None:
        """Return the path of a file of this run; None for any other name."""
        found = None
        for path in self._made.copy():
            if path.name == name:
                found = path
        return found

    def use_settings(self, settings: SettingsCommand) -> None:
        """Take the settings of later reports."""
        self._settings = settings

    def report(self) -> str:
        """Write a report of the newest recording beside it, also of one that runs; return its name."""
        recordings = self.recordings()
        if not recordings:
            raise RefusedCommand("report: nothing is recorded yet, allowed: after Record")
        if self.progress:
            raise RefusedCommand("report: one is being written; wait for it")
        newest = recordings[-1]
        self._stopped = False
        path = self.free(f"{newest.stem}-report.html")
        self._show_progress(newest.name)
        try:
            write_report(path, [newest], self._options(), progress=self._show_progress)
        except OSError as error:
            raise RefusedCommand(f"report: cannot be written: {error.strerror}") from error
        finally:
            self.progress = ""
        self.made(path, "report")
        return path.name

    def _options(self) -> ReportOptions:
        settings = self._settings
        return ReportOptions(
            self.calibration,
            accept=self.accept,
            unit=settings.unit,
            shore=settings.shore,
            probe=settings.probe,
            site=settings.site,
            operator=settings.operator,
        )

    def stop_report(self) -> str:
        """Stop the report that is written; return the message."""
        self._stopped = True
        return "The report is stopped."

    def _show_progress(self, progress: str) -> None:
        if self._stopped:
            raise RefusedCommand("report: stopped; nothing is written")
        self.progress = f"Report: {progress}"

    @property
    def settings(self) -> SettingsCommand:
        """The settings of reports, as the user has stated them: probe, site, operator and unit."""
        return self._settings

    def recordings(self) -> list[Path]:
        """Return the recordings, in order of time."""
        return [path for path, kind in self._made.copy().items() if kind == "recording"]

    def _is_free(self, path: Path) -> bool:
        if path in self._made or path.exists():
            return False
        sidecar = path.with_suffix(".json")
        return path.suffix != ".csv" or not sidecar.exists()
