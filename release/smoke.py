"""Check that an installed wheel loads and gives the bits of every system: `python release/smoke.py`, which takes a second.

It needs numpy, palpate and the recording of the tests, nothing else.
"""

import hashlib
import sys
from pathlib import Path

import numpy as np
import palpate

RECORDING = Path(__file__).parents[1] / "tests" / "data" / "four-specimens.csv"
# What this program prints. A commit that changes the estimators on purpose changes it, and says so.
EXPECTED = "5e8faa464095fe2f2acb751616649ca068f82bed1dd4648eaad8d83fc0466153"


def bits() -> str:
    """Return the SHA-256 of the rows and touches of every scene, and of a bank."""
    digest = hashlib.sha256()
    data = palpate.read(RECORDING)
    for scene in ("fixed", "handheld", "paper", "sliding"):
        rows = palpate.Tracker(scene).process(data.t_hard_s, data.t_soft_s, data.hard, data.soft)
        for name in rows.dtype.names or ():
            digest.update(rows[name].astype(rows[name].dtype.newbyteorder("<")).tobytes())
        for touch in palpate.touches(data, scene=scene):
            flags = ",".join(touch.flags)
            row = f"{touch.ratio.hex()} {touch.standard_error.hex()} {flags}\n"
            digest.update(row.encode())
    scale = 1 + np.arange(21) / 16
    ratios = palpate.Bank(palpate.HandoverRls(), 21).process(
        data.hard[:, None] * scale, data.soft[:, None] / scale
    )
    digest.update(ratios.astype("<f8").tobytes())
    return digest.hexdigest()


def main() -> None:
    """Print the hash, and fail if it is not the expected one."""
    digest = bits()
    version = sys.version.split()[0]
    print(f"palpate {palpate.__version__}, {sys.platform}, Python {version}: {digest}")
    if digest != EXPECTED:
        sys.exit(f"error: expected {EXPECTED}; this system gives other bits")


if __name__ == "__main__":
    main()
