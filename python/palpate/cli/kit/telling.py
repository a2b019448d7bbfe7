"""How `palpate kit accept` and `palpate kit report` end."""

from typing import TYPE_CHECKING

import click

from palpate.cli.exit import INTERRUPTED, NO_DEVICE, NOT_RELIABLE

if TYPE_CHECKING:
    from palpate.kit.report import Report

BY_USER = "interrupted"


def ending(report: "Report", *, as_json: bool) -> int:
    """Print the sum of a report, unless it was printed as JSON; return the exit code."""
    from palpate.kit.step import WRONG, summary

    if not as_json:
        click.echo(summary(report.steps) + (f"; ended early: {report.stopped}" if report.stopped else ""))
    if report.stopped:
        return INTERRUPTED if report.stopped == BY_USER else NO_DEVICE
    return NOT_RELIABLE if any(step.verdict == WRONG for step in report.steps) else 0
