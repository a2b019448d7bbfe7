"""Choice of one ratio from four touches: what a touch knows of its error, order of ten specimens, error of a modulus.

    python -m bench.accuracy.reliability [--seeds 200] [--out bench/results]

A session is the ten specimens of the paper's Table I and an eleventh object of random modulus (0.2 to 6 MPa), touched
four times each by a simulated hand; seeds 0, 1, ... The first table is the rank correlation, within an object, between a
number of the touch and the true error of its ratio: 1 if it puts the touches in the order of their errors, 0 if it knows
nothing. The next three have a column for each method: how often the ten chosen ratios increase with the modulus; the rms error of
the eleventh modulus, from a calibration on the ten with the same method; how often its 95 % interval holds the truth.
Prints the tables, and writes them and a picture; needs the extras science and tables.
"""

import argparse
import json
import math
import os
from collections.abc import Callable, Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import palpate
import pandas as pd
from palpate.calibration.specimen_fit import (
    CombinedRatio,
    SpecimenTouches,
    combined_ratio,
    fit_specimens,
    rises,
    weighted_mean,
)
from palpate.display.plots import PAGE_IN, sheet
from palpate.elasticity import SORBOTHANE_MPA
from palpate.repeatability import usable
from palpate.simulation import Substrate
from palpate.simulation.hand import Hand, session
from palpate.simulation.scenarios import PROBE
from palpate.uncertainty import TOUCH_SCATTER

from bench.results_age import RESULTS, about

_LEVEL = Hand(oblique=0.0, nonlinearity=0.0)
_TILTED = replace(_LEVEL, tilt_deg=0.5)
# A hand that holds an instrument still moves its tip by 49 um rms (Riviere, Rader, Khosla 1997): 0.03 degrees at 100 mm.
TREMOR_DEG = 0.03
# Two plates with 10 pF at rest: the change is f (1 + f / 10 pF). The AD7746 can balance 17 pF.
CURVED_PER_PF = 0.1

STAGE = replace(_LEVEL, nonlinearity=CURVED_PER_PF, press_spread=0.0, tremor=0.0)
"""The probe on a stage, with a constant load: no tilt, no tremor, the same press. The gauges are those of `FREE`."""
FREE = replace(
    _TILTED,
    nonlinearity=CURVED_PER_PF,
    shallow=0.3,
    substrate=Substrate(exponent=1.5, tremor_deg=TREMOR_DEG, settles=0.5),
)
"""The probe in a hand, with all causes that follow from the geometry."""

HANDS = {
    "factor 3 %": Hand(),
    "factor 10 %": Hand(oblique=0.10),
    "factor 3 %, less when firm": Hand(firm=1.0),
    "factor 3 %, one in four slips": Hand(slips=0.25),
    "factor 1 %, light presses": Hand(oblique=0.01, press_pF=0.02, press_spread=1.2),
    "tilt 0.5 deg": _TILTED,
    "tilt, trembling": replace(_TILTED, substrate=Substrate(tremor_deg=TREMOR_DEG)),
    "tilt, domes": replace(_TILTED, substrate=Substrate(exponent=1.5)),
    "tilt, settles from twice": replace(_TILTED, substrate=Substrate(settles=1.0)),
    "tilt, less deep when oblique": replace(_TILTED, shallow=0.3),
    "curved gauges, level": replace(_LEVEL, nonlinearity=CURVED_PER_PF),
    "tilt, curved gauges": replace(_TILTED, nonlinearity=CURVED_PER_PF),
    "all of tilt and gauges": FREE,
    "stage": STAGE,
}
"""Name -> hand. "factor": a random factor of the ratio that nothing else shows. "tilt": of the substrate, 0.5 degrees."""

MISFITS = ("offset", "curve", "drift", "lag")
"""Flags of the test of the model. On a tilted probe with curved gauges most touches have one; the studies use them."""

SCENES: tuple[Any, ...] = ("handheld", "paper")


@dataclass(frozen=True)
class Method:
    """How to choose: one of `CHOICES`, or "level", of touches with or without flags of the model's test, by a scene."""

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
    "standard error": Method("smallest standard error", "standard_error"),
    "all": Method("every touch", "all"),
}


