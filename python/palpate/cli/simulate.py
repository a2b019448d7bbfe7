"""`palpate simulate`: simulated recordings of touches on known objects."""

import math
from pathlib import Path

import click

from palpate.calibration.specimen_files import session_files, write_session
from palpate.cli.group import json_option, show
from palpate.cli.options import named_numbers
from palpate.cli.paths import OUTPUT_FOLDER, force_option, require_free_in
from palpate.cli.terminal import progress
from palpate.elasticity import SORBOTHANE_MPA
from palpate.simulation.hand import Hand, session


def _objects(_context: click.Context, _parameter: click.Parameter, texts: tuple[str, ...]) -> dict[str, float]:
    found = named_numbers(texts, "gel=1.1")
    for name, modulus in found.items():
        if not name or set(name) & set("/\\") or not 0 < modulus < math.inf:
            raise click.BadParameter(f"got {name}={modulus:g}, allowed: NAME=MPA, for example gel=1.1")
    return found


@click.command()
@click.option("-o", "folder", required=True, type=OUTPUT_FOLDER, help="The folder to write in.")
@click.option("--object", "objects", multiple=True, callback=_objects, metavar="NAME=MPA",
              help="An object and its modulus; may be repeated.  [default: ten specimens, Table I of the paper]")  # fmt: skip
@click.option("--touches", default=4, show_default=True, type=click.IntRange(1, 100), help="Touches on each object.")
@click.option("--oblique", default=0.03, show_default=True, type=click.FloatRange(0, 0.5),
              help="Scatter of the ratio from touch to touch, relative.")  # fmt: skip
@click.option("--seed", default=0, show_default=True, type=click.IntRange(min=0),
              help="The same seed gives the same files.")  # fmt: skip
@force_option
@json_option
def simulate(folder: Path, objects: dict[str, float], touches: int, oblique: float, seed: int, force: bool) -> None:
    """Write simulated recordings of touches on known objects.

    Use it to try `calibrate` without a probe. Writes a file for each object, and moduli.csv with the true moduli.
    Exit code 4: one of the files exists.

    \b
    Example:
      palpate simulate -o specimens
      palpate simulate -o gel --object gel=1.1 --seed 7
    """  # noqa: D301
    moduli = objects or SORBOTHANE_MPA
    require_free_in(folder, session_files(folder, moduli), force=force)
    with progress("simulate", len(moduli)) as bar:
        hand = Hand(oblique=oblique)
        made = session(
            seed, hand=hand, moduli=moduli, touches=touches, progress=lambda done, _: bar.update(done - bar.pos)
        )
    blocks = {name: run.block() for name, run in made.items()}
    paths = [str(path) for path in write_session(folder, blocks, moduli)]
    show({"files": paths}, "\n".join(paths))
