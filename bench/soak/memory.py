"""Memory use of the ring and the tracker over a long time.

    python -m bench.soak.memory [--native 1000000000] [--samples 50000000]

Prints the resident set at the start, at each quarter and at the end: of a native program with two threads, sample by
sample; and of Python with `SampleRing` and `Tracker.process`, in blocks. Needs a C++ compiler and /proc of Linux.
"""

import argparse
import json
import os
import subprocess
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import palpate

HERE = Path(__file__).parent
ALLOWED_KB = 1024
_BLOCK = 4096


def native(samples: int) -> dict[str, Any]:
    """Build and run memory.cpp."""
    with tempfile.TemporaryDirectory() as folder:
        program = Path(folder) / "memory"
        flags = ["-O2", "-std=c++17", "-ffp-contract=off", "-pthread", f"-I{palpate.get_include()}"]
        subprocess.run(["c++", *flags, str(HERE / "memory.cpp"), "-o", str(program)], check=True)
        found = json.loads(subprocess.run([program, str(samples)], check=True, capture_output=True).stdout)
    assert isinstance(found, dict)
    return found


def resident_kb() -> int:
    """Return the resident set of this process."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") // 1024


def _presses() -> Any:
    """Return a block of pairs: presses of 250 samples, with noise; a whole number of them."""
    rows = np.zeros(_BLOCK, palpate.SampleRing().dtype)
    press = np.where(np.arange(_BLOCK) % 512 < 250, 0.25, 0.0)
    noise = 1e-5 * np.random.default_rng(0).standard_normal((2, _BLOCK))
    rows["hard"], rows["soft"] = 0.5 + 2.5 * press + noise[0], 0.25 + press + noise[1]
    return rows


def python(samples: int) -> dict[str, Any]:
    """Push, pop and process blocks. A tracker keeps its touches, so from time to time a new tracker is used."""
    rows, taken = _presses(), np.empty(_BLOCK, palpate.SampleRing().dtype)
    ring, resident, touches, received = palpate.SampleRing(2 * _BLOCK), [], 0, 0
    tracker = palpate.Tracker()
    blocks = max(samples // _BLOCK, 8)
    for block in range(blocks):
        if block % 32 == 0:
            touches += len(tracker.touches)
            tracker = palpate.Tracker()
        rows["t_hard_ns"] = (block * _BLOCK + np.arange(_BLOCK)) * 26_000_000
        rows["t_soft_ns"] = rows["t_hard_ns"] + 13_000_000
        ring.push_many(rows)
        count = ring.pop_many(taken)
        tracker.process(taken["t_hard_ns"], taken["t_soft_ns"], taken["hard"], taken["soft"])
        received += count
        if block == blocks // 100 or (block + 1) % (blocks // 4) == 0:
            resident.append(resident_kb())
    touches += len(tracker.touches)
    return {"samples": received, "dropped": ring.dropped, "touches": touches, "resident_kB": resident[:5]}


def growth_kb(found: dict[str, Any]) -> int:
    """Return the growth of the resident set since the start."""
    return int(max(found["resident_kB"]) - found["resident_kB"][0])


def main() -> None:
    """Print both."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--native", type=int, default=1_000_000_000, help="samples of the native program")
    parser.add_argument("--samples", type=int, default=50_000_000, help="samples in Python")
    options = parser.parse_args()
    for name, found in (("native", native(options.native)), ("Python", python(options.samples))):
        print(
            f"{name}: {found['samples']:.3g} samples, {found['touches']} touches, {found['dropped']} dropped; resident kB at "
            f"the start, quarters and end {found['resident_kB']}: {growth_kb(found):+d}, allowed {ALLOWED_KB}"
        )


if __name__ == "__main__":
    main()
