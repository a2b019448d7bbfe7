"""Tell whether the results in bench/results are those of the estimator's headers in this tree.

    python -m bench.results_age

Each JSON file of results has the hash of cpp/include/palpate, without comments and spaces, with which it was measured.
Prints a line for each file; exit code 1: a file is older than the headers, or has no hash.
"""

import hashlib
import json
import re
import sys
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
HEADERS, RESULTS = ROOT / "cpp" / "include" / "palpate", ROOT / "bench" / "results"


def headers_hash(folder: Path = HEADERS) -> str:
    """Return the hash of all headers of a folder; comments and white space do not count."""
    found = hashlib.sha256()
    for path in sorted(folder.rglob("*.hpp")):
        code = re.sub(r"//.*", "", path.read_text(encoding="utf-8"))
        found.update(f"{path.relative_to(folder).as_posix()}\n{' '.join(code.split())}\n".encode())
    return found.hexdigest()[:16]


def ages(results: Path = RESULTS, headers: Path = HEADERS) -> Iterator[tuple[str, bool]]:
    """Return name and verdict of each file of results: whether it was measured with these headers."""
    now = headers_hash(headers)
    for path in sorted(results.glob("*.json")):
        yield path.name, json.loads(path.read_text(encoding="utf-8")).get("headers") == now


def main() -> None:
    """Print the verdicts."""
    found = dict(ages())
    for name, current in found.items():
        print(f"bench/results/{name}: {'current' if current else 'OLDER than cpp/include/palpate: measure again'}")
    sys.exit(not all(found.values()))


if __name__ == "__main__":
    main()
