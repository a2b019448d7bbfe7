"""Tries an installed wheel: it loads, and gives the bits that every system gives. `python release/smoke.py`; it takes a second.

It needs numpy, palpate and the recording of the tests, nothing else.
"""

import hashlib
import sys
from pathlib import Path

import numpy as np
import palpate

RECORDING = Path(__file__).parents[1] / "tests" / "data" / "four-specimens.csv"
# If the estimators were changed on purpose: what this program prints.
EXPECTED = "96f8c16776b10c8b4f1708479d045acf4e76b02fe77b654f8b8c92e0199bd35d"


def bits() -> str:
    """Return the SHA-256 of the rows and touches of every scene, and of a bank, over the recording."""
    found = hashlib.sha256()
    data = palpate.read(RECORDING)
    for scene in ("fixed", "handheld", "paper", "sliding"):
        rows = palpate.Tracker(scene).process(data.t_hard_s, data.t_soft_s, data.hard, data.soft)
        for name in rows.dtype.names or ():
            found.update(rows[name].astype(rows[name].dtype.newbyteorder("<")).tobytes())
        for touch in palpate.touches(data, scene=scene):
            found.update(
                f"{touch.ratio.hex()} {touch.standard_error.hex()} {touch.flags}\n".encode()
            )
    scale = 1 + np.arange(21) / 16
    ratios = palpate.Bank(palpate.HandoverRls(), 21).process(
        data.hard[:, None] * scale, data.soft[:, None] / scale
    )
    found.update(ratios.astype("<f8").tobytes())
    return found.hexdigest()


def main() -> None:
    """Print the hash, and fail if it is not the expected one."""
    found = bits()
    print(
        f"palpate {palpate.__version__}, {sys.platform}, Python {sys.version.split()[0]}: {found}"
    )
    if found != EXPECTED:
        sys.exit(f"error: expected {EXPECTED}; this system gives other bits")


if __name__ == "__main__":
    main()
