"""`palpate kit noise`: the noise of each input, beside the data sheet's."""

import json
from pathlib import Path
from typing import TYPE_CHECKING

import click

from palpate.cli.kit.opening import board_options, opened
from palpate.cli.options import json_option
from palpate.cli.terminal import say

if TYPE_CHECKING:
    from palpate.kit.bench import Bench


@click.command("kit.noise")
@board_options
@click.option("--capf", "speeds", type=click.IntRange(0, 7), multiple=True,
              help="Speed, 0 (11 ms) to 7 (110 ms); may be repeated.  [default: all]")  # fmt: skip
@click.option("--readings", type=click.IntRange(2, 10_000), default=50, show_default=True, help="Readings for a value.")
@click.option("--rounds", type=click.IntRange(1), default=1, show_default=True, help="How often to measure all.")
@json_option
def noise(
    source: str, firmware: Path | None, speeds: tuple[int, ...], readings: int, rounds: int, as_json: bool
) -> None:
    """Measure the noise of each input, beside the data sheet's.

    aF rms, from the differences of readings in succession, so that a slow drift does not count. Keep the probe still.
    The data sheet's values are for open inputs; a probe and its cable add to them.

    \b
    Example:
      palpate kit noise usb:
      palpate kit noise usb: --capf 4 --rounds 100
    """  # noqa: D301
    from palpate.ad7746.datasheet import CONVERSION_S, NOISE_PF
    from palpate.kit.input_steps import PINS, scan

    rows = []
    if not as_json:
        click.echo(f"{'CAPF':>4}  {'ms':>5}  {'CIN1 aF':>8}  {'CIN2 aF':>8}  {'data sheet aF':>13}")
    with opened(source, firmware) as bench:
        bench.chip.reset()
        scan(bench)
        for capf in rounds * (speeds or tuple(range(len(CONVERSION_S)))):
            found = _both(bench, capf, readings)
            sheet = 1e6 * NOISE_PF[capf]
            rows.append({"capf": capf, "cin1_aF": found[0], "cin2_aF": found[1], "data_sheet_aF": round(sheet, 1)})
            if not as_json:
                shown = "  ".join(f"{'-' if value is None else f'{value:.1f}':>8}" for value in found)
                click.echo(f"{capf:4}  {1e3 * CONVERSION_S[capf]:5.1f}  {shown}  {sheet:13.1f}")
        for pin in [pin for pin in PINS if bench.level(pin) is None]:
            say(
                f"CIN{pin} is not measured: it has {bench.levels[pin, 'A']} on EXCA and {bench.levels[pin, 'B']} on EXCB, "
                "so no sensor is there, or a short: look at its wires (palpate kit accept names them)"
            )
    if as_json:
        click.echo(json.dumps({"readings": readings, "noise": rows}, indent=2))


def _both(bench: "Bench", capf: int, readings: int) -> list[float | None]:
    """Return the noise of both inputs, aF rms; None: nothing is connected."""
    from palpate.kit.input_steps import PINS, noise_of

    levels = [(pin, bench.level(pin)) for pin in PINS]
    return [None if level is None else round(1e6 * noise_of(bench, pin, level, capf, readings).rms_pF, 2)
            for pin, level in levels]  # fmt: skip
