"""Files that a command reads or writes: the types of its arguments.

A wrong file is an OSError: exit code 4.
"""

import errno
import os
import re
from collections.abc import Callable, Iterable
from glob import escape, glob, has_magic
from itertools import chain
from pathlib import Path
from typing import Any, NamedTuple

import click

from palpate.files import require_file_name

_NO_RECORDING = "moduli.csv"  # `palpate simulate` writes it beside its recordings


class InputFile(click.Path):
    """The type of an argument that is a file to read; with `allow_dash` "-" is standard input."""

    def __init__(self, *, allow_dash: bool = False) -> None:
        super().__init__(dir_okay=False, allow_dash=allow_dash, path_type=Path)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Path:
        """Return the path of a file that can be read."""
        path = Path(value)
        is_standard_input = self.allow_dash and str(path) == "-"
        if not is_standard_input and not path.is_fifo():  # opening a FIFO waits for its writer
            path.open("rb").close()
        return path


class FileArgument(NamedTuple):
    """The files that one argument names."""

    files: list[Path]
    is_pattern: bool
    """Whether it is a folder or a pattern."""


class Recordings(click.Path):
    """The type of an argument that names recordings.

    FILE, a folder with everything below it, or a pattern: `monday/**.csv`.
    """

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the files that an argument names, as `FileArgument`."""
        if not value:
            self.fail("got an empty name, allowed: a file, a folder or a pattern", param, ctx)
        path = Path(value)
        if path.is_dir():
            pattern = f"{escape(path.as_posix())}/**/*"
        elif has_magic(value) and not path.exists():
            # **.csv stands for **/*.csv: in all folders.
            pattern = re.sub(r"(^|/)\*\*(?=[^/*])", r"\1**/*", path.as_posix())
        else:
            return FileArgument([path], is_pattern=False)
        files = _find_recordings(pattern)
        if not files:
            reason = "no recording there, allowed: a folder or pattern with tables, as *.csv"
            raise FileNotFoundError(errno.ENOENT, reason, value)
        return FileArgument(files, is_pattern=True)


def all_files(
    _context: click.Context, _parameter: click.Parameter, arguments: tuple[FileArgument, ...]
) -> tuple[Path, ...]:
    """Return the files of all arguments, each once."""
    files = chain.from_iterable(argument.files for argument in arguments)
    return tuple(dict.fromkeys(files))


def _find_recordings(pattern: str) -> list[Path]:
    """Return the files that may be recordings, sorted; no sidecar, hidden file or repair's copy."""
    from palpate.importers.formats import readable

    names = glob(pattern, recursive=True)  # noqa: PTH207 (Path.glob finds hidden files, too)
    files = []
    for path in sorted(map(Path, names)):
        if readable(path) and path.name != _NO_RECORDING and path.is_file():
            files.append(path)
    return files


class _Output(click.Path):
    """The type of an option that is a file or a folder to write; `require_free` checks it."""

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


def require_free(
    outputs: Iterable[Path], inputs: Iterable[Path] = (), *, force: bool | None
) -> None:
    """Check the names of output files, before anything is computed or a device is opened.

    With `force` None, for a measurement, the error does not propose --force.
    """
    input_files = list(filter(Path.exists, chain.from_iterable(map(with_sidecar, inputs))))
    for path in outputs:
        _require_folder(path.parent)
        require_file_name(path)
        if path.exists() and any(path.samefile(file) for file in input_files):
            raise FileExistsError(errno.EEXIST, "is an input file: choose another name", str(path))
        if path.is_dir():
            raise IsADirectoryError(errno.EISDIR, "is a folder: name a file in it", str(path))
        if os.path.lexists(path) and not force:
            reason = "already exists: choose another name"
            if force is not None:
                reason += ", or use --force"
            raise FileExistsError(errno.EEXIST, reason, str(path))


def with_sidecar(path: Path) -> list[Path]:
    """Return the files of a recording: palpate's own has a sidecar.

    Examples
    --------
    >>> [file.name for file in with_sidecar(Path("run.csv"))]
    ['run.csv', 'run.json']
    """
    from palpate.recording.sidecar import sidecar_path

    if path.suffix.lower() == ".csv":
        return [path, sidecar_path(path)]
    return [path]


def require_free_in(folder: Path, outputs: Iterable[Path], *, force: bool) -> None:
    """Check files in a folder in the same way; a folder that does not exist is made with them."""
    if os.path.lexists(folder):
        require_free(outputs, force=force)
    else:
        _require_folder(next(path for path in folder.parents if path.exists()))


def _require_folder(path: Path) -> None:
    if not path.is_dir():
        reason = "is no folder: make it, or name another one"
        raise NotADirectoryError(errno.ENOTDIR, reason, str(path))
    if not os.access(path, os.W_OK):
        reason = f"cannot be written: {os.strerror(errno.EACCES)}"
        raise PermissionError(errno.EACCES, reason, str(path))
