"""Print what became of recordings and streams under each fault: tries, rows that were acknowledged, rows lost.

    python tests/tools/fault_table.py [--moments 200]

The same tests as in the suite, with more random moments.
"""

import argparse
import os
import sys
from pathlib import Path

import pytest

FILES = (
    "recording/test_killed.py",
    "recording/test_disk_faults.py",
    "stream/test_stream_load.py",
    "stream/test_stream_faults.py",
)


def main() -> int:
    """Run them; the table is pytest's summary."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--moments", type=int, default=200, help="random moments at which a recording is killed")
    os.environ["PALPATE_MOMENTS"] = str(parser.parse_args().moments)
    folder = Path(__file__).parents[1]
    return pytest.main(["-q", *(str(folder / name) for name in FILES)])


if __name__ == "__main__":
    sys.exit(main())
