"""Print the effect of each fault on recordings and streams: tries, acknowledged rows, lost rows.

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
    "recording/test_disturbed.py",
    "recording/test_rescue.py",
    "stream/test_stream_load.py",
    "stream/test_stream_faults.py",
)


def main() -> int:
    """Run the tests; the table is in the summary of pytest."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--moments", type=int, default=200, help="random moments at which a recording is killed")
    os.environ["PALPATE_MOMENTS"] = str(parser.parse_args().moments)
    folder = Path(__file__).parents[1]
    return pytest.main(["-q", *(str(folder / name) for name in FILES)])


if __name__ == "__main__":
    sys.exit(main())
