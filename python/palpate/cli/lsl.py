"""The option --lsl: a measurement on Lab Streaming Layer."""

from collections.abc import Callable
from typing import Any

import click

from palpate.errors import quoted

_DEFAULT = "palpate"
_LONGEST = 100


def _name(_context: click.Context, _parameter: click.Parameter, text: str | None) -> str | None:
    if text is None:
        return None
    if ":" in text or not 0 < len(text) <= _LONGEST:
        allowed = f"a name of 1 to {_LONGEST} characters without a colon; write --lsl after SOURCE, or --lsl=NAME"
        raise click.BadParameter(f"got {quoted(text)}, allowed: {allowed}")
    return text


lsl_option: Callable[[Callable[..., Any]], Callable[..., Any]] = click.option(
    "--lsl", is_flag=False, flag_value=_DEFAULT, callback=_name, metavar="[NAME]",
    help="Send the measurement to Lab Streaming Layer, as the streams NAME (samples), NAME-estimates and NAME-marks. "
    f"Without a name: {_DEFAULT}.",
)  # fmt: skip
"""Adds lsl, the name of the streams or None, to a command."""
