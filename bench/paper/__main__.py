"""Draw Fig. 6, 7, 9, 10, 11 and 12 of the paper from simulated data: python -m bench.paper -o FOLDER [--seed N].

Each figure is a PDF and a PNG; captions.md says what they show. Fig. 1 to 5 and 8 of the paper are drawings and photographs.
"""

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import click
from palpate.display.plots import COLUMN_IN, PAGE_IN, sheet
from palpate.simulation.scenarios import PROBE

from bench.paper.specimens import figure_10, figure_11, figure_12, ten_specimens
from bench.paper.touches import (
    TREMOR,
    figure_6,
    figure_7,
    figure_9,
    four_touches,
    one_touch,
    two_specimens,
)


class Drawing(NamedTuple):
    """One figure: its size, the functions that make its data and draw it, and its caption."""

    size_in: tuple[float, float]
    data: Callable[[int], Any]
    draw: Callable[[Any, Any], None]
    caption: str


_SEEN = f"Tremor {100 * TREMOR:g} % of the press, as in the other figures of touches."
_TEN = cache(ten_specimens)
FIGURES = {
    6: Drawing(
        (PAGE_IN, 7.6), two_specimens, figure_6,
        "Readouts on the specimens 30 OO (0.143 MPa, left) and 30 A (0.87 MPa, right), and the ratio by ordinary RLS with "
        "forgetting 0.995 (a) and 0.9 (b), as in the paper's Fig. 6; (c) the handheld scene on the same data; (d) the "
        f"distance of all from the truth. {_SEEN}",
    ),
    7: Drawing(
        (PAGE_IN, 6.2), one_touch, figure_7,
        "Specimen 70 OO (0.515 MPa), as in the paper's Fig. 7: (a) readouts and the ratio with adaptive forgetting, (b) "
        "innovation and alarm signal, (c) three estimators; (d) to (f) the handheld scene on the same data. "
        f"Before contact the ratio is 1. {_SEEN}",
    ),
    9: Drawing(
        (PAGE_IN, 5.6), four_touches, figure_9,
        "Four specimens touched one after the other (30 OO, 70 OO, 40 A, 70 A), as in the paper's Fig. 9: readouts, "
        "ratio, set back to 1 after each touch, and alarm signal (left); the handheld scene on the same data (right). "
        f"{_SEEN}",
    ),
    10: Drawing(
        (COLUMN_IN, 3.0), _TEN, figure_10,
        "Ratio against modulus, four touches on each of ten specimens, by the paper's algorithm: mean and standard "
        "deviation, as in the paper's Fig. 10; inset: logarithmic moduli.",
    ),
    11: Drawing(
        (COLUMN_IN, 3.8), _TEN, figure_11,
        "The touch with the smallest P of four against their mean, as in the paper's Fig. 11, and the one with the "
        "smallest standard error by the handheld scene; below, the distance from the true curve.",
    ),
    12: Drawing(
        (PAGE_IN, 3.2), _TEN, figure_12,
        "Eq. (2) fitted (a) to the touch with the smallest P of each specimen, as in the paper's Fig. 12, (b) to every "
        "touch by the handheld scene; bands: where 95 % of single touches lie; parameters with 95 % intervals.",
    ),
}  # fmt: skip
"""Figures by their number in the paper."""


def caption(number: int, seed: int) -> str:
    """Return the caption of a figure."""
    return (
        f"Fig. {number}. {FIGURES[number].caption} Simulated data (palpate.simulation, seed {seed}), not a measurement. "
        f"The truth is the simulator's: a probe with k_h / k_s = {PROBE.rigid_ratio:g}."
    )


@click.command()
@click.option(
    "-o",
    "folder",
    required=True,
    type=click.Path(file_okay=False, path_type=Path),
    help="Folder to write in.",
)
@click.option("--seed", default=0, show_default=True, help="Seed of the simulation.")
def main(folder: Path, seed: int) -> None:
    """Draw the figures of the paper from simulated data; the same seed gives the same bytes."""
    folder.mkdir(parents=True, exist_ok=True)
    for number, drawing in FIGURES.items():
        with sheet(*drawing.size_in) as figure:
            drawing.draw(figure, drawing.data(seed))
            footer = f"simulated data, seed {seed}; tremor {100 * TREMOR:g} % of the press"
            figure.supxlabel(footer, fontsize=6, color="0.4", x=0.995, ha="right")
            named = {"Title": caption(number, seed)}
            figure.savefig(folder / f"fig{number:02}.pdf", metadata={**named, "CreationDate": None})
            figure.set_layout_engine("none")  # the layout of the PDF stays: it takes seconds
            figure.savefig(folder / f"fig{number:02}.png", metadata=named)
    captions = [caption(number, seed) for number in FIGURES]
    (folder / "captions.md").write_text("\n\n".join(captions) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
