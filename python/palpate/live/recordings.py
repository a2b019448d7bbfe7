"""Names of the files that a page may write: in one folder, of one form, and never over another file."""

import re
from datetime import date
from pathlib import Path
from typing import Any

from palpate.errors import quoted
from palpate.recording.sidecar import sidecar_path

_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9 _.-]{0,99}\.csv")


class Recordings:
    """x."""

    def __init__(self, first: Path | str | None = None, folder: Path | str | None = None) -> None:
        self._first = None if first is None else Path(first)
        if self._first:
            sidecar_path(self._first)
        self._folder = Path(folder) if folder else (self._first.parent if self._first else Path())
        self._made: list[tuple[Path, str]] = []

    @property
    def named(self) -> bool:
        """Whether the user has named the first recording."""
        return self._first is not None

    def proposed(self) -> str:
        """Return the name of the next recording."""
        if self._first and not self._made:
            return self._first.name
        stem = self._first.stem if self._first else f"palpate-{date.today().isoformat()}"
        number = 2 if self._first else 1
        while self._is_taken(self._folder / f"{stem}-{number}.csv"):
            number += 1
        return f"{stem}-{number}.csv"

    def _is_taken(self, path: Path) -> bool:
        return path.exists() or sidecar_path(path).exists() or any(path == known for known, _ in self._made)

    def next(self, name: str | None = None) -> Path:
        """Return the path."""
        path = self._folder / (name or self.proposed())
        if name and not _NAME.fullmatch(name):
            raise ValueError(f"name: got {quoted(name)}, allowed: letters, digits ... that ends in .csv")
        if name and self._is_taken(path):
            raise ValueError(f"name: got {quoted(name)}, which exists, allowed: a new name")
        self.made(path, "recording")
        self.made(sidecar_path(path), "settings")
        return path

    def made(self, path: Path, kind: str) -> None:
        self._made.append((path, kind))

    def forget(self, path: Path) -> None:
        self._made = [each for each in self._made if each[0] not in (path, sidecar_path(path))]

    @property
    def files(self) -> list[dict[str, Any]]:
        return [{"name": path.name, "kind": kind} for path, kind in self._made]

    def find(self, name: str) -> Path | None:
        return next((path for path, _ in self._made if path.name == name), None)
