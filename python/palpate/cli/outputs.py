"""Files that a command writes: one that exists is replaced only with --force, an input never."""

import errno
import os
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import click

force_option: Callable[[Callable[..., Any]], Callable[..., Any]] = click.option(
    "--force", is_flag=True, help="Replace existing files."
)
"""Adds force to a command."""


def require_free(outputs: Iterable[Path], inputs: Iterable[Path] = (), *, force: bool) -> None:
    """Check the names of output files, before anything is computed.

    Raises
    ------
    FileExistsError
        A file of this name exists, and `force` is False; or it is an input, or the sidecar of one.
    click.UsageError
        Two outputs have the same name.
    """
    from palpate.recording.sidecar import sidecar_path

    read, chosen = list(inputs), set[Path]()
    read += [sidecar_path(path) for path in read if path.suffix.lower() == ".csv"]
    for path in outputs:
        if path.exists() and any(one.exists() and path.samefile(one) for one in read):
            raise FileExistsError(errno.EEXIST, "is an input file: choose another name", str(path))
        if path.resolve() in chosen:
            raise click.UsageError(f"got {path} for two files, allowed: another name for each")
        if os.path.lexists(path) and not force:
            raise FileExistsError(errno.EEXIST, "already exists: choose another name, or use --force", str(path))
        chosen.add(path.resolve())
