"""Figures of the study of several touches: errors of the choices, and a probe on a stage beside one in a hand."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import palpate
from palpate.calibration.plot import moduli_axis
from palpate.elasticity import SORBOTHANE_MPA
from palpate.simulation.hand import Hand, session
from palpate.simulation.scenarios import PROBE

from bench.accuracy.hands import FREE, STAGE, level_ratio

SHOWN = ("mean", "level", "agreement", "covariance", "paper", "standard_error")
"""The methods in the figure."""
_COLOURS = ("0.35", "#0b7285", "#74c0fc", "#e8590c", "#f08c00", "#9775fa")
_MARKS = ("s", "o", "v", "D", "^", "P")
_SEED = 0


def choices(errors: Mapping[str, Sequence[float]], hands: Sequence[str], path: Path, seeds: int) -> None:
    """Plot the error of the eleventh modulus by each method and hand."""
    plt = _pyplot()
    from matplotlib.ticker import LogLocator, NullFormatter

    drawing, ax = plt.subplots(figsize=(7.5, 6.4), layout="constrained")
    for number, (label, values) in enumerate(errors.items()):
        at = [place + 0.1 * (number - (len(errors) - 1) / 2) for place in range(len(hands))]
        ax.plot(values, at, _MARKS[number], label=label, color=_COLOURS[number], markersize=6)
    ax.set_yticks(range(len(hands)), hands)
    ax.hlines([place + 0.5 for place in range(len(hands) - 1)], 0, 1, transform=ax.get_yaxis_transform(), color="0.9")
    ax.invert_yaxis()
    ax.set_xscale("log")
    ax.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    ax.xaxis.set_major_formatter("{x:g}")
    ax.xaxis.set_minor_formatter(NullFormatter())
    ax.set_xlabel("error of an eleventh modulus, rms, % (less is better)")
    ax.grid(axis="x", alpha=0.3)
    drawing.legend(loc="outside upper center", ncols=3, fontsize=9, frameon=False)
    drawing.supxlabel(f"{seeds} simulated sessions: ten specimens, four touches each", fontsize=9)
    drawing.savefig(path, dpi=130)
    plt.close(drawing)


def stage_and_hand(path: Path) -> None:
    """Plot the ratio of four touches against the modulus, as in the paper's Fig. 10, on a stage and in a hand."""
    plt = _pyplot()
    drawing, grid = plt.subplots(2, 2, figsize=(9.0, 5.2), sharex=True, sharey="row", layout="constrained",
                                 height_ratios=[2.0, 1.0])  # fmt: skip
    for column, (title, hand) in enumerate((("(a) on a stage, constant load", STAGE), ("(b) in a hand", FREE))):
        _four_touches(grid[:, column], hand)
        grid[0, column].set_title(title, fontsize=10)
        moduli_axis(grid[1, column])
    grid[0, 0].set_ylabel("capacitance ratio")
    grid[1, 0].set_ylabel("error, %")
    grid[0, 0].legend(loc="upper left", fontsize=8, frameon=False)
    drawing.supxlabel(f"simulated data, seed {_SEED}; the truth is the simulator's", fontsize=8, color="0.4")
    drawing.savefig(path, dpi=130)
    plt.close(drawing)


def _four_touches(axes: Any, hand: Hand) -> None:
    upper, lower = axes
    runs = session(_SEED, hand=hand)
    moduli = list(SORBOTHANE_MPA.values())
    level = [level_ratio(hand, PROBE.ratio(modulus)) for modulus in moduli]
    four = [[touch.ratio for touch in palpate.touches(runs[name])] for name in SORBOTHANE_MPA]
    upper.plot(moduli, level, color="0.6", linewidth=1, label="level probe, median press", zorder=1)
    lower.axhline(0, color="0.6", linewidth=1)
    for number, (modulus, truth, ratios) in enumerate(zip(moduli, level, four, strict=True)):
        mean = sum(ratios) / len(ratios)
        spread = (sum((ratio - mean) ** 2 for ratio in ratios) / (len(ratios) - 1)) ** 0.5
        names = ("mean and standard deviation", "the four touches") if number == 0 else (None, None)
        upper.errorbar(
            modulus, mean, spread, fmt="o", mfc="none", color="#0b7285", capsize=3, markersize=6, label=names[0]
        )
        upper.plot([modulus] * len(ratios), ratios, ".", color="#e8590c", markersize=4, label=names[1], zorder=3)
        lower.plot([modulus] * len(ratios), [100 * (ratio / truth - 1) for ratio in ratios], ".", color="#e8590c")
    off = [ratio / truth - 1 for truth, ratios in zip(level, four, strict=True) for ratio in ratios]
    rms = 100 * (sum(error**2 for error in off) / len(off)) ** 0.5
    lower.set_title(f"rms {rms:.2g} %", loc="right", fontsize=8)


def _pyplot() -> Any:
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    return plt
