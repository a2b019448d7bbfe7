"""Files that a command writes: one that exists is replaced only with --force, an input never."""

import errno
import os
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import click

from palpate.systems import require_file_name


class _Output(click.Path):
    """The type of an option that is a file or a folder to write; `require_free` says what is wrong with it."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Path:
        return Path(value)


OUTPUT = _Output(dir_okay=False)
"""A file to write."""
OUTPUT_FOLDER = _Output(file_okay=False)
"""A folder to write files in."""
force_option: Callable[[Callable[..., Any]], Callable[..., Any]] = click.option(
    "--force", is_flag=True, help="Replace existing files."
)
"""Adds force to a command."""


def require_free(outputs: Iterable[Path], inputs: Iterable[Path] = (), *, force: bool | None) -> None:
    """Check the names of output files, before anything is computed or a device is opened.

    Parameters
    ----------
    outputs, inputs : iterable of pathlib.Path
    force : bool or None
        Whether files are replaced; None: a measurement, which is never replaced.

    Raises
    ------
    OSError
        A file of this name exists, and `force` is not True; it is an input, or the sidecar of one; it is a folder; or its
        folder does not exist, or may not be written.
    click.UsageError
        Two outputs have the same name.
    """
    read, chosen = [file for path in inputs for file in with_sidecar(path)], set[Path]()
    for path in outputs:
        _require_folder(path.parent)
        require_file_name(path)
        if path.exists() and any(one.exists() and path.samefile(one) for one in read):
            raise FileExistsError(errno.EEXIST, "is an input file: choose another name", str(path))
        place = path.parent.resolve() / path.name  # a link is replaced, not what it points to
        if place in chosen:
            raise click.UsageError(f"got {path} for two files, allowed: another name for each")
        if path.is_dir():
            raise IsADirectoryError(errno.EISDIR, "is a folder: name a file in it", str(path))
        if os.path.lexists(path) and not force:
            how = "" if force is None else ", or use --force"
            raise FileExistsError(errno.EEXIST, f"already exists: choose another name{how}", str(path))
        chosen.add(place)


def with_sidecar(path: Path) -> list[Path]:
    """Return the files of a recording: palpate's own has a sidecar.

    Examples
    --------
    >>> [file.name for file in with_sidecar(Path("run.csv"))]
    ['run.csv', 'run.json']
    """
    from palpate.recording.sidecar import sidecar_path

    return [path, sidecar_path(path)] if path.suffix.lower() == ".csv" else [path]


def require_free_in(folder: Path, outputs: Iterable[Path], *, force: bool) -> None:
    """Check the same of files in a folder that is made with them, if it does not exist."""
    if os.path.lexists(folder):
        require_free(outputs, force=force)
    else:
        _require_folder(next(path for path in folder.parents if path.exists()))


def _require_folder(path: Path) -> None:
    if not os.path.lexists(path):
        raise FileNotFoundError(errno.ENOENT, "no such folder: make it, or name another one", str(path))
    if not path.is_dir():
        path.stat()  # says why not, if it is a link to nothing
        raise NotADirectoryError(errno.ENOTDIR, "is a file: name a folder", str(path))
    if not os.access(path, os.W_OK):
        raise PermissionError(errno.EACCES, f"cannot be written: {os.strerror(errno.EACCES)}", str(path))
