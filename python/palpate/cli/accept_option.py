"""The option --accept of commands that use a calibration."""

from collections.abc import Callable
from typing import Any

import click

from palpate.calibration.origin import AcceptedOrigin

accept_option: Callable[[Callable[..., Any]], Callable[..., Any]] = click.option(
    "--accept",
    multiple=True,
    metavar="NAME",
    type=click.Choice(list(map(str, AcceptedOrigin))),
    help="Use a calibration all the same: other-chip, it is of another chip; simulated, its touches "
    "are simulated. May be repeated; the result says so.",
)
"""Adds accept, a tuple of texts of `AcceptedOrigin`, to a command."""
