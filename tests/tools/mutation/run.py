"""Mutation score of the core: flips one operator after another, and prints the flips that no test detects.

    python tests/tools/mutation/run.py [--count 80] [--seed 1] [--all]

Builds the extension and the native tests once, with headers in which every operator can be flipped, and runs them for
each flip with PALPATE_MUTANT=number until one fails. Needs libclang (pip install libclang) and the test environment.
"""

import argparse
import os
import random
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from sites import FLIPPED, Site, rewritten, sites

HERE = Path(__file__).parent
ROOT = HERE.parents[2]
HEADERS = (
    "arithmetic bank ring square_root tracker estimator/handover estimator/innovation_noise estimator/instrument "
    "estimator/rls estimator/two_sided_cusum policy/bound policy/detector policy/forgetting stage/align stage/baseline "
    "stage/contact"
)
NATIVE = "stages touch bank ring handover square_root"
TESTS = (
    "core/handover_reference core/against_reference binding/ring binding/bank binding/estimators binding/tracker "
    "core/touches core/handheld binding/calls binding/pickle core/properties core/extremes"
)
COMPILES = "tests/core/test_extremes.py::test_lambda_1_for_ten_million_samples"
"""Not run: it builds its own program from the headers, without the flips."""
NATIVE_S, LIMIT_S = 60, 900
"""Time limits, s: they detect a mutant that hangs. Normally the native tests take 2 s, those in Python a minute."""


@dataclass(frozen=True)
class Mutant:
    """A flip and its place."""

    header: str
    site: Site

    def __str__(self) -> str:
        """Return the line and the flip as text."""
        line = (ROOT / "cpp/include/palpate" / f"{self.header}.hpp").read_text().splitlines()[self.site.line - 1]
        return f"{self.header}.hpp:{self.site.line}: {self.site.operator} -> {FLIPPED[self.site.operator]}   {line.strip()}"


def mutated(copy: Path) -> list[Mutant]:
    """Rewrite the headers of a copy of the project; return all flips."""
    include = copy / "cpp" / "include"
    found = {name: sites(include / "palpate" / f"{name}.hpp", include) for name in HEADERS.split()}
    mutants: list[Mutant] = []
    for name, top in found.items():
        for site in _all(top):
            site.number = len(mutants)
            mutants.append(Mutant(name, site))
    for name, top in found.items():
        header = include / "palpate" / f"{name}.hpp"
        header.write_bytes(rewritten(header.read_bytes(), top))
    return mutants


def _all(top: list[Site]) -> Iterator[Site]:
    for site in top:
        yield site
        yield from _all(site.inside)


def build(copy: Path, target: Path) -> None:
    """Install the copy into a folder."""
    flags = f"-O1 -w -include {HERE / 'mutants.hpp'}"
    options = [f"-Ccmake.define.CMAKE_CXX_FLAGS={flags}", "-Ccmake.define.CMAKE_INTERPROCEDURAL_OPTIMIZATION=OFF"]
    command = [
        sys.executable,
        "-m",
        "pip",
        "install",
        "--quiet",
        "--no-deps",
        "--target",
        str(target),
        *options,
        str(copy),
    ]
    subprocess.run(command, check=True)
    for name in NATIVE.split():
        source, include = copy / "tests/cpp" / f"{name}.cpp", copy / "cpp/include"
        subprocess.run(
            ["c++", "-std=c++17", *flags.split(), f"-I{include}", "-pthread", source, "-o", target / name], check=True
        )


def notices(package: Path, number: int) -> bool:
    """Return whether a test fails or hangs for a mutant; -1: no mutant."""
    natives = [[str(package / name)] for name in NATIVE.split()]
    return any(fails(native, package, number, NATIVE_S) for native in natives) or fails(
        pytest_command(), package, number, LIMIT_S
    )


def pytest_command() -> list[str]:
    """Return the command of the Python tests, until the first failure."""
    files = (Path(name) for name in TESTS.split())
    tests = [str(ROOT / "tests" / file.parent / f"test_{file.name}.py") for file in files]
    return [
        sys.executable,
        "-m",
        "pytest",
        "-x",
        "-q",
        "-n",
        "0",
        "-p",
        "no:cacheprovider",
        *tests,
        "--deselect",
        COMPILES,
    ]


def fails(command: list[str], package: Path, number: int, limit_s: int) -> bool:
    """Run a command with one flip; return whether it fails."""
    environment = os.environ | {"PYTHONPATH": str(package), "PALPATE_MUTANT": str(number)}
    try:
        done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, timeout=limit_s, check=False)
    except subprocess.TimeoutExpired:
        return True
    return done.returncode != 0


def main() -> int:
    """Print the score and the survivors."""
    parser = argparse.ArgumentParser(description="Mutation score of the core.")
    parser.add_argument("--count", type=int, default=80, help="flips to try, drawn from all")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--all", action="store_true", help="try every flip, as .ci/nightly does")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        copy, package = Path(folder) / "copy", Path(folder) / "package"
        shutil.copytree(ROOT, copy, ignore=shutil.ignore_patterns(".*", "build"))
        mutants = mutated(copy)
        build(copy, package)
        if notices(package, -1):
            print("the tests fail without a mutant")
            return 1
        count = len(mutants) if arguments.all else min(arguments.count, len(mutants))
        chosen = sorted(random.Random(arguments.seed).sample(range(len(mutants)), count))
        started, survivors = time.monotonic(), []
        with ThreadPoolExecutor(os.cpu_count()) as pool:
            for number, noticed in zip(chosen, pool.map(partial(notices, package), chosen), strict=True):
                if not noticed:
                    survivors.append(number)
                    print(f"survives  {number:4d}  {mutants[number]}", flush=True)
    killed = len(chosen) - len(survivors)
    seconds = (time.monotonic() - started) / len(chosen)
    print(
        f"{killed} of {len(chosen)} noticed, {killed / len(chosen):.1%}; {len(mutants)} flips there are; {seconds:.0f} s each"
    )
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
