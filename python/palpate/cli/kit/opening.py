"""The board that the commands of `palpate kit` open."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from palpate.cli.inputs import InputFile
from palpate.cli.source import SourceType

if TYPE_CHECKING:
    from palpate.kit.bench import Bench

_ADDED = (
    click.argument("source", type=SourceType(), default="usb:"),
    click.option(
        "--firmware",
        type=InputFile(),
        help="Firmware file of the evaluation kit.",
    ),
)


def board_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add source and firmware to a command."""
    for option in reversed(_ADDED):
        command = option(command)
    return command


@contextmanager
def opened(source: str, firmware: Path | None) -> "Iterator[Bench]":
    """Open a board, and close it in the end."""
    from palpate.kit.bench import open_bench

    try:
        bench = open_bench(source, {"firmware": str(firmware)} if firmware else {})
    except ValueError as error:
        raise click.UsageError(str(error).split("\n")[0]) from error
    try:
        yield bench
    finally:
        bench.source.close()
