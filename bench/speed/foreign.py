"""A table of another program, read by palpate and by pandas: time and memory. `python -m bench.speed.foreign`.

Times are those of the processor, side by side in one process. Memory is the largest of a process of its own, above what it
had after it read a table of a few rows; the arrays that it returns are in it.
"""

import gzip
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import click
import numpy as np
import palpate
import pandas as pd

READERS = {"palpate": palpate.read, "pandas": pd.read_csv}
_CHILD = """
import sys
from pathlib import Path
import palpate, pandas
def peak():
    return int(next(line for line in Path("/proc/self/status").open() if line.startswith("VmHWM")).split()[1]) * 1024
read = {"palpate": palpate.read, "pandas": pandas.read_csv, "replay": lambda path: palpate.touches(palpate.recorded(path))}
read[sys.argv[1]](sys.argv[2])
before = peak()
kept = read[sys.argv[1]](sys.argv[3])
print(peak() - before)
"""


def write(path: Path, rows: int) -> Path:
    """Write a table of times and two channels with a press every 4 s."""
    random = np.random.default_rng(1)
    t = np.arange(rows) / 38.4
    press = np.clip(np.sin(2 * np.pi * t / 4), 0, None)
    columns = (t, *(at + by * press + random.normal(0, 2e-4, rows) for at, by in ((6, 0.5), (4, 0.9))))
    table = pd.DataFrame(dict(zip(("time (s)", "C1 (pF)", "C2 (pF)"), columns, strict=True)))
    table.to_csv(path, index=False, float_format="%.6f")
    return path


def seconds(path: Path, repeats: int) -> dict[str, list[float]]:
    """Return the processor time of each reader, in turn."""
    found: dict[str, list[float]] = {name: [] for name in READERS}
    for _ in range(repeats):
        for name, read in READERS.items():
            begin = time.process_time()
            read(path)
            found[name].append(time.process_time() - begin)
    return found


def require_equal(path: Path) -> None:
    """Compare what both read."""
    ours: Any = palpate.read(path)
    theirs = pd.read_csv(path).to_numpy()
    assert np.allclose(np.c_[ours.t_hard_s, ours.hard, ours.soft], theirs, rtol=1e-15, atol=0)


def memory(reader: str, few: Path, path: Path) -> int:
    """Return the bytes that a process takes to read a table."""
    done = subprocess.run([sys.executable, "-c", _CHILD, reader, few, path], capture_output=True, text=True, check=True)
    return int(done.stdout)


@click.command()
@click.option("--rows", default=1_000_000, show_default=True)
@click.option("--repeats", default=10, show_default=True)
def main(rows: int, repeats: int) -> None:
    """Print the times a row, their quotient, and the memory."""
    with tempfile.TemporaryDirectory() as folder:
        path, few = write(Path(folder) / "table.csv", rows), write(Path(folder) / "few.csv", 1000)
        require_equal(few)
        require_equal(path)
        found = seconds(path, repeats)
        for name, each in found.items():
            click.echo(f"{name:8} {min(each) / rows * 1e9:6.1f} ns a row, median {np.median(each) / rows * 1e9:6.1f}")
        quotients = np.divide(found["palpate"], found["pandas"])
        least = min(found["palpate"]) / min(found["pandas"])
        click.echo(f"palpate / pandas: {least:.2f} of the minima, median {np.median(quotients):.2f}")
        packed = path.with_suffix(".csv.gz")
        packed.write_bytes(gzip.compress(path.read_bytes(), 1))
        for reader, file in (("palpate", path), ("palpate", packed), ("replay", path), ("pandas", path)):
            size = memory(reader, few, file)
            click.echo(f"{reader:8} {file.name:13} {size / 2**20:6.0f} MiB at the most, {size / rows:5.1f} bytes a row")


if __name__ == "__main__":
    main()
