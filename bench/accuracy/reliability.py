"""Choice of one ratio from four touches: what a touch knows of its error, order of ten specimens, error of a modulus.

    python -m bench.accuracy.reliability [--seeds 200] [--out bench/results]

A session is the ten specimens of the paper's Table I and an eleventh object of random modulus (0.2 to 6 MPa), touched
four times each by a simulated hand (`bench.accuracy.hands`); seeds 0, 1, ... The first table is the rank correlation,
within an object, between a number of the touch and the true error of its ratio: 1 if it puts the touches in the order
of their errors, 0 if it knows nothing. In the second the order is right if the ten chosen ratios increase with the
modulus; the modulus of the eleventh object is from a calibration on the ten, with the same method. Prints the tables,
and writes them with figures; needs scipy and matplotlib.
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
from palpate.calibration.characterise import Specimen, calibrate, choose, rises
from palpate.elasticity import SORBOTHANE_MPA
from palpate.simulation.hand import Hand

from bench.accuracy import reliability_figure, touch_ranks
from bench.accuracy.hands import HANDS, MISFITS, UNKNOWN, Session, recorded
from bench.accuracy.touch_ranks import Known, RankRow
from bench.results_age import headers_hash

BENCH = Path(__file__).parents[1]


@dataclass(frozen=True)
class Method:
    """How to choose: one of `CHOICES`, of touches with or without flags of the model's test, by a scene."""

    label: str
    by: str
    accept: tuple[str, ...] = MISFITS
    paper: bool = False


METHODS = {
    "mean": Method("mean of four", "mean"),
    "level": Method("mean weighted by level", "level"),
    "unflagged": Method("mean without flagged", "mean", accept=()),
    "weighted": Method("mean weighted by error", "weighted"),
    "agreement": Method("nearest to the mean", "agreement"),
    "covariance": Method("smallest P", "covariance"),
    "paper": Method("smallest P, scene paper", "covariance", paper=True),
    "standard_error": Method("smallest standard error", "standard_error"),
    "all": Method("every touch", "all"),
}


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


def characterisation(seen: Session) -> dict[str, Outcome | None]:
    """Return the outcome for each method; None: an object has no touch to choose from."""
    found: dict[str, Outcome | None] = {}
    for name, method in METHODS.items():
        try:
            found[name] = _outcome(seen, method)
        except (ValueError, palpate.CalibrationError):
            found[name] = None
    return found


def _outcome(seen: Session, method: Method) -> Outcome:
    touches = seen.paper if method.paper else seen.touches
    specimens = [Specimen(name, E, touches[name], method.accept) for name, E in SORBOTHANE_MPA.items()]
    one = "mean" if method.by == "all" else method.by
    ordered = rises([s.choose(one).ratio for s in specimens])
    probed = choose(touches[UNKNOWN], one, method.accept)
    calibration = calibrate(specimens, by=method.by)
    value, low, high = calibration.modulus(probed.ratio, probed.standard_error, touches=probed.touches)
    width = math.log(high / low) if low else math.inf
    return Outcome(ordered, math.log(value / seen.modulus), low <= seen.modulus <= high, width)


def summarise(hand: str, by: str, outcomes: Iterable[Outcome | None]) -> Row:
    """Reduce the characterisations to a row."""
    listed = list(outcomes)
    kept = [o for o in listed if o is not None]
    errors = np.array([o.error for o in kept if math.isfinite(o.error)])
    return Row(
        hand,
        by,
        order_right=_mean([o.rises for o in kept]),
        median_error=float(np.median(np.abs(errors))) if len(errors) else math.nan,
        rms_error=_mean(errors**2) ** 0.5,
        coverage=_mean([o.covered for o in kept]),
        width=float(np.median([o.width for o in kept])) if kept else math.nan,
        left_out=len(listed) - len(errors),
    )


def _mean(values: Iterable[float]) -> float:
    listed = list(values)
    return float(np.mean(listed)) if listed else math.nan


def judged(hand: Hand, seed: int) -> tuple[Known, dict[str, Outcome | None]]:
    """Simulate one session; return what its touches know, and the outcomes."""
    seen = recorded(hand, seed)
    return touch_ranks.known(seen), characterisation(seen)


def study(seeds: int) -> tuple[list[RankRow], list[Row]]:
    """Run every hand, on every processor."""
    ranks, rows = [], []
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        for name, hand in HANDS.items():
            runs = list(pool.map(judged, [hand] * seeds, range(seeds), chunksize=10))
            ranks.append(touch_ranks.rank_row(name, (known for known, _ in runs)))
            rows += [summarise(name, by, (outcomes[by] for _, outcomes in runs)) for by in METHODS]
    return ranks, rows


def table(rows: Iterable[Row]) -> str:
    """Return the rows as text."""
    lines = [
        f"{'hand':29} {'chosen by':24} {'order':>7} {'error: median':>14} {'rms':>7} {'95 % covers':>12} {'left out':>9}"
    ]
    before = ""
    for row in rows:
        lines += [""] if before not in ("", row.hand) else []
        before = row.hand
        lines.append(
            f"{row.hand:29} {METHODS[row.by].label:24} {100 * row.order_right:5.1f} % {100 * row.median_error:12.2f} %"
            f" {100 * row.rms_error:5.2f} % {100 * row.coverage:10.1f} % {row.left_out:9}"
        )
    return "\n".join(lines)


def main() -> None:
    """Run, print, write."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--seeds", type=int, default=200, help="sessions of each hand")
    parser.add_argument("--out", type=Path, default=BENCH / "results", help="folder for the JSON and the figures")
    arguments = parser.parse_args()
    ranks, rows = study(arguments.seeds)
    text = f"{touch_ranks.rank_table(ranks)}\n\n{table(rows)}"
    print(text)
    arguments.out.mkdir(parents=True, exist_ok=True)
    document = {"palpate": palpate.__version__, "headers": headers_hash(), "seeds": arguments.seeds}
    document |= {"ranks": [asdict(row) for row in ranks], "rows": [asdict(row) for row in rows]}
    (arguments.out / "reliability.json").write_text(json.dumps(document, indent=1) + "\n")
    (arguments.out / "reliability.txt").write_text(text + "\n")
    shown = {
        METHODS[by].label: [100 * row.rms_error for row in rows if row.by == by] for by in reliability_figure.SHOWN
    }
    reliability_figure.choices(shown, list(HANDS), arguments.out / "reliability.png", arguments.seeds)
    reliability_figure.stage_and_hand(arguments.out / "stage_hand.png")


if __name__ == "__main__":
    main()
