"""`palpate figures`: draws the figures of the paper."""

import json
from pathlib import Path

import click

from palpate.cli.options import json_option
from palpate.cli.outputs import force_option, require_free
from palpate.cli.progress import Progress


@click.command()
@click.option(
    "-o", "folder", required=True, type=click.Path(file_okay=False, path_type=Path), help="Folder for the figures."
)
@click.option("--seed", default=0, show_default=True, type=click.IntRange(min=0), help="Seed of the simulation.")
@force_option
@json_option
def figures(folder: Path, seed: int, force: bool, as_json: bool) -> None:
    """Draw the figures of the paper from simulated data.

    Fig. 6, 7, 9, 10, 11 and 12, each as PDF and PNG, with its numbers as CSV. Exit codes: 4, one of the files exists.

    \b
    Example:
      palpate figures -o figures
    """  # noqa: D301
    from palpate.figures import draw
    from palpate.figures.drawings import files

    require_free(files(folder), force=force)
    with Progress("figures", "figures") as progress:
        paths = [str(path) for path in draw(folder, seed=seed, progress=progress)]
    click.echo(json.dumps({"files": paths}, indent=2) if as_json else "\n".join(paths))
