"""`palpate kit`: commands for a board with an AD7746, and for a simulated one."""

import click

from palpate.cli.group import Commands

COMMANDS = {
    "accept": "Measure all that shows whether a board works and is wired right; write a report.",
    "noise": "Measure the noise of each input, beside the data sheet's.",
    "scan": "Measure the capacitance of each input with each excitation.",
    "dump": "Print the registers by name, with their bits in words.",
    "report": "Print the report of an acceptance.",
}
"""Help line of each command. The module palpate.cli.kit.NAME has the function NAME."""


@click.group(cls=Commands, commands_in="palpate.cli.kit", short_helps=COMMANDS)
def kit() -> None:
    """Check a board: wiring, noise, registers.

    SOURCE is usb:, i2c:/dev/i2c-1, or sim: for a simulated board.

    \b
    Example:
      palpate kit accept usb: --firmware Icv_usb.hex
      palpate kit report kit-report-20261122-110500.json
    """  # noqa: D301
