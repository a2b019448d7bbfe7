"""With which headers the results in bench/results were measured.

    python -m bench.results_age

Prints a line for each JSON file of results; exit code 1: a file is older than the headers, or does not say.
"""

import hashlib
import json
import platform
import re
import subprocess
import sys
from pathlib import Path

import palpate

OLDER = "OLDER than cpp/include/palpate: measure again"
ROOT = Path(__file__).parents[1]
HEADERS = ROOT / "cpp" / "include" / "palpate"
RESULTS = ROOT / "bench" / "results"


def headers_hash(folder: Path = HEADERS) -> str:
    """Return the hash of all headers of a folder; comments and white space do not count."""
    found = hashlib.sha256()
    for path in sorted(folder.rglob("*.hpp")):
        code = re.sub(r"//.*", "", path.read_text(encoding="utf-8"))
        found.update(f"{path.relative_to(folder).as_posix()}\n{' '.join(code.split())}\n".encode())
    return found.hexdigest()[:16]


def about() -> dict[str, str]:
    """Return machine, versions, commit (with a plus if there are uncommitted changes) and hash of the headers."""
    if sys.platform == "linux":
        cpu = re.search(r"model name\s*: (.*)", Path("/proc/cpuinfo").read_text())
    else:
        cpu = None
    git = ["git", "-C", str(ROOT), "describe", "--always", "--dirty=+"]
    commit = subprocess.run(git, capture_output=True, text=True, check=False).stdout.strip()
    return {
        "machine": cpu[1] if cpu else platform.machine(),
        "python": platform.python_version(),
        "palpate": palpate.__version__,
        "commit": commit or "unknown",
        "headers": headers_hash(),
    }


def main(results: Path = RESULTS) -> int:
    """Print the verdicts."""
    verdicts = {path: verdict(path) for path in sorted(results.glob("*.json"))}
    for path, text in verdicts.items():
        print(f"bench/results/{path.name}: {text}")
    return OLDER in verdicts.values()


def verdict(path: Path) -> str:
    """Return whether a result is current, older than the headers, or kept to be compared with."""
    document = json.loads(path.read_text())
    if document.get("kept"):
        return "kept: later results are compared with it"
    return "current" if document.get("headers") == headers_hash() else OLDER


if __name__ == "__main__":
    sys.exit(main())
