"""Where recordings go: to the name the user gave, and to numbered ones beside it. Nowhere else."""

from pathlib import Path

from palpate.recording.sidecar import sidecar_path


class Recordings:
    """The recordings of one run of the page.

    Parameters
    ----------
    first : path-like or None
        NAME.csv; those that follow are NAME-2.csv, NAME-3.csv, ... None: nothing may be recorded.

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
        """Whether the user has said where."""
        return self._first is not None

    @property
    def names(self) -> list[str]:
        """Of those that were made, in order of time."""
        return [path.name for path in self._made]

    def next(self) -> Path:
        """Return the next name that is free, and remember it. The first is as given, whatever is there.

        Raises
        ------
        ValueError
            The user has not said where.
        """
        if self._first is None:
            raise ValueError("record: got no name, allowed: a recording where `palpate live` has --record NAME.csv")
        path, number = self._first, len(self._made) + 1
        while number > 1:
            path = self._first.with_name(f"{self._first.stem}-{number}{self._first.suffix}")
            if not (path.exists() or sidecar_path(path).exists()):
                break
            number += 1
        self._made.append(path)
        return path

    def forget(self, path: Path) -> None:
        """Take back the last name: nothing was made."""
        self._made.remove(path)

    def find(self, name: str) -> Path | None:
        """Return where a recording of this run is, or its sidecar, by its bare name; None for any other name."""
        files = {file.name: file for path in self._made for file in (path, sidecar_path(path))}
        return files.get(name)
