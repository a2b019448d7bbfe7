"""Touches of many recordings: one by one, in threads, and over Dask. `python -m bench.speed.fleet`."""

import os
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import click
import dask
import palpate
from palpate import Touch
from palpate.calibration.specimen_files import write_session
from palpate.simulation.hand import session

Found = list[list[Touch]]
REPEATS = 3


def ways(paths: list[Path], jobs: int) -> dict[str, Callable[[], Found]]:
    """Return the ways to estimate all recordings, by name."""

    def over_dask(scheduler: str) -> Found:
        tasks = [dask.delayed(palpate.touches)(path) for path in paths]
        found: tuple[list[Touch], ...] = dask.compute(*tasks, scheduler=scheduler, num_workers=jobs)
        return list(found)

    return {
        "one by one": lambda: [palpate.touches(path) for path in paths],
        f"jobs={jobs}": lambda: palpate.touches(paths, jobs=jobs),
        "Dask, threads": lambda: over_dask("threads"),
        "Dask, processes": lambda: over_dask("processes"),
    }


def in_memory(paths: list[Path], jobs: int) -> dict[str, Callable[[], Found]]:
    """Return the same for recordings that are in memory already."""
    recordings = [palpate.read(path) for path in paths]
    return {
        "in memory, one by one": lambda: [palpate.touches(recording) for recording in recordings],
        f"in memory, jobs={jobs}": lambda: palpate.touches(recordings, jobs=jobs),
    }


def written(folder: Path, files: int, touches: int) -> list[Path]:
    """Write simulated recordings."""
    moduli = {f"s{number}": 1.0 for number in range(files)}
    made = session(moduli=moduli, touches=touches)
    return write_session(folder, {name: run.block() for name, run in made.items()}, moduli)[:-1]


@click.command()
@click.option("--files", default=64, show_default=True, type=click.IntRange(min=1))
@click.option("--touches", default=8, show_default=True, type=click.IntRange(min=1), help="Touches in each file.")
@click.option("--jobs", default=os.cpu_count() or 1, show_default=True, type=click.IntRange(min=1))
def main(files: int, touches: int, jobs: int) -> None:
    """Print ms for each file, minimum and largest of several runs in turn; the touches have to be equal bit for bit."""
    with tempfile.TemporaryDirectory() as folder:
        paths = written(Path(folder), files, touches)
        size = sum(path.stat().st_size for path in paths) / files / 1e6
        click.echo(f"{files} files of {size:.2f} MB, {os.cpu_count()} processors")
        work = ways(paths, jobs) | in_memory(paths, jobs)
        expected = work["one by one"]()
        times: dict[str, list[float]] = {name: [] for name in work}
        for _ in range(REPEATS):
            for name, run in work.items():
                begin = time.perf_counter()
                found = run()
                times[name].append((time.perf_counter() - begin) / files * 1e3)
                if [[str(touch) for touch in one] for one in found] != [
                    [str(touch) for touch in one] for one in expected
                ]:
                    raise SystemExit(f"{name}: other touches than one by one")
    click.echo(f"{'':24} ms a file  largest")
    for name, measured in times.items():
        click.echo(f"{name:24} {min(measured):9.2f}  {max(measured):7.2f}")


if __name__ == "__main__":
    main()
