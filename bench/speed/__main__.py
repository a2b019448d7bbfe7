"""Speed and error: calls, blocks, streams and the ring, in comparison with other libraries.

    python -m bench.speed [--rounds 100] [--out bench/results/speed.json]   measure, print, write (docs/speed.md, too)
    python -m bench.speed --table                                           print the table of docs/speed.md

All items are timed alternately in one run; the quotients are the result. Needs cmake and a C++ compiler; uses scipy,
numba, padasip, river and filterpy if they are installed.
"""

import argparse
import json
import platform
import subprocess
import sys
import tempfile
from pathlib import Path
from shutil import which

import palpate
from palpate import _core

from bench.results_age import headers_hash
from bench.speed.limits import Figures, limits
from bench.speed.python_calls import measure_python

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
RESULTS = ROOT / "bench" / "results" / "speed.json"

MARK, END = "<!-- python -m bench.speed --table -->", "<!-- end -->"

SETS = ["baseline", "avx2", "avx512"]
"""Instruction sets of the banks, each with those before it."""


def run(*command: str | Path) -> str:
    """Run a program and return its output."""
    return subprocess.run([str(c) for c in command], check=True, capture_output=True, text=True).stdout


def configure(build: Path, *options: str) -> None:
    """Build the programs of bench/speed/CMakeLists.txt."""
    release = ("-DCMAKE_BUILD_TYPE=Release", f"-DPALPATE_SOURCE={ROOT}")
    run("cmake", "-S", HERE, "-B", build, *release, *options)
    run("cmake", "--build", build, "--parallel", "2")


def measure_native(rounds: int, folder: Path) -> Figures:
    """Build bench/speed/CMakeLists.txt in a folder and run its programs."""
    build = folder / "build"
    configure(build)
    found: Figures = {"compiler": (build / "compiler.txt").read_text().strip()}
    natives = [(build / "blocks", "")]
    natives += [(build / f"blocks_{name}", f"{name}: ") for name in SETS[1 : SETS.index(_core.simd()) + 1]]
    if (clang := which("clang++")) and not found["compiler"].startswith("Clang"):
        configure(folder / "clang", f"-DCMAKE_CXX_COMPILER={clang}")
        natives.append((folder / "clang" / "blocks", "clang: "))
    for program, prefix in natives:
        found |= json.loads(run(program, prefix, str(rounds)))
    found |= json.loads(run(build / "rings", str(max(3, rounds // 3))))
    return found


def processor() -> str:
    """Return the name of the processor."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    return next((line.split(":")[1].strip() for line in lines if line.startswith("model name")), platform.machine())


def commit() -> str:
    """Return the measured commit; with a plus if there are uncommitted changes."""
    try:
        return run("git", "-C", HERE, "describe", "--always", "--dirty=+").strip()
    except (OSError, subprocess.CalledProcessError):
        return "unknown"


def table(figures: Figures) -> str:
    """Print each figure: ns, cycles, and the error of the result."""
    cycle = figures["cycle"]
    lines = [f"{'ns a sample, a call or an item':58} {'min':>9} {'p10':>9} {'median':>9} {'cycles':>8}  error"]
    for name, ns in figures.items():
        if isinstance(ns, dict):
            error = figures.get(f"error, {name}")
            shown = "" if error is None else f"{error:.1e}"
            lines.append(
                f"{name:58} {ns['min']:9.2f} {ns['p10']:9.2f} {ns['median']:9.2f} {ns['min'] / cycle:8.1f}  {shown}"
            )
    return "\n".join(lines)


SHORT = {
    "AdaptiveRls": "`AdaptiveRls`, block",
    "HandoverRls": "`HandoverRls`, block",
    "the paper's form literally": "the paper's equations as printed, block, C++",
    "Python AdaptiveRlsBank(64), 156 rows": "`AdaptiveRlsBank(64)`, from Python, a stream's sample",
    "Python update": "`AdaptiveRls.update`, from Python",
    "numba, a call": "the same step by numba, a call from Python",
    "numpy loop": "the same step in plain Python and numpy",
    "scipy lfilter": "scipy `lfilter` twice, block, fixed forgetting",
    "padasip": "padasip `FilterRLS`",
    "filterpy": "filterpy `FadingKalmanFilter`",
    "river": "river `BayesianLinearRegression`",
}


def short_table(figures: Figures) -> str:
    """Return the table of docs/speed.md."""
    lines = ["| | ns a sample | error of the ratio, rms |", "|---|---|---|"]
    for name, text in SHORT.items():
        if name in figures:
            error = figures.get(f"error, {name}")
            lines.append(f"| {text} | {figures[name]['min']:.3g} | {'' if error is None else f'{error:.1e}'} |")
    return "\n".join(lines)


def with_table(text: str, figures: Figures) -> str:
    """Replace the table between its two marks in the page."""
    before, _, rest = text.partition(MARK)
    return f"{before}{MARK}\n{short_table(figures)}\n{END}{rest.partition(END)[2]}"


def main() -> None:
    """Measure, print and write; or print the table of the last measurement."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--rounds", type=int, default=100, help="repeats of everything")
    parser.add_argument("--out", type=Path, default=RESULTS, help="where the figures go")
    parser.add_argument("--build", type=Path, help="where the native programs are built; it stays")
    parser.add_argument("--table", action="store_true", help="print the table of docs/speed.md from the file")
    options = parser.parse_args()
    if options.table:
        print(short_table(json.loads(options.out.read_text())))
        return
    about = {
        "machine": processor(),
        "python": sys.version.split()[0],
        "palpate": palpate.__version__,
        "commit": commit(),
        "simd": _core.simd(),
        "headers": headers_hash(),
    }
    with tempfile.TemporaryDirectory() as folder:
        native = measure_native(options.rounds, options.build or Path(folder))
    figures = {**about, **native, **measure_python(options.rounds)}
    print(f"{figures['machine']}; {figures['compiler']}; Python {figures['python']}; commit {figures['commit']}")
    print(table(figures), limits(figures), sep="\n\n")
    options.out.write_text(json.dumps(figures, indent=1) + "\n")
    if options.out == RESULTS:
        page = ROOT / "docs" / "speed.md"
        page.write_text(with_table(page.read_text(), figures))


if __name__ == "__main__":
    main()
