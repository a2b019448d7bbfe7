"""pybind11 or nanobind: one estimator bound in six ways, their sizes and the times of their calls.

    python -m bench.binding [--rounds 200]     prints the tables of docs/binding.md

Needs cmake, a C++ compiler, pybind11, nanobind and nanobind-backend (`pip install -c .ci/tools.txt` installs the
versions that were compared). All ways are timed in turn in each round, and each must give the bits of
`palpate.AdaptiveRls`, or nothing is timed.
"""

import argparse
import importlib
import importlib.util
import subprocess
import sys
import tempfile
import zlib
from collections.abc import Callable
from importlib.metadata import files, version
from pathlib import Path
from statistics import median
from time import perf_counter_ns
from typing import Any

import numpy as np
import palpate
from numpy.typing import NDArray

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
CALLS, BLOCK = 1000, 256

WAYS = {
    "pybind11_own": "pybind11, methods of `methods.hpp`",
    "pybind11_plain": "pybind11, `def`",
    "nanobind_own": "nanobind, methods as in `methods.hpp`",
    "nanobind_plain": "nanobind, `def`",
    "split_own": "nanobind split, stable ABI, methods as in `methods.hpp`",
    "split_plain": "nanobind split, stable ABI, `def`",
}
"""Name of the module, and what it is."""


def built(folder: Path) -> dict[str, Path]:
    """Build the modules in a folder and return their files."""
    options = {"CMAKE_BUILD_TYPE": "Release", "PALPATE_SOURCE": ROOT, "Python_EXECUTABLE": sys.executable}
    for name, call in {"pybind11": "get_cmake_dir", "nanobind": "cmake_dir"}.items():
        options[f"{name}_DIR"] = getattr(importlib.import_module(name), call)()
    for command in (["-S", HERE, "-B", folder, *(f"-D{k}={v}" for k, v in options.items())], ["--build", folder]):
        subprocess.run(["cmake", *map(str, command)], check=True, stdout=subprocess.DEVNULL)
    return {name: next(folder.glob(f"{name}.*.so")) for name in WAYS}


def loaded(name: str, path: Path) -> Any:
    """Import a module from its file and return its estimator's class."""
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.Estimator


def samples(count: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return a press with noise; the ratio is 3."""
    noise = np.random.default_rng(1).normal(0, 1e-4, count)
    regressor = 0.2 + 0.1 * np.sin(np.arange(count) / 40)
    return 3 * regressor + noise, regressor


def check(estimator: Any) -> None:
    """Stop unless calls and blocks have the bits of the package."""
    output, regressor = samples(BLOCK)
    expected = palpate.AdaptiveRls().process(output, regressor).tobytes()
    one, block = estimator(), estimator()
    singles = np.array([one.update(y, x) for y, x in zip(output.tolist(), regressor.tolist(), strict=True)])
    if not singles.tobytes() == np.asarray(block.process(output, regressor)).tobytes() == expected:
        raise SystemExit(f"error: {estimator} has other bits than palpate.AdaptiveRls; nothing was timed")


def calls_of(estimator: Any) -> tuple[Callable[[], float], Callable[[], float]]:
    """Return the two things that are timed, each in ns: a call with a sample, and a call with a block."""
    output, regressor = samples(BLOCK)
    pairs = list(zip(output.tolist(), regressor.tolist(), strict=True)) * (CALLS // BLOCK + 1)
    one = estimator()

    def single() -> float:
        update, todo = one.update, pairs[:CALLS]
        begun = perf_counter_ns()
        for y, x in todo:
            update(y, x)
        return (perf_counter_ns() - begun) / CALLS

    def block() -> float:
        process = one.process
        begun = perf_counter_ns()
        for _ in range(20):
            process(output, regressor)
        return (perf_counter_ns() - begun) / 20

    return single, block


def timed(classes: dict[str, Any], rounds: int) -> dict[str, tuple[list[float], list[float]]]:
    """Time all ways in turn."""
    work = {name: calls_of(estimator) for name, estimator in classes.items()}
    found: dict[str, tuple[list[float], list[float]]] = {name: ([], []) for name in work}
    for _ in range(rounds):
        for name, (single, block) in work.items():
            found[name][0].append(single())
            found[name][1].append(block())
    return found


def backend_bytes() -> tuple[int, int]:
    """Return the size of the package that split mode needs at run time, installed and packed."""
    contents = [
        Path(str(file.locate())).read_bytes() for file in files("nanobind-backend") or () if file.suffix == ".so"
    ]
    return sum(map(len, contents)), sum(len(zlib.compress(content, 9)) for content in contents)


def report(paths: dict[str, Path], found: dict[str, tuple[list[float], list[float]]]) -> None:
    """Print the tables."""
    base = found["pybind11_own"]
    print(
        "| way | file, kB | packed, kB | a sample, ns: minimum, median | ratio | a block of 256, ns: minimum, median | ratio |"
    )
    print("|---|--:|--:|--:|--:|--:|--:|")
    for name, what in WAYS.items():
        content = paths[name].read_bytes()
        sizes = f"{len(content) / 1e3:.0f} | {len(zlib.compress(content, 9)) / 1e3:.0f}"
        cells = [
            f"{min(times):.0f}, {median(times):.0f} | {median(t / b for t, b in zip(times, against, strict=True)):.2f}"
            for times, against in zip(found[name], base, strict=True)
        ]
        print(f"| {what} | {sizes} | {' | '.join(cells)} |")
    installed, packed = backend_bytes()
    print(
        f"\n- nanobind-backend, needed at run time by split mode: {installed / 1e3:.0f} kB, packed {packed / 1e3:.0f} kB"
    )
    core = next(Path(palpate.__file__).parent.glob("_core.*.so")).read_bytes()
    print(f"- the extension of palpate: {len(core) / 1e3:.0f} kB, packed {len(zlib.compress(core, 9)) / 1e3:.0f} kB")


def main() -> None:
    """Build, check, time, print."""
    parser = argparse.ArgumentParser(description="pybind11 or nanobind, in sizes and times")
    parser.add_argument("--rounds", type=int, default=200)
    parser.add_argument("--build", type=Path, help="a folder to build in and to keep")
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        paths = built(asked.build or Path(folder))
        classes = {name: loaded(name, path) for name, path in paths.items()}
        for estimator in classes.values():
            check(estimator)
        names = ("pybind11", "nanobind", "nanobind-backend", "numpy")
        print(f"Python {sys.version.split()[0]}, " + ", ".join(f"{name} {version(name)}" for name in names) + "\n")
        report(paths, timed(classes, asked.rounds))


if __name__ == "__main__":
    main()
