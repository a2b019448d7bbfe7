"""`palpate bench`: error and run time of the estimators."""

import json
import math
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import click

from palpate.cli.options import json_option
from palpate.cli.progress import Progress

if TYPE_CHECKING:
    from palpate.benchmark import Row


@click.command()
@click.option("--seeds", default=20, show_default=True, type=click.IntRange(min=1), help="Recordings of each scenario.")
@click.option("--scenario", "names", multiple=True, metavar="NAME", help="Only this scenario; may be repeated.")
@json_option
def bench(seeds: int, names: tuple[str, ...], as_json: bool) -> None:
    """Compare estimators on simulated touches: error and run time.

    The full benchmark (other libraries, cost of each stage, a figure) is in the folder bench/ of the source.

    \b
    Example:
      palpate bench --seeds 50
      palpate bench --scenario tremor --scenario step-up --json
    """  # noqa: D301
    from palpate import benchmark

    for name in names:
        if name not in benchmark.SINGLE:
            raise click.UsageError(f"--scenario: got {name!r}, allowed: {', '.join(benchmark.SINGLE)}")
    with Progress("bench", "scenarios") as progress:
        rows = benchmark.compare(seeds, progress.over(names or benchmark.SINGLE))
    click.echo(_json(seeds, rows) if as_json else benchmark.table(rows))


def _json(seeds: int, rows: "list[Row]") -> str:
    plain = [{name: _known(value) for name, value in asdict(row).items()} for row in rows]
    return json.dumps({"seeds": seeds, "rows": plain}, indent=2, allow_nan=False)


def _known(value: Any) -> Any:
    return None if isinstance(value, float) and math.isnan(value) else value
