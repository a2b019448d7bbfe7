"""`palpate kit scan`: what each input has with each excitation."""

import json
import math
from pathlib import Path

import click

from palpate.cli.kit.opening import board_options, opened
from palpate.cli.options import json_option


@click.command("kit.scan")
@board_options
@json_option
def scan(source: str, firmware: Path | None, as_json: bool) -> None:
    """Measure the capacitance of each input with each excitation.

    Above 4 pF the values are uncertain by 20 %, because of the chip's CAPDAC. An open input has some fF.

    \b
    Example:
      palpate kit scan usb:
    """  # noqa: D301
    from palpate.kit.input_steps import PINS
    from palpate.kit.input_steps import scan as measure

    with opened(source, firmware) as bench:
        bench.chip.reset()
        measure(bench)
    if as_json:
        rows = [{"input": f"CIN{pin}", "excitation": f"EXC{name}", "excitation_error": level.error,
                 "pF": None if math.isnan(level.pF) else round(level.total_pF, 5)}
                for (pin, name), level in bench.levels.items()]  # fmt: skip
        click.echo(json.dumps({"inputs": rows}, indent=2))
        return
    click.echo(f"{'':4}  {'EXCA':>12}  {'EXCB':>12}")
    for pin in PINS:
        click.echo(f"CIN{pin}  " + "  ".join(f"{bench.levels[pin, name]!s:>12}" for name in "AB"))
