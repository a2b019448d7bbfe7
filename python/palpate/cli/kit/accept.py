"""`palpate kit accept`: one run, one report."""

import sys
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

import click

from palpate.cli.kit.opening import board_options, opened
from palpate.cli.kit.telling import BY_USER, ending
from palpate.cli.options import json_option
from palpate.cli.outputs import OUTPUT, require_free
from palpate.cli.terminal import say
from palpate.cli.words import OneOf
from palpate.errors import quoted

if TYPE_CHECKING:
    from palpate.kit.bench import Bench
    from palpate.kit.report import Report
    from palpate.kit.step import Step

_ASKS = 3
_STEPS = ("registers", "bus", "voltages", "times", "inputs", "capdac", "noise", "pairs", "replug", "press", "capacitor")


@click.command("kit.accept")
@board_options
@click.option("-o", "file", type=OUTPUT,
              help="The report to write: a new file.  [default: kit-report-DATE-TIME.json]")  # fmt: skip
@click.option("--prompt/--no-prompt", default=None,
              help="Ask for what needs a hand.  [default: only at a terminal]")  # fmt: skip
@click.option("--skip", multiple=True, type=OneOf(_STEPS), help="A step to leave out; may be repeated.")
@json_option
def accept(
    source: str, firmware: Path | None, file: Path | None, prompt: bool | None, skip: tuple[str, ...], as_json: bool
) -> None:
    """Measure all that shows whether a board works and is wired right; write a report.

    It takes about a minute. Keep the probe still in the air; what needs a hand is asked for at the end. The report is a
    JSON file, to attach to an issue; it has the registers and versions, no name and no path. Exit codes: 0, all is
    right; 3, no board, or it was unplugged and not connected again; 5, a step is wrong; 130, Ctrl-C. The report has
    what was done until then.

    \b
    Example:
      palpate kit accept usb: --firmware Icv_usb.hex
      palpate kit accept "usb:1/5?excitation=A" --skip replug -o bench.json
      palpate kit accept sim: --no-prompt
    """  # noqa: D301
    path = file or Path(f"kit-report-{datetime.now():%Y%m%d-%H%M%S}.json")
    require_free([path], force=None)
    with opened(source, firmware) as bench:
        bench.source.notify = say
        with path.open("xb") as output:  # before the steps: a minute of work needs a place
            asks = sys.stdin.isatty() if prompt is None else prompt
            report = _run(bench, source, output, asks=asks, skip=skip, quiet=as_json)
    if as_json:
        click.echo(report.text(), nl=False)
    code = ending(report, as_json=as_json)
    say(f"report: {path}")
    sys.exit(code)


def _run(bench: "Bench", source: str, output: BinaryIO, *, asks: bool, skip: tuple[str, ...], quiet: bool) -> "Report":
    """Do the steps, whatever ends them; write the report."""
    from palpate.kit import report as reports
    from palpate.kit.acceptance import Acceptance

    started, steps, stopped = reports.now(), list["Step"](), ""
    acceptance = Acceptance(bench, Terminal() if asks else None, skip=skip)
    try:
        for step in acceptance:
            steps.append(step)
            if not quiet:
                click.echo("\n".join(step.lines()))
        stopped = acceptance.stopped
    except (KeyboardInterrupt, click.Abort):
        stopped = BY_USER
    except Exception as error:
        stopped = f"unexpected: {type(error).__name__}"
        raise
    finally:
        found = reports.made(started, source, bench.source.describe(), bench.dump, steps, stopped)
        output.write(found.text().encode())
    return found


class Terminal:
    """Asks at the terminal; questions go to standard error."""

    def ready(self, text: str) -> bool:
        """Wait for Enter; s leaves the step out."""
        answer = click.prompt(f"{text} Enter: go on, s: leave out", default="", show_default=False, err=True)
        return str(answer).strip().lower() != "s"

    def value(self, text: str) -> float | None:
        """Ask for a number, again if it is none; Enter or s leaves the step out."""
        for _ in range(_ASKS):
            answer = str(
                click.prompt(f"{text}; Enter or s: leave out", default="", show_default=False, err=True)
            ).strip()
            if answer.lower() in ("", "s"):
                return None
            try:
                return float(answer)
            except ValueError:
                say(f"got {quoted(answer)}, allowed: a number, as 2.2; Enter or s: leave out")
        return None
