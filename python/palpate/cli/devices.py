"""`palpate devices`: the connected devices."""

import json
import sys

import click

from palpate.cli.exit import NO_DEVICE
from palpate.cli.options import json_option


@click.command()
@json_option
def devices(as_json: bool) -> None:
    """List the connected devices.

    Prints the names for `palpate record`. No device is opened. Exit code 3: no device found. `sim:` needs no device.

    \b
    Example:
      palpate devices
    """  # noqa: D301
    from palpate.sources.devices import devices as look

    found, notes = look()
    if as_json:
        click.echo(json.dumps({"devices": [device._asdict() for device in found], "notes": notes}, indent=2))
    else:
        width = max((len(device.uri) for device in found), default=0)
        for device in found:
            click.echo(f"{device.uri:{width}}  {device.what}")
    for note in notes:
        click.echo(f"not searched: {note}", err=True)
    if not found:
        click.echo("no device found; use a simulated board: sim:four-specimens", err=True)
        sys.exit(NO_DEVICE)
