"""Real recordings in two scenes: for each gesture the median and the interquartile range of the ratio.

    python -m bench.accuracy.gestures ../shared/recordings/cord

The recordings (a braided capacitive cord, pressed by hand at several places, 15 files for each place) are
not part of the project.
"""

import sys
from pathlib import Path
from typing import Any

import numpy as np
import palpate

GESTURES = {"h": "pinch, place h", "l": "pinch, place l", "m": "pinch, place m", "ca": "long press"}


def ratios(folder: Path, gesture: str, scene: Any) -> list[float]:
    """Return the ratios of all touches in the 15 files of a gesture."""
    found = []
    for path in sorted(folder.glob(f"{gesture}[0-9]*.csv")):
        recording = palpate.read(path, columns={"soft": 4, "hard": 8})
        found += [touch.ratio for touch in palpate.touches(recording, scene=scene)]
    return found


def main(folder: Path) -> None:
    """Print the table."""
    print("gesture            scene     touches  ratio: median  quartiles")
    for gesture, name in GESTURES.items():
        for scene in ("paper", "handheld"):
            values = ratios(folder, gesture, scene)
            low, median, high = np.percentile(values, [25, 50, 75])
            print(f"{gesture:3} {name:14} {scene:9} {len(values):7} {median:14.3f}  {low:.3f} to {high:.3f}")


if __name__ == "__main__":
    if len(sys.argv) != 2 or not Path(sys.argv[1]).is_dir():
        sys.exit("usage: python -m bench.accuracy.gestures FOLDER")
    main(Path(sys.argv[1]))
