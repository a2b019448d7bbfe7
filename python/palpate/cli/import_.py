"""`palpate import`: how a table of another program is read; asks what is open, and remembers the answer."""

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from palpate.cli import known_loggers
from palpate.cli.config import NAME
from palpate.cli.options import INPUT, json_option, reading_options
from palpate.errors import listed, shortened

if TYPE_CHECKING:
    from palpate.recording.foreign import Foreign
    from palpate.tables.table import Table

_SHOWN = 4  # rows of a preview
_TOUCHES = 8  # in one line
_WIDTH = 24  # characters of a cell
_QUESTIONS = {
    "columns": "",
    "unit": "unit of the capacitances (aF, fF, pF, nF, uF, F)",
    "time_unit": "unit of the times (s, ms, us, ns, min, d)",
    "rate": "pairs a second",
    "decimal": "decimal mark (point, comma)",
}
"""The question for each keyword of `palpate.read`; columns are two questions."""
_WHICH = "Which columns are the two channels? A name, or a position."


@click.command("import")
@click.argument("file", type=INPUT)
@reading_options
@click.option("--remember", is_flag=True, help=f"Add the answer to {NAME} here without a question.")
@json_option
def import_(file: Path, asked: dict[str, Any], remember: bool, as_json: bool) -> None:
    """Show how a table of another program is read, ask what is open, and remember the answer.

    FILE is a table with two channels: text, Excel, Parquet, Arrow, XDF, also packed as .gz. What is open is asked for on
    a terminal; else it is an error, exit code 2. The answer is kept in palpate.toml in this folder, for all tables with
    the same names of columns: `replay`, `record`, `live`, `check`, `convert` and `calibrate` use it, and say so. Options
    on the command line have priority over it. Exit codes: 4, not a table.

    \b
    Example:
      palpate import other.csv
      palpate import other.csv --map hard=2,soft=3 --unit fF --remember
    """  # noqa: D301
    from palpate.recording.recognition import is_own

    if is_own(file):
        raise click.UsageError(f"{file}: is a recording of palpate, allowed: a table of another program")
    given = dict(asked)
    table = _read(file, given)
    if not as_json:
        click.echo(_preview(file, table))
    found = _understood(file, table, given)
    given.pop("known", None)
    known = _known(given, found)
    if as_json:
        click.echo(json.dumps(_document(file, table, found, given), indent=2, ensure_ascii=False))
    else:
        click.echo("\n".join([found.understood, *found.notes, _touches(found)]))
    if remember or (not known and _may_ask() and _confirmed(table)):
        _remember(table, given)


def _read(file: Path, given: dict[str, Any]) -> "Table":
    """Return the table; which one of several is asked for, and added to `given`."""
    from palpate.tables.asked import Asked
    from palpate.tables.formats import read_table

    while True:
        try:
            return read_table(file, Asked(**{name: value for name, value in given.items() if name != "known"}))
        except ValueError as error:
            if not (_may_ask() and str(error).startswith("part:")):
                raise click.UsageError(str(error)) from error
            click.echo(str(error), err=True)
            given["part"] = click.prompt("name of the sheet or stream", err=True)


def _understood(file: Path, table: "Table", given: dict[str, Any]) -> "Foreign":
    """Return the recording; what is open is asked for, and added to `given`."""
    from palpate.recording.foreign import Foreign

    answered = set[str]()
    while True:
        try:
            return Foreign(file, table=table, **given)
        except (ValueError, TypeError) as error:
            message = str(error).split("\n")[0]
            what = "columns" if message.startswith("column") else message.partition(":")[0]
            if not _may_ask() or what not in _QUESTIONS or (what in given and what not in answered):
                raise click.UsageError(message) from error
            click.echo(_WHICH if what == "columns" and what not in answered else message, err=True)
            answered.add(what)
            given[what] = _answer(what)


def _answer(what: str) -> Any:
    if what == "columns":
        return {name: click.prompt(f"{name} channel, column", err=True) for name in ("hard", "soft")}
    return click.prompt(_QUESTIONS[what], type=float if what == "rate" else str, err=True)


def _may_ask() -> bool:
    return sys.stdin.isatty()


def _confirmed(table: "Table") -> bool:
    from palpate.tables.loggers import columns_of

    return any(columns_of(table)) and click.confirm(
        f"Remember this in {NAME} here, for tables with these columns?", default=True, err=True
    )


def _known(given: dict[str, Any], found: "Foreign") -> bool:
    """Return whether the answer is remembered already, or there is nothing to remember."""
    from palpate.tables.loggers import OF_ONE_FILE

    return not set(given) - set(OF_ONE_FILE) or any("remembered in" in note for note in found.notes)


def _remember(table: "Table", given: dict[str, Any]) -> None:
    from palpate.tables.asked import Asked
    from palpate.tables.loggers import Logger, columns_of

    columns = columns_of(table)
    if not any(columns):
        raise click.UsageError(
            "--remember: got a table without names of columns, allowed: one with a header, by which it is known again"
        )
    logger = Logger(columns, Asked(**given), NAME)
    known_loggers.remember(logger, Path(NAME))
    said = ", ".join(f"{name} {value}" for name, value in logger.entry.items() if name != "columns")
    click.echo(f"remembered in {NAME}: {said or 'nothing but the names of the columns'}", err=True)


def _preview(file: Path, table: "Table") -> str:
    """Return a line for each column: its position, its name, its first cells."""
    names = [table.name(column) if table.names(column) else "" for column in range(table.width)]
    width = max(map(len, names))
    lines = [f"{file}: {table.width} columns, {len(table)} rows"]
    for position, (name, column) in enumerate(zip(names, table.columns, strict=True), 1):
        cells = [shortened(str(cell), _WIDTH) for cell in column.cells[:_SHOWN]]
        lines.append(f"{position:5}  {name:{width}}  {'  '.join(cells)}")
    return "\n".join(lines)


def _touches(found: "Foreign") -> str:
    from palpate import touches
    from palpate.digits import plus_minus

    ratios = [plus_minus(touch.ratio, touch.standard_error) for touch in touches(found)]
    return ("1 touch" if len(ratios) == 1 else f"{len(ratios)} touches") + (
        f": ratio {listed(ratios, _TOUCHES)}" if ratios else ""
    )


def _document(file: Path, table: "Table", found: "Foreign", given: dict[str, Any]) -> dict[str, Any]:
    from palpate.tables.loggers import columns_of

    return {
        "file": str(file),
        "columns": list(columns_of(table)),
        "rows": len(table),
        "understood": found.understood,
        "notes": list(found.notes),
        "asked": {name: str(value) if name == "soft" else value for name, value in given.items()},
    }
