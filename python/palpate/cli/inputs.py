"""Files that a command reads."""

import errno
import os
from itertools import islice
from pathlib import Path
from typing import Any

import click

from palpate.errors import nearest

_MOST_NAMES = 10_000  # of a folder that are compared with a wrong name


class InputFile(click.Path):
    """The type of an argument that is a file to read.

    What is wrong with the file is an OSError, as when it is found later: the command ends with the same exit code.

    Parameters
    ----------
    allow_dash : bool
        "-" is standard input.
    """

    def __init__(self, *, allow_dash: bool = False) -> None:
        super().__init__(dir_okay=False, allow_dash=allow_dash, path_type=Path)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Path:
        """Return the path of a file that can be read."""
        path = Path(value)
        if not (self.allow_dash and str(path) == "-"):
            _require(path)
        return path


def _require(path: Path) -> None:
    try:
        path.stat()
    except FileNotFoundError as error:
        raise FileNotFoundError(error.errno, f"{error.strerror}{_like(path)}", str(path)) from error
    if path.is_dir():
        raise IsADirectoryError(errno.EISDIR, "is a folder: name a file", str(path))
    if not os.access(path, os.R_OK):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(path))


def _like(path: Path) -> str:
    """Return the end of the message: the file of the same folder that is most like one that is not there."""
    try:
        return nearest(path.name, [there.name for there in islice(path.parent.iterdir(), _MOST_NAMES)])
    except OSError:
        return ""
