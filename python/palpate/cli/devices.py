"""`palpate devices`: the connected devices."""

import json
import sys
from contextlib import closing

import click

from palpate import DeviceNotFound, PalpateError
from palpate.cli.exit import NO_DEVICE, code_of, said_of
from palpate.cli.options import json_option
from palpate.errors import shortened

_BLINK_S = 3.0


@click.command()
@click.option(
    "--blink", is_flag=False, flag_value="usb:", metavar="[usb:BUS/ADDRESS]",
    help="Let the red LED of this evaluation kit blink for 3 s; without a name, of each in turn.",
)  # fmt: skip
@click.option(
    "--lsl", is_flag=True, help="List the streams of Lab Streaming Layer in the network, too; takes some seconds."
)
@json_option
def devices(blink: str | None, lsl: bool, as_json: bool) -> None:
    """List the connected devices.

    Prints the names for `palpate record`. No device is opened, except with --blink. Exit code 3: no device found, or it
    cannot be opened. `sim:` needs no device.

    \b
    Example:
      palpate devices
      palpate devices --blink
    """  # noqa: D301
    from palpate.sources.devices import devices as look
    from palpate.sources.devices import streams

    if blink is not None:
        _blink(blink)
        return
    found, notes = look()
    if lsl:
        more, why = streams()
        found, notes = [*found, *more], [*notes, *why]
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


def _blink(uri: str) -> None:
    """Let boards blink, one after the other; one that cannot be opened does not keep the others from it."""
    from palpate.ad7746.evalkit import find
    from palpate.ad7746.evalkit.board import EvalKit

    backend = find.system_backend()
    found = find.boards(backend)
    chosen = [board for board in found if uri in ("usb:", f"usb:{board}")]
    if not chosen:
        if not found:
            raise DeviceNotFound("--blink: no evaluation kit is connected; `palpate doctor` says what to check")
        there = ", ".join(f"usb:{board}" for board in found)
        raise DeviceNotFound(f"--blink: got {shortened(uri)}, connected: {there}")
    failed = 0
    for board in chosen:
        try:
            with closing(EvalKit(board.bus, board.address, backend=backend)) as kit:
                click.echo(f"usb:{board}: the red LED blinks for {_BLINK_S:g} s")
                kit.blink(_BLINK_S)
        except PalpateError as error:
            click.echo(f"usb:{board}: {said_of(error)}", err=True)
            failed = failed or code_of(error)
    sys.exit(failed)
