"""The drawn pictures of README.md and of the recipes: a ratio, a hedge ratio, a contact.

python tests/tools/recipe_pictures.py      writes ratio, hedge and contact.png to docs/images
"""

import matplotlib as mpl
import numpy as np
import palpate
from numpy.typing import NDArray
from palpate.simulation import scenarios
from pictures import IMAGES, shrink

Array = NDArray[np.float64]
BLUE = "#00589c"
GREY = "#8a8f94"
LIGHT = "#c8ccd0"
Z = 1.96  # of a 95 % interval
STYLE = {
    "font.size": 10,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.titlelocation": "left",
    "axes.titlesize": 10,
    "legend.frameon": False,
}


def ratio_picture() -> None:
    """Draw the first picture of the README, with the signals of its example."""
    rng = np.random.default_rng(0)
    regressor = rng.uniform(0.5, 1.5, 2000)
    true = np.repeat([20.0, 22.0], 1000)
    output = true * regressor + 0.2 * rng.standard_normal(2000)
    samples = np.arange(2000.0)
    _, (left, right) = plt.subplots(1, 2, figsize=(8.6, 3.0), width_ratios=(2, 5))
    left.plot(samples, output, color=BLUE, lw=1, label="output")
    left.plot(samples, regressor, color=GREY, lw=1, label="regressor")
    left.set_title("two signals")
    left.set_xlim(975, 1025)
    left.set_ylim(-1, 42)
    left.legend(loc="upper left", ncols=2, handlelength=1, columnspacing=1)

    rows = palpate.HandoverRls().trace(output, regressor)
    unknown = 1e12
    forgetting = palpate.Rls(initial_covariance=unknown, max_covariance=unknown)
    slow = forgetting.process(output, regressor)
    half = Z * rows["standard_error"]
    right.plot(samples, output / regressor, ".", ms=2, color=LIGHT, label="output / regressor")
    right.plot(samples, slow, color=GREY, label="least squares, forgetting 0.995")
    right.fill_between(
        samples, rows["ratio"] - half, rows["ratio"] + half, color=BLUE, alpha=0.25, lw=0
    )
    right.plot(samples, rows["ratio"], color=BLUE, label="palpate, with its 95 % band")
    right.plot(samples, true, "--", color="black", lw=0.8, label="true")
    right.set_title("their ratio")
    right.set_xlim(900, 1400)
    right.set_ylim(19, 23)
    right.set_xlabel("sample")
    right.legend(loc="lower right", markerscale=4)
    save("ratio.png")


def hedge_picture() -> None:
    """Draw the hedge ratio of docs/two_signals.md by the default detector, and by one that suits it."""
    market, asset = hedge_returns(35)  # its delays are near the medians
    days = np.arange(len(market))
    _, axes = plt.subplots(figsize=(8.6, 2.8))
    for settings, colour, name in (
        ({}, GREY, "default"),
        (
            {"false_alarm_interval": 1e4, "smallest_shift": 0.5},
            BLUE,
            "for a shift of half a deviation",
        ),
    ):
        rows = palpate.HandoverRls(**settings).trace(asset, market)
        axes.plot(days, rows["ratio"], color=colour, label=name)
    axes.plot(
        days, np.repeat([0.8, 1.2], len(days) // 2), "--", color="black", lw=0.8, label="true"
    )
    axes.set_title("hedge ratio")
    axes.set_xlim(900, 1300)
    axes.set_ylim(0.7, 1.4)
    axes.set_xlabel("day")
    axes.legend(loc="upper left")
    save("hedge.png")


def hedge_returns(seed: int) -> tuple[Array, Array]:
    """Return 2,000 daily returns of a market and of an asset, whose hedge ratio changes."""
    rng = np.random.default_rng(seed)
    market = 0.01 * rng.standard_t(5, 2000)
    asset = np.repeat([0.8, 1.2], 1000) * market + 0.006 * rng.standard_t(5, 2000)
    return market, asset


def contact_picture() -> None:
    """Draw when a contact at 1,000 pairs a second is found, with and without averaging."""
    run = scenarios.run("fast-converter", seed=1)
    _, axes = plt.subplots(figsize=(8.6, 2.8))
    ms = 1e3 * (run.t_hard_s - 2.0)
    axes.plot(ms, 1e3 * (run.hard - run.hard[:1000].mean()), color=LIGHT, label="hard")
    axes.plot(ms, 1e3 * (run.soft - run.soft[:1000].mean()), color=GREY, label="soft")
    for averaged, colour, name in ((0.025, "black", "default"), (0.0, BLUE, "averaged=0")):
        tracker = palpate.Tracker("handheld", averaged=averaged)
        rows = tracker.process(run.t_hard_s, run.t_soft_s, run.hard, run.soft)
        found_ms = ms[np.argmax(rows["contact"])]
        axes.axvline(found_ms, color=colour, ls="--", label=f"{name}: found at {found_ms:.0f} ms")
    axes.set_title("a contact at 1,000 pairs a second")
    axes.set_xlim(-90, 130)
    axes.set_ylim(-2, 100)
    axes.set_xlabel("ms from the first touch of the bumps")
    axes.set_ylabel("change, fF")
    axes.legend(loc="upper left")
    save("contact.png")


def save(name: str) -> None:
    """Save the figure, small."""
    plt.tight_layout()
    plt.savefig(IMAGES / name, dpi=100)
    plt.close()
    shrink(IMAGES / name, 64)


if __name__ == "__main__":
    mpl.use("Agg")
    mpl.rcParams.update(STYLE)
    from matplotlib import pyplot as plt

    ratio_picture()
    hedge_picture()
    contact_picture()