def unlevel(touch: palpate.Touch) -> float:
    """Return how far from level the probe was held, by the fit of the touch: a share of the mean output, 0 or more."""
    # It is the hard channel that the fitted line or curve has at zero force of the soft one, `curve` less `offset` in
    # `Touch.effects`: level bumps are reached together. 0 in a scene without a fit.
    effects = touch.effects
    return abs(effects["curve"] - effects["offset"]) if effects else 0.0


def by_level(touches: list[palpate.Touch], accept: tuple[str, ...]) -> CombinedRatio:
    """Return the mean of touches with weights 1 / (`TOUCH_SCATTER`^2 + `unlevel`^2)."""
    kept = usable(touches, accept)
    weights = 1 / (TOUCH_SCATTER**2 + np.array([unlevel(touch) for touch in kept]) ** 2)
    return weighted_mean([combined_ratio([touch], "mean", accept) for touch in kept], weights)


CRITERIA: Mapping[str, Callable[[palpate.Touch], float]] = {
    "P": lambda touch: touch.covariance,
    "std. error": lambda touch: touch.standard_error / abs(touch.ratio),
    "|offset|": lambda touch: abs(touch.effects["offset"]),
    "|curve|": lambda touch: abs(touch.effects["curve"]),
    "unlevel": unlevel,
}
UNKNOWN = "eleventh"


def level_ratio(hand: Hand, ratio: float) -> float:
    """Return what a level probe shows at the median press: the ratio by which a touch of this hand is judged.

    A calibration takes up what is the same in all touches; what differs between them is their error.
    """
    hard, soft = (hand.press_pF * share / (1 + ratio) for share in (ratio, 1.0))
    return ratio * (1 + hand.nonlinearity * hard) / (1 + hand.nonlinearity * soft)


Touches = Mapping[str, list[palpate.Touch]]
Rows = list[dict[str, Any]]


def judged(name: str, seed: int) -> tuple[Rows, Rows]:
    """Simulate one session; return a row for each specimen with what its touches know, and one for each method."""
    hand = HANDS[name]
    modulus = math.exp(np.random.default_rng([seed, 99]).uniform(math.log(0.2), math.log(6.0)))
    runs = session(seed, hand=hand, moduli={**SORBOTHANE_MPA, UNKNOWN: modulus})
    handheld, paper = (
        {each: palpate.touches(run, scene=scene) for each, run in runs.items()} for scene in SCENES
    )
    known = [
        {"hand": name} | _known(hand, E, handheld[each], paper[each])
        for each, E in SORBOTHANE_MPA.items()
    ]
    chosen = []
    for label, method in METHODS.items():
        try:
            found = _characterised(method, paper if method.paper else handheld, modulus)
        # an object has no touch to choose from
        except (ValueError, palpate.errors.CalibrationError):
            continue
        chosen.append({"hand": name, "method": label} | found)
    return known, chosen


def _known(
    hand: Hand, modulus: float, four: list[palpate.Touch], paper: list[palpate.Touch]
) -> dict[str, float]:
    """Return the mean square error of the touches on one specimen, % of flagged ones, and rank correlations by criterion."""
    truth = level_ratio(hand, PROBE.ratio(modulus))
    ratios, by_paper = (np.array([touch.ratio for touch in touches]) for touches in (four, paper))
    errors = np.abs(ratios / truth - 1)
    found = {
        "square": float(np.mean(errors**2)),
        "flagged, %": 100 * float(np.mean([bool(t.flags) for t in four])),
    }
    for name, value in CRITERIA.items():
        found[name] = correlation([value(touch) for touch in four], errors)
    found["P, paper"] = correlation(
        [touch.covariance for touch in paper], np.abs(by_paper / truth - 1)
    )
    return found | {"to mean": correlation(np.abs(ratios - ratios.mean()), errors)}


def correlation(values: Any, errors: Any) -> float:
    """Return Spearman's rank correlation; nan where all values are equal, or one is not a number."""
    from scipy.stats import rankdata

    if (
        len(values) < 3
        or not np.isfinite(values).all()
        or np.ptp(values) == 0
        or np.ptp(errors) == 0
    ):
        return math.nan
    return float(np.corrcoef(rankdata(values), rankdata(errors))[0, 1])


