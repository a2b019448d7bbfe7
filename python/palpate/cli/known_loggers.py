"""The loggers that palpate.toml remembers: [[import.logger]], written by `palpate import`."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from palpate.tables.loggers import Logger

ENTRIES = "palpate.loggers"
"""Key in context.meta: (file, entry) of each logger, the one with the highest priority last."""


def loggers() -> "list[Logger]":
    """Return the loggers that are remembered.

    Raises
    ------
    click.UsageError
        An entry is wrong.
    """
    entries: list[tuple[Path, Any]] = click.get_current_context().meta.get(ENTRIES, [])
    if not entries:
        return []
    from palpate.tables.loggers import Logger

    found = []
    for path, entry in entries:
        try:
            found.append(Logger.of(entry, str(path)))
        except (ValueError, TypeError) as error:
            raise click.UsageError(f"{path}: [[import.logger]]: {error}") from error
    return found


def remember(logger: "Logger", path: Path) -> None:
    """Add a logger to palpate.toml; the rest of the file stays as it is."""
    lines = [f"{key} = {json.dumps(value, ensure_ascii=False)}" for key, value in logger.entry.items()]
    text = "\n".join(["[[import.logger]]", *lines, ""])
    before = path.read_text(encoding="utf-8") if path.exists() else ""
    with path.open("a", encoding="utf-8") as file:
        file.write(("" if not before else "\n" if before.endswith("\n") else "\n\n") + text)
