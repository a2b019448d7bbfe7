"""`palpate simulate`: writes simulated recordings."""

import json
import math
from pathlib import Path

import click

from palpate.cli.options import json_option
from palpate.cli.progress import Progress


def _objects(_context: click.Context, _parameter: click.Parameter, texts: tuple[str, ...]) -> dict[str, float]:
    """Parse NAME=MPA, given any number of times."""
    found = {}
    for text in texts:
        name, _, value = text.partition("=")
        try:
            found[name.strip()] = float(value)
        except ValueError:
            found[name.strip()] = math.nan
        if not (name.strip() and 0 < found[name.strip()] < math.inf) or set(name) & set("/\\"):
            raise click.BadParameter(f"got {text!r}, allowed: NAME=MPA, for example gel=1.1")
    return found


@click.command()
@click.option(
    "-o", "folder", required=True, type=click.Path(file_okay=False, path_type=Path), help="Folder for the recordings."
)
@click.option("--object", "objects", multiple=True, callback=_objects, metavar="NAME=MPA",
              help="An object and its modulus; may be repeated.  [default: ten specimens, Table I of the paper]")  # fmt: skip
@click.option("--touches", default=4, show_default=True, type=click.IntRange(1, 100), help="Touches on each object.")
@click.option(
    "--oblique",
    default=0.03,
    show_default=True,
    type=click.FloatRange(0, 0.5),
    help="Scatter of the ratio from touch to touch, relative.",
)
@click.option(
    "--seed", default=0, show_default=True, type=click.IntRange(min=0), help="The same seed gives the same files."
)
@json_option
def simulate(folder: Path, objects: dict[str, float], touches: int, oblique: float, seed: int, as_json: bool) -> None:
    """Write simulated recordings of touches on known objects.

    Use it to try `calibrate` without a probe. Writes a file for each object, and moduli.csv with the true moduli.

    \b
    Example:
      palpate simulate -o specimens
      palpate simulate -o gel --object gel=1.1 --seed 7
    """  # noqa: D301
    from palpate.calibration.specimen_files import write_session
    from palpate.elasticity import SORBOTHANE_MPA
    from palpate.simulation.hand import Hand, session

    moduli = objects or SORBOTHANE_MPA
    with Progress("simulate", "objects") as progress:
        made = session(seed, hand=Hand(oblique=oblique), moduli=moduli, touches=touches, progress=progress)
    blocks = {name: run.block() for name, run in made.items()}
    try:
        with Progress("write", "files") as progress:
            paths = [str(path) for path in write_session(folder, blocks, moduli, progress)]
    except FileExistsError as error:
        raise click.UsageError(f"-o: {error}") from error
    click.echo(json.dumps({"files": paths}, indent=2) if as_json else "\n".join(paths))
