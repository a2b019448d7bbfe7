"""The option --accept of commands that use a calibration."""

from collections.abc import Callable
from typing import Any

import click

from palpate.calibration.origin import AcceptedOrigin

accept_option: Callable[[Callable[..., Any]], Callable[..., Any]] = click.option(
    "--accept",
    multiple=True,
    type=click.Choice(list(map(str, AcceptedOrigin))),
    help="Use a calibration of another chip, or of simulated touches, all the same; may be "
    "repeated. The result says so.",
)
"""Adds accept, a tuple of texts of `AcceptedOrigin`, to a command."""
