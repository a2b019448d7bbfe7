"""The paper's estimator on real recordings: one line a gesture, its ratio's median and interquartile range.

    python bench/gestures.py ../shared/recordings/cord

The recordings (a braided capacitive cord, pressed by hand at several places, 15 files a place) are
not part of the project.
"""

import sys
from pathlib import Path

import numpy as np
import palpate

GESTURES = {"h": "pinch, place h", "l": "pinch, place l", "m": "pinch, place m", "ca": "long press"}


def ratios(folder: Path, gesture: str) -> list[float]:
    """Return the ratio of every touch in the 15 files of a gesture."""
    found = []
    for path in sorted(folder.glob(f"{gesture}[0-9]*.csv")):
        found += [touch.ratio for touch in palpate.touches(palpate.read(path, columns={"soft": 4, "hard": 8}))]
    return found


def main(folder: Path) -> None:
    """Print the table."""
    print("gesture            touches  ratio: median  quartiles")
    for gesture, name in GESTURES.items():
        values = ratios(folder, gesture)
        low, median, high = np.percentile(values, [25, 50, 75])
        print(f"{gesture:3} {name:14} {len(values):7} {median:14.3f}  {low:.3f} to {high:.3f}")


if __name__ == "__main__":
    if len(sys.argv) != 2 or not Path(sys.argv[1]).is_dir():
        sys.exit("usage: python bench/gestures.py FOLDER")
    main(Path(sys.argv[1]))