def _characterised(method: Method, touches: Touches, modulus: float) -> dict[str, float]:
    """Return % of right orders, square error of the eleventh modulus, % of intervals that hold it; nan: no value."""
    one = "mean" if method.by == "all" else method.by
    choice = by_level if one == "level" else partial(combined_ratio, by=one)
    *known, probed = [
        choice(touches[name], accept=method.accept) for name in (*SORBOTHANE_MPA, UNKNOWN)
    ]
    if method.by == "all":
        calibration = fit_specimens(
            [
                SpecimenTouches(name, E, touches[name], method.accept)
                for name, E in SORBOTHANE_MPA.items()
            ]
        )
    else:
        ratios, errors, counts = zip(
            *((each.ratio, each.standard_error, each.touches) for each in known), strict=True
        )
        moduli = [*SORBOTHANE_MPA.values()]
        calibration = palpate.Calibration.fit(
            ratios, moduli, standard_errors=errors, touches=counts
        )
    value, low, high = calibration.modulus(
        probed.ratio, probed.standard_error, touches=probed.touches
    )
    error = math.log(value / modulus) if math.isfinite(value) else math.nan
    ordered = rises([each.ratio for each in known])
    return {
        "order": 100.0 * ordered,
        "square": error**2,
        "covers": 100.0 * (low <= modulus <= high),
    }


def study(names: list[str], seeds: int) -> dict[str, pd.DataFrame]:
    """Simulate these hands, on every processor; return the four tables by title, a row for each hand."""
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        pairs = [
            pair
            for name in names
            for pair in pool.map(partial(judged, name), range(seeds), chunksize=5)
        ]
    known = (
        pd.DataFrame([row for rows, _ in pairs for row in rows]).groupby("hand", sort=False).mean()
    )
    known.insert(0, "error, %", 100 * known.pop("square") ** 0.5)
    chosen = (
        pd.DataFrame([row for _, rows in pairs for row in rows])
        .groupby(["hand", "method"])
        .mean()
        .unstack()
    )
    order, square, covers = (
        chosen[what].reindex(index=names, columns=METHODS) for what in ("order", "square", "covers")
    )
    return {
        "rank correlation": known,
        "order is right, %": order,
        "rms error of the modulus, %": 100 * square**0.5,
        "95 % interval holds, %": covers,
    }


def text(tables: Mapping[str, pd.DataFrame]) -> str:
    """Return the tables as text."""
    shown = [table.to_string(float_format="%.2f", index_names=False) for table in tables.values()]
    return "\n\n".join(f"{title}\n{lines}" for title, lines in zip(tables, shown, strict=True))


SHOWN = {
    "mean": ("s", "0.35"),
    "level": ("o", "#0b7285"),
    "agreement": ("v", "#74c0fc"),
    "covariance": ("D", "#e8590c"),
    "paper": ("^", "#f08c00"),
    "standard error": ("P", "#9775fa"),
}


def draw(errors: pd.DataFrame, path: Path, seeds: int) -> None:
    """Draw the error of the eleventh modulus by each method and hand."""
    with sheet(PAGE_IN, 5.6) as figure:
        ax = figure.subplots()
        for number, (name, (mark, colour)) in enumerate(SHOWN.items()):
            at = np.arange(len(errors)) + 0.1 * (number - (len(SHOWN) - 1) / 2)
            ax.plot(errors[name], at, mark, label=METHODS[name].label, color=colour, markersize=5)
        ax.set_yticks(range(len(errors)), list(errors.index))
        ax.invert_yaxis()
        ax.set_xscale("log")
        ax.set_xlabel(
            f"error of an eleventh modulus, rms, % ({seeds} simulated sessions: ten specimens, four touches each)"
        )
        figure.legend(loc="outside upper center", ncols=3)
        figure.savefig(path, dpi=150)


def main() -> None:
    """Run, print, write."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--seeds", type=int, default=200, help="sessions of each hand")
    parser.add_argument(
        "--out", type=Path, default=RESULTS, help="folder for the tables and the picture"
    )
    options = parser.parse_args()
    tables = study(list(HANDS), options.seeds)
    print(text(tables))
    document = about() | {"seeds": options.seeds, "tables": text(tables).split("\n")}
    (options.out / "reliability.json").write_text(json.dumps(document, indent=1) + "\n")
    draw(tables["rms error of the modulus, %"], options.out / "reliability.png", options.seeds)


if __name__ == "__main__":
    main()
