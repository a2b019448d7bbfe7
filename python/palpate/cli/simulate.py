"""`palpate simulate` and `palpate bench`: simulated recordings, and estimators compared on them."""

import math
from dataclasses import asdict
from pathlib import Path

import click

from palpate import benchmark
from palpate.calibration.specimen_files import session_files, write_session
from palpate.cli.group import json_option, show, usage_errors
from palpate.cli.options import named_numbers
from palpate.cli.paths import OUTPUT, OUTPUT_FOLDER, force_option, require_free, require_free_in
from palpate.cli.terminal import progress
from palpate.digits import plain
from palpate.display import plots
from palpate.elasticity import SORBOTHANE_MPA
from palpate.errors import unlike
from palpate.extras import need
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
    with progress("simulate", length=len(moduli)) as bar:
        hand = Hand(oblique=oblique)
        made = session(
            seed, hand=hand, moduli=moduli, touches=touches, progress=lambda done, _: bar.update(done - bar.pos)
        )
    blocks = {name: run.block() for name, run in made.items()}
    paths = [str(path) for path in write_session(folder, blocks, moduli)]
    show({"files": paths}, "\n".join(paths))


@click.command()
@click.option("--seeds", default=20, show_default=True, type=click.IntRange(min=1), help="Recordings of each scenario.")
@click.option("--scenario", "names", multiple=True, metavar="NAME", help="Only this scenario; may be repeated.")
@click.option("--plot", type=OUTPUT, help="Draw error against run time: .png, .pdf or .svg.  [default: four scenarios]")
@force_option
@json_option
def bench(seeds: int, names: tuple[str, ...], plot: Path | None, force: bool) -> None:
    """Compare estimators on simulated touches: error and run time.

    Beside those of palpate: other methods, and the libraries that are installed of scipy, padasip, river, filterpy and
    simdkalman. They get the begin of the press. "+A": on pairs aligned as in the scene handheld.

    \b
    Example:
      palpate bench --seeds 50
      palpate bench --scenario tremor --scenario step-up --json
      palpate bench --plot error_vs_time.png
    """  # noqa: D301
    for name in names:
        if name not in benchmark.SINGLE:
            raise click.UsageError(f"--scenario: {unlike(name, benchmark.SINGLE)}")
    if plot:
        require_free([plot], force=force)
        with usage_errors("--"):
            plots.check(plot)
        need("matplotlib", "science")  # before anything is measured
    with progress("bench", names or (benchmark.PLOTTED if plot else benchmark.SINGLE)) as scenarios:
        rows = benchmark.compare(seeds, scenarios)
    if plot:
        benchmark.plot(rows, plot)
    show({"seeds": seeds, "rows": [plain(asdict(row)) for row in rows]}, benchmark.table(rows))
