"""The command that draws the paper's figures."""

from pathlib import Path

import click

from palpate import MissingExtra
from palpate.cli.exit import fail


@click.command()
@click.option("-o", "folder", required=True, type=click.Path(file_okay=False, path_type=Path), help="Folder for them.")
@click.option("--seed", default=0, show_default=True, type=click.IntRange(min=0), help="Of the simulation.")
def figures(folder: Path, seed: int) -> None:
    """Draw Fig. 6, 7, 9, 10, 11 and 12 of the paper from simulated data: PDF, PNG, and the numbers as CSV.

    \b
    Example:
      palpate figures -o figures
    """  # noqa: D301
    try:
        from palpate.figures import draw

        paths = draw(folder, seed=seed)
    except MissingExtra as error:
        fail(error)
    click.echo("\n".join(map(str, paths)))
