"""Style and files of figures for print: PDF, PNG, and the numbers as CSV."""

import csv
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from palpate.extras import need
from palpate.files import replacing

COLUMN_IN, PAGE_IN = 3.5, 7.16  # widths of one and of two columns of a journal page, inches
HARD, SOFT, PAPER, HANDHELD, SLOW, FAST = "#3A3D40", "#7D848A", "#D55E00", "#0072B2", "#009E73", "#CC79A7"
"""Those of the live page, which colour-blind readers can distinguish (Okabe and Ito, 2008); each has one meaning."""
TRUTH: dict[str, Any] = {"color": "black", "linewidth": 0.7, "linestyle": (0, (4, 2))}
STYLE: dict[str, Any] = {
    "font.size": 8,
    "axes.titlesize": 8,
    "axes.labelsize": 8,
    "legend.fontsize": 7,
    "xtick.labelsize": 7,
    "ytick.labelsize": 7,
    "axes.linewidth": 0.6,
    "lines.linewidth": 1.0,
    "lines.markersize": 4,
    "axes.titlelocation": "left",
    "legend.frameon": False,
    "legend.handlelength": 1.6,
    "figure.dpi": 100,
    "savefig.dpi": 300,
    "pdf.fonttype": 42,
    "svg.fonttype": "path",
    "svg.hashsalt": "palpate",
    "axes.grid": True,
    "grid.alpha": 0.25,
    "grid.linewidth": 0.5,
}


@contextmanager
def sheet(width_in: float, height_in: float) -> Iterator[Any]:
    """Yield an empty figure in print style; the caller's matplotlib settings do not change, no window opens."""
    with need("matplotlib", "science").rc_context(STYLE):
        yield need("matplotlib.figure", "science").Figure(figsize=(width_in, height_in), layout="constrained")


def save(figure: Any, stem: Path, title: str) -> list[Path]:
    """Write stem.pdf and stem.png, and return their paths; the same figure gives identical files."""
    paths = [stem.with_suffix(".pdf"), stem.with_suffix(".png")]
    for path, metadata in zip(paths, ({"Title": title, "CreationDate": None}, {"Title": title}), strict=True):
        with replacing(path) as file:
            figure.savefig(file, format=path.suffix[1:], metadata=metadata)
    return paths


def write_csv(path: Path, columns: Mapping[str, ArrayLike]) -> Path:
    """Write columns of equal length with all digits, nan as an empty cell; return the path."""
    arrays = [np.asarray(values) for values in columns.values()]
    text = StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows([_cell(value) for value in row] for row in zip(*(a.tolist() for a in arrays), strict=True))
    with replacing(path) as file:
        file.write(text.getvalue().encode())
    return path


def _cell(value: Any) -> str:
    if isinstance(value, bool):
        return str(int(value))
    if isinstance(value, float):
        return repr(value) if np.isfinite(value) else ""
    return str(value)
