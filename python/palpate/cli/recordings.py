"""The recordings that a command line names: files, folders, and patterns that the shell did not expand."""

import errno
import re
from glob import has_magic
from pathlib import Path
from typing import Any, NamedTuple

import click

_NO_RECORDING = "moduli.csv"  # which `palpate simulate` writes beside its recordings


class Named(NamedTuple):
    """The files that one argument names; `several`: it may be any number of them."""

    files: list[Path]
    several: bool


class Recordings(click.Path):
    """The type of such an argument: FILE, a folder with all below it, or a pattern: `monday/*.csv`, `**/*.csv`."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the files that an argument names."""
        if not value:
            self.fail("got an empty name, allowed: a file, a folder or a pattern", param, ctx)
        path = Path(value)
        if path.is_dir():
            found = _recordings(path, "**/*")
        elif has_magic(value) and not path.exists():
            found = _recordings(*_divided(path))
        else:
            return Named([path], several=False)
        if not found:
            reason = "no recording there, allowed: a folder or pattern with tables, as *.csv"
            raise FileNotFoundError(errno.ENOENT, reason, value)
        return Named(found, several=True)


def _recordings(folder: Path, pattern: str) -> list[Path]:
    """Return the files that may be recordings, sorted: no sidecars, nothing hidden, nothing that a repair put aside."""
    from palpate.tables.formats import readable

    return sorted(
        path
        for path in folder.glob(pattern)
        if readable(path)
        and not any(part.startswith(".") for part in path.relative_to(folder).parts)
        and path.name != _NO_RECORDING
        and path.is_file()
    )


def _divided(pattern: Path) -> tuple[Path, str]:
    """Return the folder without wildcards, and the rest; the stars of `**.csv` stand for folders, too.

    Examples
    --------
    >>> folder, rest = _divided(Path("runs/monday/**.csv"))
    >>> folder.parts, rest
    (('runs', 'monday'), '**/*.csv')
    """
    first = next(number for number, part in enumerate(pattern.parts) if has_magic(part))
    rest = "/".join(pattern.parts[first:])
    return Path(*pattern.parts[:first]), re.sub(r"(^|/)\*\*(?=[^/*])", r"\1**/*", rest)
