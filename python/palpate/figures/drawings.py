"""Fig. 6, 7, 9, 10, 11 and 12 of the paper from simulated data: PDF, PNG, and the numbers as CSV."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from palpate.figure_style import COLUMN_IN, PAGE_IN, save, sheet, write_csv
from palpate.figures import session, touch, traces
from palpate.files import replacing
from palpate.simulation.scenarios import PROBE


@dataclass(frozen=True)
class Drawing:
    """One figure: caption, size, and the functions that make its data, drawing and columns."""

    caption: str
    size_in: tuple[float, float]
    data: Callable[[int], Any]
    draw: Callable[[Any, Any], None]
    columns: Callable[[Any], dict[str, Any]]


_SEEN = f"Tremor {100 * traces.TREMOR:g} % of the press, as in the other figures of touches."

FIGURES = {
    6: Drawing(
        "Readouts on the specimens 30 OO (0.143 MPa, left) and 30 A (0.87 MPa, right), and the ratio by ordinary RLS with "
        "forgetting 0.995 (a) and 0.9 (b), as in the paper's Fig. 6; (c) the handheld scene on the same data; (d) the "
        f"distance of all from the truth. {_SEEN}",
        (PAGE_IN, 7.6),
        traces.two_specimens,
        touch.figure_6,
        traces.stacked,
    ),
    7: Drawing(
        "Specimen 70 OO (0.515 MPa), as in the paper's Fig. 7: (a) readouts and the ratio with adaptive forgetting, (b) "
        "innovation and alarm signal, (c) three estimators; (d) to (f) the handheld scene on the same data. "
        f"Before contact the ratio is 1. {_SEEN}",
        (PAGE_IN, 6.2),
        lambda seed: traces.one_touch(traces.ONE, seed),
        touch.figure_7,
        traces.Traces.columns,
    ),
    9: Drawing(
        "Four specimens touched one after the other (30 OO, 70 OO, 40 A, 70 A), as in the paper's Fig. 9: readouts, "
        "ratio, set back to 1 after each touch, and alarm signal (left); the handheld scene on the same data (right). "
        f"{_SEEN}",
        (PAGE_IN, 5.6),
        traces.four_touches,
        touch.figure_9,
        traces.Traces.columns,
    ),
    10: Drawing(
        "Ratio against modulus, four touches on each of ten specimens, by the paper's algorithm: mean and standard "
        "deviation, as in the paper's Fig. 10; inset: logarithmic moduli.",
        (COLUMN_IN, 3.0),
        session.ten_specimens,
        session.figure_10,
        session.columns_10,
    ),
    11: Drawing(
        "The touch with the smallest P of four against their mean, as in the paper's Fig. 11, and the one with the "
        "smallest standard error by the handheld scene; below, the distance from the true curve.",
        (COLUMN_IN, 3.8),
        session.ten_specimens,
        session.figure_11,
        session.columns_11,
    ),
    12: Drawing(
        "Eq. (2) fitted (a) to the touch with the smallest P of each specimen, as in the paper's Fig. 12, (b) to every "
        "touch by the handheld scene; bands: where 95 % of single touches lie; parameters with 95 % intervals.",
        (PAGE_IN, 3.2),
        session.ten_specimens,
        session.figure_12,
        session.columns_12,
    ),
}
"""Figures by their number in the paper. Fig. 1 to 5 and 8 of the paper are drawings and photographs."""


def caption(number: int, seed: int) -> str:
    """Return the caption of a figure.

    Parameters
    ----------
    number : int
        Number in the paper, a key of `FIGURES`.
    seed : int
        Seed of the simulation.

    Returns
    -------
    str

    Examples
    --------
    >>> caption(9, seed=0)[:22]
    'Fig. 9. Four specimens'
    """
    return (
        f"Fig. {number}. {FIGURES[number].caption} Simulated data (palpate.simulation, seed {seed}), not a measurement. "
        f"The truth is the simulator's: a probe with k_h / k_s = {PROBE.rigid_ratio:g}."
    )


def files(folder: Path) -> list[Path]:
    """Return the files that `draw` writes.

    Examples
    --------
    >>> [path.name for path in files(Path("figures"))][:3]
    ['fig06.pdf', 'fig06.png', 'fig06.csv']
    """
    stems = [folder / f"fig{number:02}" for number in FIGURES]
    return [
        *(stem.with_suffix(suffix) for stem in stems for suffix in (".pdf", ".png", ".csv")),
        folder / "captions.md",
    ]


def draw(folder: Path, *, seed: int = 0, progress: Callable[[int, int], None] | None = None) -> list[Path]:
    """Draw all figures into a folder.

    Parameters
    ----------
    folder : pathlib.Path
        Created if it does not exist.
    seed : int
        Seed of the simulation, 0 or more.
    progress : function, optional
        Called with the number of figures that are done, and with that of all.

    Returns
    -------
    list of pathlib.Path
        fig06.pdf, fig06.png, fig06.csv, ..., captions.md.

    Raises
    ------
    MissingExtra
        matplotlib or scipy is missing; type: pip install 'palpate[science]'.

    Examples
    --------
    >>> draw(Path("figures"))  # doctest: +SKIP
    [PosixPath('figures/fig06.pdf'), ...]
    """
    folder.mkdir(parents=True, exist_ok=True)
    footer = f"simulated data, seed {seed}; tremor {100 * traces.TREMOR:g} % of the press"
    made: dict[Callable[[int], Any], Any] = {}
    paths = []
    for done, (number, drawing) in enumerate(FIGURES.items()):
        if progress:
            progress(done, len(FIGURES))
        if drawing.data not in made:
            made[drawing.data] = drawing.data(seed)
        data = made[drawing.data]
        stem = folder / f"fig{number:02}"
        with sheet(*drawing.size_in) as figure:
            drawing.draw(figure, data)
            figure.supxlabel(footer, fontsize=6, color="0.4", x=0.995, ha="right")
            paths += save(figure, stem, caption(number, seed))
        paths.append(write_csv(stem.with_suffix(".csv"), drawing.columns(data)))
    captions = folder / "captions.md"
    with replacing(captions) as file:
        file.write("\n\n".join([*(caption(number, seed) for number in FIGURES), ""]).encode())
    return [*paths, captions]
