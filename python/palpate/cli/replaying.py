"""`palpate replay` of several recordings: one table, or one list for JSON."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import click

from palpate import Tracker
from palpate._core import scenes
from palpate.cli.exit import BAD_DATA, MISSING_EXTRA, NOT_RELIABLE, UNEXPECTED, code_of, said_of
from palpate.cli.moduli import Moduli
from palpate.cli.progress import Reading
from palpate.cli.replayed import How, Replayed, replayed
from palpate.cli.terminal import whole


def replay_all(files: list[Path], how: How, calibration: Path | None, jobs: int, *, as_json: bool) -> int:
    """Replay recordings in threads, print each result in order when it is there, and return the exit code."""
    from palpate.fleet import in_order

    if how.asked.get("soft"):
        raise click.UsageError(f"--soft: got it with {len(files)} recordings, allowed: with one FILE")
    _require_settings(how)
    with Reading("replay", files) as progress:
        report = _Report(files, calibration, progress, as_json=as_json)
        work = in_order(lambda file: replayed(file, how, progress.begin), files, jobs)
        try:
            for file, result in zip(files, work, strict=True):
                with whole():  # what is printed is counted
                    progress.end(file)
                    report.add(file, result)
        except KeyboardInterrupt:
            work.close()  # waits for the threads
            report.finish()
            progress.echo(f"{report.count} of {len(files)} recordings are done", err=True)
            raise
        report.finish()
    return report.code


def _require_settings(how: How) -> None:
    """Raise an error for settings that no recording can have, before any is read."""
    wrong: list[ValueError | TypeError] = []
    named: list[Any] = [how.scene] if how.scene else list(scenes)
    for scene in named:
        try:
            Tracker(scene, **how.settings)
        except (ValueError, TypeError) as error:
            wrong.append(error)
        else:
            return
    raise click.UsageError(str(wrong[-1]).split("\n")[0])


class _Report:
    """Prints the results: rows at once, what is said of them at the end."""

    def __init__(self, files: list[Path], calibration: Path | None, progress: Reading, *, as_json: bool) -> None:
        self._calibration, self._progress, self._as_json = calibration, progress, as_json
        self._moduli: dict[str, Moduli] = {}
        self._width = max(len(str(file)) for file in files)
        self._understood = ""
        self._headed = False
        self._documents: list[dict[str, Any]] = []
        self._below: dict[Path, list[str]] = {}  # the lines that stand below a table of one file
        self._errors: list[str] = []
        self._codes = {0}
        self.count = 0

    @property
    def code(self) -> int:
        """The exit code: that of the worst recording."""
        return next(code for code in (UNEXPECTED, MISSING_EXTRA, BAD_DATA, NOT_RELIABLE, 0) if code in self._codes)

    def add(self, file: Path, result: Replayed | Exception) -> None:
        """Print the result of one recording."""
        self.count += 1
        if isinstance(result, Exception):
            self._failed(file, result)
            return
        with self._progress.aside():
            self._notes(result)
            if self._as_json:
                self._documents.append(result.document(self._calibrated(result)))
            elif result.touches:
                self._rows(file, result.table(self._calibrated(result)).splitlines(), len(result.touches))
        if not result.reliable:
            self._codes.add(NOT_RELIABLE)

    def finish(self) -> None:
        """Print what stands below the table, or the list; then the errors."""
        with self._progress.aside():
            if self._as_json:
                click.echo(json.dumps(self._documents, indent=2, allow_nan=False))
            for line in self._said_below():
                click.echo(line)
            for error in self._errors:
                click.echo(f"Error: {error}", err=True)

    def _failed(self, file: Path, error: Exception) -> None:
        usual = isinstance(error, ValueError | TypeError)  # a column that is not there, a recording without times
        said = str(error).split("\n")[0] if usual else said_of(error)
        self._codes.add(BAD_DATA if usual else code_of(error))
        self._errors.append(said if said.startswith(str(file)) else f"{file}: {said}")
        self._documents.append({"file": str(file), "error": said})

    def _notes(self, result: Replayed) -> None:
        """Print the notes; how a table was understood, only if it is not as the one before."""
        understood = [result.understood] if result.understood != self._understood else []
        self._understood = result.understood
        for told in filter(None, [*understood, *result.notes, result.fault]):
            click.echo(f"{result.file}: {told}", err=True)

    def _calibrated(self, result: Replayed) -> Moduli | None:
        scene = result.how["scene"]
        if self._calibration and scene not in self._moduli:
            self._moduli[scene] = Moduli(self._calibration, scene)
        return self._moduli.get(scene)

    def _rows(self, file: Path, table: list[str], touches: int) -> None:
        if not self._headed:
            click.echo(f"{'file':{self._width}}  {table[0]}")
            self._headed = True
        for row in table[1 : 1 + touches]:
            click.echo(f"{file!s:{self._width}}  {row}")
        self._below[file] = table[1 + touches :]

    def _said_below(self) -> Iterator[str]:
        """Yield the lines of each file with its name; one that holds for all of them once, at the end."""
        first, *others = self._below.values() or [[]]
        of_all = [line for line in first if others and all(line in lines for lines in others)]
        for file, lines in self._below.items():
            yield from (f"{file}: {line}" for line in lines if line not in of_all)
        yield from of_all
