"""Required results of HandoverRls and VectorRls on any two signals, each with its bound and the same number of rivals.

    python -m bench.accuracy.any_two_signals [--seeds 40] [THEME ...]

A row `holds`, FAILS, or is `known` not to hold, with the reason below it. Exit code 1: one FAILS. Needs the extra science.
A standard error that is nan is an interval that does not hold, in every row.
"""

import argparse
import os
import sys
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor

from bench.accuracy.signal_rows import THEMES, Row


def rows_of(theme: str, seeds: int) -> list[Row]:
    """Return the rows of one theme; arguments are plain, for a process of its own."""
    return list(THEMES[theme](seeds))


def any_fails(rows: Iterable[Row]) -> bool:
    """Return whether a row fails."""
    return any(row.verdict == "FAILS" for row in rows)


def main() -> None:
    """Print the rows."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("themes", nargs="*", choices=[[], *THEMES], help="default: all")
    parser.add_argument("--seeds", type=int, default=40, help="runs of each row, or a multiple")
    options = parser.parse_args()
    if options.seeds < 1:
        parser.error(f"--seeds is {options.seeds}; give 1 or more")
    chosen = options.themes or list(THEMES)
    failed = False
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        for rows in pool.map(rows_of, chosen, [options.seeds] * len(chosen)):
            print(*rows, sep="\n", flush=True)
            failed |= any_fails(rows)
    sys.exit(failed)


if __name__ == "__main__":
    main()
