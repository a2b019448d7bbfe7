"""`palpate kit report`: the report of an acceptance, read back."""

import sys
from pathlib import Path

import click

from palpate.cli.inputs import InputFile
from palpate.cli.kit.telling import ending
from palpate.cli.options import json_option


@click.command("kit.report")
@click.argument("file", type=InputFile())
@json_option
def report(file: Path, as_json: bool) -> None:
    """Print the report of an acceptance.

    Exit codes as those of `palpate kit accept`: 0, all is right; 3, it was stopped by the board; 5, a step is wrong;
    130, it was interrupted; also 4, the file is not a report.

    \b
    Example:
      palpate kit report kit-report-20261122-110500.json
    """  # noqa: D301
    from palpate.kit.report import load

    found = load(file)
    if as_json:
        click.echo(found.text(), nl=False)
    else:
        click.echo("\n".join([found.title(), *(line for step in found.steps for line in step.lines())]))
    sys.exit(ending(found, as_json=as_json))
