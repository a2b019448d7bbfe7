"""Choice of one ratio from four touches: order of ten specimens, and error of a modulus, for each method.

    python -m bench.accuracy.reliability [--seeds 1000] [--out bench/results]

A characterisation is the ten specimens of the paper's Table I and an eleventh object of random modulus (0.2 to
6 MPa), touched four times each by a simulated hand. The order is right if the ten chosen ratios increase with the
modulus; the modulus of the eleventh object is from a calibration on the ten, with the same method. Prints the table,
and writes it with a figure; needs scipy and matplotlib.
"""

import argparse
import json
import math
import os
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import palpate
from palpate.calibration.characterise import CHOICES, Specimen, calibrate, choose, rises
from palpate.elasticity import SORBOTHANE_MPA
from palpate.simulation.hand import Hand, session

from bench.results_age import headers_hash

BENCH = Path(__file__).parents[1]
HANDS = {
    "oblique 1 %": Hand(oblique=0.01),
    "oblique 3 %": Hand(oblique=0.03),
    "oblique 5 %": Hand(oblique=0.05),
    "oblique 10 %": Hand(oblique=0.10),
    "3 %, less when firm": Hand(oblique=0.03, firm=1.0),
    "1 %, light presses": Hand(oblique=0.01, press_pF=0.02, press_spread=1.2),
    "3 %, one in four slips": Hand(oblique=0.03, slips=0.25),
}
"""A simulated hand: scatter of the ratio between touches, and its other settings."""
NAMES = {
    "mean": "mean of four",
    "covariance": "smallest P (the paper)",
    "standard_error": "smallest standard error",
    "weighted": "weighted mean",
    "agreement": "nearest to the mean",
    "all": "every touch",
}
UNKNOWN = "eleventh"


@dataclass(frozen=True)
class Outcome:
    """One characterisation with one method."""

    rises: bool
    error: float  # log(estimated / true modulus) of the eleventh object; nan: no value
    covered: bool
    width: float  # log(high / low)


@dataclass(frozen=True)
class Row:
    """All characterisations with one hand and one method."""

    hand: str
    by: str
    order_right: float
    median_error: float  # of |estimated / true - 1|, to first order
    rms_error: float
    coverage: float
    width: float
    left_out: int  # no touch to choose from, or no value by eq. (2)


def characterisation(hand: Hand, seed: int) -> dict[str, Outcome | None]:
    """Return the outcome for each method; None: an object has no touch to choose from."""
    modulus = math.exp(np.random.default_rng([seed, 99]).uniform(math.log(0.2), math.log(6.0)))
    runs = session(seed, hand=hand, moduli={**SORBOTHANE_MPA, UNKNOWN: modulus})
    touches = {name: palpate.touches(run) for name, run in runs.items()}
    specimens = [Specimen(name, E, touches[name]) for name, E in SORBOTHANE_MPA.items()]
    found: dict[str, Outcome | None] = {}
    for by in CHOICES:
        try:
            found[by] = _outcome(specimens, touches[UNKNOWN], modulus, by)
        except (ValueError, palpate.CalibrationError):
            found[by] = None
    return found


def _outcome(specimens: list[Specimen], unknown: list[palpate.Touch], modulus: float, by: str) -> Outcome:
    one = "mean" if by == "all" else by
    ordered = rises([choose(s.touches, one).ratio for s in specimens])
    probed = choose(unknown, one)
    value, low, high = calibrate(specimens, by=by).modulus(probed.ratio, probed.standard_error, touches=probed.touches)
    return Outcome(
        ordered, math.log(value / modulus), low <= modulus <= high, math.log(high / low) if low else math.inf
    )


def summarise(hand: str, by: str, outcomes: Iterable[Outcome | None]) -> Row:
    """Reduce the characterisations to a row."""
    listed = list(outcomes)
    kept = [o for o in listed if o is not None]
    errors = np.array([o.error for o in kept])
    return Row(
        hand,
        by,
        order_right=float(np.mean([o.rises for o in kept])),
        median_error=float(np.nanmedian(np.abs(errors))),
        rms_error=float(np.sqrt(np.nanmean(errors**2))),
        coverage=float(np.mean([o.covered for o in kept])),
        width=float(np.median([o.width for o in kept])),
        left_out=len(listed) - int(np.isfinite(errors).sum()),
    )


def study(seeds: int) -> list[Row]:
    """Run every hand, on every processor."""
    rows = []
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        for name, hand in HANDS.items():
            runs = list(pool.map(characterisation, [hand] * seeds, range(seeds), chunksize=10))
            rows += [summarise(name, by, (run[by] for run in runs)) for by in NAMES]
    return rows


def table(rows: Iterable[Row]) -> str:
    """Return the rows as text."""
    lines = [
        f"{'hand':23} {'chosen by':24} {'order':>7} {'error: median':>14} {'rms':>7} {'95 % covers':>12} {'left out':>9}"
    ]
    before = ""
    for row in rows:
        lines += [""] if before not in ("", row.hand) else []
        before = row.hand
        lines.append(
            f"{row.hand:23} {NAMES[row.by]:24} {100 * row.order_right:5.1f} % {100 * row.median_error:12.2f} %"
            f" {100 * row.rms_error:5.2f} % {100 * row.coverage:10.1f} % {row.left_out:9}"
        )
    return "\n".join(lines)


def figure(rows: list[Row], path: Path, seeds: int) -> None:
    """Plot order and error side by side."""
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    drawing, axes = plt.subplots(1, 2, figsize=(9.5, 5.0), sharey=True, layout="constrained")
    shown = [by for by in NAMES if by != "all"]
    height = 0.8 / len(shown)
    for number, by in enumerate(shown):
        own = [row for row in rows if row.by == by]
        at = np.arange(len(own)) + (number - (len(shown) - 1) / 2) * height
        axes[0].barh(at, [100 * row.order_right for row in own], height, label=NAMES[by])
        axes[1].barh(at, [100 * row.rms_error for row in own], height)
    axes[0].set_yticks(range(len(HANDS)), list(HANDS))
    axes[0].invert_yaxis()
    axes[0].set_xlabel("the ten in the right order, % (more is better)")
    axes[1].set_xlabel("error of an eleventh modulus, rms, % (less is better)")
    for ax in axes:
        ax.grid(axis="x", alpha=0.3)
        ax.set_axisbelow(True)
    drawing.legend(loc="outside upper center", ncols=3, fontsize=9, frameon=False)
    drawing.supxlabel(f"{seeds} simulated characterisations: ten specimens, four touches each", fontsize=9)
    drawing.savefig(path, dpi=130)
    plt.close(drawing)


def main() -> None:
    """Run, print, write."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--seeds", type=int, default=1000, help="characterisations by each hand")
    parser.add_argument("--out", type=Path, default=BENCH / "results", help="folder for the JSON and the figure")
    arguments = parser.parse_args()
    rows = study(arguments.seeds)
    text = table(rows)
    print(text)
    arguments.out.mkdir(parents=True, exist_ok=True)
    document = {"palpate": palpate.__version__, "headers": headers_hash(), "seeds": arguments.seeds,
                "rows": [asdict(row) for row in rows]}  # fmt: skip
    (arguments.out / "reliability.json").write_text(json.dumps(document, indent=1) + "\n")
    (arguments.out / "reliability.txt").write_text(text + "\n")
    figure(rows, arguments.out / "reliability.png", arguments.seeds)


if __name__ == "__main__":
    main()
