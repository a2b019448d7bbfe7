"""Names of the recordings: the name from the user, then the same name with a number. No other file is written."""

from pathlib import Path

from palpate.recording.sidecar import sidecar_path


class Recordings:
    """The recordings of one run of `palpate live`.

    Parameters
    ----------
    first : path-like or None
        NAME.csv; the next ones are NAME-2.csv, NAME-3.csv, ... None: recording is not allowed.

    Raises
    ------
    ValueError
        The name does not end in ".csv".

    Examples
    --------
    >>> recordings = Recordings("run.csv")
    >>> recordings.next().name, recordings.next().name
    ('run.csv', 'run-2.csv')
    >>> recordings.find("run-2.json") == Path("run-2.json"), recordings.find("../run.csv")
    (True, None)
    """

    def __init__(self, first: Path | str | None) -> None:
        self._first = None if first is None else Path(first)
        if self._first:
            sidecar_path(self._first)
        self._made: list[Path] = []

    @property
    def allowed(self) -> bool:
        """Whether recording is allowed: the user has given a name."""
        return self._first is not None

    @property
    def names(self) -> list[str]:
        """Names of the recordings made, in order of time."""
        return [path.name for path in self._made]

    def next(self) -> Path:
        """Return the next free name, and remember it. The first is the given name, even if that file exists.

        Raises
        ------
        ValueError
            The user has not given a name.
        """
        if self._first is None:
            raise ValueError("record: no file name; start palpate live with --record NAME.csv to allow it")
        path, number = self._first, len(self._made) + 1
        while number > 1:
            path = self._first.with_name(f"{self._first.stem}-{number}{self._first.suffix}")
            if not (path.exists() or sidecar_path(path).exists()):
                break
            number += 1
        self._made.append(path)
        return path

    def forget(self, path: Path) -> None:
        """Remove a name: its recording was not made."""
        self._made.remove(path)

    def find(self, name: str) -> Path | None:
        """Return the path of a recording of this run, or of its sidecar; None for any other name."""
        files = {file.name: file for path in self._made for file in (path, sidecar_path(path))}
        return files.get(name)
