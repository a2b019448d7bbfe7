"""Names of the files that a run of `palpate live` makes; nothing is overwritten, and no other file is read."""

import re
from datetime import date
from pathlib import Path
from typing import Literal

from palpate.errors import quoted
from palpate.recording.sidecar import sidecar_path

Kind = Literal["recording", "settings", "calibration", "report"]
LONGEST = 100
"""Characters of a name, at most."""
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9 _.-]*\.csv")
_ALLOWED = f"at most {LONGEST} of A-Z, a-z, 0-9, space, _, . and -, a letter or digit first, and .csv at the end"


class Recordings:
    """The files of one run of `palpate live`.

    Parameters
    ----------
    first : path-like, optional
        NAME.csv, the first recording; NAME-2.csv, NAME-3.csv, ... are proposed for the next ones. Default: names with the
        date are proposed, palpate-2026-11-22-1.csv.
    folder : path-like, optional
        Where they are made. Default: that of `first`, or the present one.

    Raises
    ------
    ValueError
        The name does not end in ".csv".

    Examples
    --------
    >>> recordings = Recordings("run.csv")
    >>> recordings.next().name, recordings.next().name, recordings.next("gel 1.csv").name
    ('run.csv', 'run-2.csv', 'gel 1.csv')
    >>> recordings.find("run-2.json") == Path("run-2.json"), recordings.find("../run.csv")
    (True, None)
    """

    def __init__(self, first: Path | str | None = None, folder: Path | str | None = None) -> None:
        self._first = None if first is None else Path(first)
        if self._first:
            sidecar_path(self._first)
        self._folder = Path(folder) if folder is not None else self._first.parent if self._first else Path()
        self._made: dict[Path, Kind] = {}

    @property
    def allowed(self) -> bool:
        """Whether the user has given a name: then the first recording begins with the measurement."""
        return self._first is not None

    @property
    def names(self) -> list[str]:
        """Names of the recordings made, in order of time."""
        return [path.name for path, kind in self._made.items() if kind == "recording"]

    @property
    def files(self) -> list[dict[str, str]]:
        """Names and kinds of all files made, in order of time; after each recording its sidecar, the settings."""
        return [{"name": path.name, "kind": kind} for path, kind in self._all().items()]

    @property
    def proposed(self) -> str:
        """The name of the next recording, if no other is wanted."""
        return self._proposed().name

    def next(self, name: str | None = None) -> Path:
        """Return the path of the next recording, and remember it.

        Parameters
        ----------
        name : str, optional
            A file name in the folder. Default: the proposed one; the first is the one that the user gave, even if that
            file exists.

        Raises
        ------
        ValueError
            The name is not allowed, or there is such a file.
        """
        path = self._proposed() if name is None else self._checked(name)
        return self.made(path, "recording")

    def made(self, path: Path, kind: Kind) -> Path:
        """Remember a file that was made, for the page; return its path."""
        self._made[path] = kind
        return path

    def forget(self, path: Path) -> None:
        """Remove a file: it was not made."""
        del self._made[path]

    def find(self, name: str) -> Path | None:
        """Return the path of a file of this run; None for any other name."""
        return {path.name: path for path in self._all()}.get(name)

    def _all(self) -> dict[Path, str]:
        files: dict[Path, str] = {}
        for path, kind in self._made.items():
            files[path] = kind
            if kind == "recording":
                files[sidecar_path(path)] = "settings"
        return files

    def _proposed(self) -> Path:
        if self._first and not self.names:
            return self._first
        stem = self._first.stem if self._first else f"palpate-{date.today():%Y-%m-%d}"
        number = len(self.names) + 1 if self._first else 1
        while not self._is_free(path := self._folder / f"{stem}-{number}.csv"):
            number += 1
        return path

    def _checked(self, name: str) -> Path:
        if len(name) > LONGEST or not _NAME.fullmatch(name):
            raise ValueError(f"record: got the name {quoted(name)}, allowed: {_ALLOWED}")
        if not self._is_free(path := self._folder / name):
            raise ValueError(f"record: got the name {quoted(name)}, and there is such a file; choose another name")
        return path

    def _is_free(self, path: Path) -> bool:
        return path not in self._made and not path.exists() and not sidecar_path(path).exists()
