"""`palpate kit dump`: the registers by name."""

import json
from pathlib import Path

import click

from palpate.cli.kit.opening import board_options, opened
from palpate.cli.options import json_option


@click.command("kit.dump")
@board_options
@json_option
def dump(source: str, firmware: Path | None, as_json: bool) -> None:
    """Print the registers by name, with their bits in words.

    Nothing is written to the chip; a conversion that is running may be lost.

    \b
    Example:
      palpate kit dump usb:
    """  # noqa: D301
    from palpate.kit.registers import named

    with opened(source, firmware) as bench:
        found = named(bench.chip.registers())
    if as_json:
        rows = [{**register._asdict(), "content": register.content.hex()} for register in found]
        click.echo(json.dumps({"registers": rows}, indent=2))
        return
    for register in found:
        click.echo(f"{register.address:02X}  {register.name:10}  {register.content.hex():6}  {register.words}")
