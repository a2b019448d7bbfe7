"""Own recordings: CPU time of a row read and written, beside pyarrow.csv, one thread. `python -m bench.speed.recordings`."""

import statistics
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import click
import numpy as np
import palpate
import pyarrow
import pyarrow.csv
from palpate.recording import sidecar
from palpate.recording.codes import Codes
from palpate.recording.own_file import Recorded
from palpate.recording.rows import format_rows, parse_rows
from palpate.recording.writer import Writer
from palpate.samples import Block, blank


def samples(count: int, *, coded: bool) -> Block:
    """Return noisy samples, with codes of an AD7746 or without any."""
    rng = np.random.default_rng(1)
    block = blank(count)
    block["t_hard_ns"] = np.arange(count) * 26_000_000 + rng.integers(0, 1000, count)
    block["t_soft_ns"], block["t_uncertainty_us"] = block["t_hard_ns"] + 13_000_000, 150
    for name, level in (("hard", 10_388_608), ("soft", 9_288_608)):
        block[name] = rng.normal(0.5, 0.001, count)
        if coded:
            block[f"{name}_raw"] = level + rng.integers(-3000, 3000, count)
            block[name] = (block[f"{name}_raw"] - Codes().zero) / Codes().per_pF
    return block


def written(path: Path, block: Block) -> None:
    """Write a recording."""
    writer = Writer(path.absolute(), sidecar.fresh({}, {}, []))
    for first in range(0, len(block), 4096):
        writer.write(block[first : first + 4096])
    writer.checkpoint({})
    writer.end({}, {"dropped": 0, "counters": {}})


def in_words(block: Block) -> bytes:
    """Return the rows as text, formatted by Python: how they were written before the core could."""

    def seconds(ns: int) -> str:
        whole, rest = divmod(abs(ns), 1_000_000_000)
        return f"{'-' if ns < 0 else ''}{whole}.{rest:09d}"

    return "".join(
        f"{seq},{seconds(t_hard)},{seconds(t_soft)},{hard_raw},{soft_raw},{hard!r},{soft!r},{uncertainty},{status}\n"
        for seq, t_hard, t_soft, hard_raw, soft_raw, hard, soft, status, uncertainty in block.tolist()
    ).encode()


def ways(path: Path, block: Block) -> dict[str, Callable[[], int]]:
    """Return what is timed, by name; each returns its number of rows."""
    one_thread = pyarrow.csv.ReadOptions(use_threads=False)
    part = block[:4096]
    text = format_rows(part)
    if text != in_words(part):
        raise SystemExit("the core writes other bytes than Python")
    return {
        "pyarrow.csv, the file": lambda: len(pyarrow.csv.read_csv(path, read_options=one_thread)),
        "palpate, the file in blocks": lambda: sum(map(len, Recorded(path).blocks())),
        "palpate.read": lambda: len(palpate.read(path).hard),
        "rows of a block": lambda: len(parse_rows(text)),
        "written by Python": lambda: len(in_words(part)) and len(part),
        "written by the core": lambda: len(format_rows(part)) and len(part),
    }


def measured(work: dict[str, Callable[[], int]], repeats: int) -> dict[str, list[float]]:
    """Return CPU time in ns a row, of all in turn."""
    times: dict[str, list[float]] = {name: [] for name in work}
    for _ in range(repeats):
        for name, run in work.items():
            begin = time.process_time_ns()
            rows = run()
            times[name].append((time.process_time_ns() - begin) / rows)
    return times


@click.command()
@click.option("--rows", default=40_000, show_default=True, type=click.IntRange(min=4096))
@click.option("--repeats", default=30, show_default=True, type=click.IntRange(min=2))
def main(rows: int, repeats: int) -> None:
    """Print CPU time in ns a row, minimum and median, and the two quotients."""
    pyarrow.set_cpu_count(1)
    with tempfile.TemporaryDirectory() as folder:
        for coded in (True, False):
            path = Path(folder) / f"coded-{coded}.csv"
            block = samples(rows, coded=coded)
            written(path, block)
            times = measured(ways(path, block), repeats)
            click.echo(f"{'with codes' if coded else 'without codes':28}  min  median, ns a row")
            for name, found in times.items():
                click.echo(f"{name:28} {min(found):5.0f} {statistics.median(found):7.0f}")
            for top, bottom in (
                ("palpate, the file in blocks", "pyarrow.csv, the file"),
                ("written by the core", "written by Python"),
            ):
                of_min, of_median = (what(times[top]) / what(times[bottom]) for what in (min, statistics.median))
                click.echo(f"{top} / {bottom}: {of_min:.3f}, of the medians {of_median:.3f}")


if __name__ == "__main__":
    main()
