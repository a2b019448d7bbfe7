"""Fig. 6, 7 and 9 of the paper: readouts and estimates during simulated touches; the handheld scene on the same data."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from palpate import AdaptiveRls, Rls, Tracker
from palpate.display.plots import FAST, HANDHELD, HARD, PAPER, SLOW, SOFT, TRUTH
from palpate.elasticity import SORBOTHANE_MPA
from palpate.simulation.press import Press
from palpate.simulation.probe import Scenario, Simulation, simulate
from palpate.simulation.scenarios import PROBE

Array = NDArray[Any]
START_S = 3.9  # contact at about the 150th sample
TREMOR = 0.01  # of the press, in each of these figures
PAIR = ("30 OO", "30 A")
"""The specimens of the paper's Fig. 6."""
ONE = "70 OO"
"""The specimen of the paper's Fig. 7."""
FOUR = ("30 OO", "70 OO", "40 A", "70 A")
"""The specimens of the paper's Fig. 9."""
_END = 395  # sample; the touch ends a little later
_UNDER: dict[str, Any] = {
    "color": "0.78",
    "linewidth": 3.0,
    "zorder": 1.5,
    "solid_capstyle": "butt",
    "label": "truth",
}
"""The truth is a wide line under the estimates: a correct estimate is seen on it."""


@dataclass(frozen=True)
class Traces:
    """All curves of one recording: arrays of shape (n,).

    The ordinary and adaptive estimators run as in the paper: their input is the change from the mean before contact, for 250
    samples from contact on. The ratio is 1 outside. The handheld scene gets the unchanged readings; its ratio is nan outside
    touches, and so are innovation and statistic.
    """

    hard: Array  # changes, pF
    soft: Array
    truth: Array  # nan outside a press
    slow: Array  # ratio, lambda = 0.995
    fast: Array  # ratio, lambda = 0.9
    adaptive: Array
    innovation: Array  # pF
    statistic: Array  # pF, the paper's alarm signal
    paper_alarm: Array  # whether it selects lambda = 0.9
    handheld: Array
    standard_error: Array
    alarm: Array  # of the handheld scene


def two_specimens(seed: int) -> dict[str, Traces]:
    """Simulate one touch on each specimen of Fig. 6."""
    return {name: one_touch(seed, name) for name in PAIR}


def one_touch(seed: int, specimen: str = ONE) -> Traces:
    """Simulate one touch on a specimen."""
    press = Press(START_S, [(0.0, PROBE.ratio(SORBOTHANE_MPA[specimen]))], hold_s=7.5)
    return traces(simulate(Scenario(presses=[press], duration_s=13.0, tremor=TREMOR), seed))


def four_touches(seed: int) -> Traces:
    """Simulate touches on four specimens, one after the other, from soft to hard."""
    ratios = [PROBE.ratio(SORBOTHANE_MPA[name]) for name in FOUR]
    presses = [Press(2.0 + 9.5 * i, [(0.0, ratio)], depth_pF=0.2) for i, ratio in enumerate(ratios)]
    return traces(simulate(Scenario(presses=presses, duration_s=39.5, tremor=TREMOR), seed))


def traces(run: Simulation) -> Traces:
    """Run all estimators over a recording."""
    idle = run.t_hard_s < run.presses[0].start_s - 0.2
    hard = run.hard - run.hard[idle].mean()
    soft = run.soft - run.soft[idle].mean()
    paper = Tracker("paper")
    handheld = Tracker("handheld")
    paper.process(run.t_hard_s, run.t_soft_s, run.hard, run.soft)
    rows = handheld.process(run.t_hard_s, run.t_soft_s, run.hard, run.soft)
    found = {name: np.ones(len(hard)) for name in ("slow", "fast", "adaptive")}
    found |= {name: np.full(len(hard), np.nan) for name in ("innovation", "statistic")}
    alarm = np.zeros(len(hard), bool)
    for touch in paper.touches:
        used = slice(touch.start, touch.start + touch.samples)
        found["slow"][used] = Rls(forgetting=0.995).process(hard[used], soft[used])
        found["fast"][used] = Rls(forgetting=0.9).process(hard[used], soft[used])
        adaptive = AdaptiveRls().trace(hard[used], soft[used])
        found["adaptive"][used] = adaptive["ratio"]
        alarm[used] = adaptive["alarm"]
        found["innovation"][used] = adaptive["innovation"]
        found["statistic"][used] = adaptive["statistic"]
    inside = rows["touch"] > 0
    seen = {
        name: np.where(inside, rows[of], np.nan)
        for name, of in (("handheld", "ratio"), ("standard_error",) * 2)
    }
    return Traces(
        hard, soft, run.true_ratio, **found, paper_alarm=alarm, alarm=rows["alarm"] & inside, **seen
    )


def figure_6(figure: Any, parts: Mapping[str, Traces]) -> None:
    """Draw ordinary RLS with two forgetting factors on two specimens, a column each."""
    axes = figure.subplots(4, 2, sharex=True)
    estimates = {"slow": (SLOW, r"$\lambda$ = 0.995"), "fast": (FAST, r"$\lambda$ = 0.9")}
    estimates["handheld"] = (HANDHELD, "handheld")
    titles = (
        "(a) forgetting 0.995",
        "(b) forgetting 0.9",
        "(c) handheld scene",
        "(d) distance from the truth",
    )
    for column, (specimen, t) in zip(axes.T, parts.items(), strict=True):
        for ax, (name, (colour, label)) in zip(column[:3], estimates.items(), strict=True):
            _readouts_and_ratio(ax, t, getattr(t, name), colour, label)
            _enlarged(ax, t, [(getattr(t, name), colour)], (0.56, 0.6, 0.42, 0.23), 0.004)
        _errors(column[3], t, estimates)
        for ax, title in zip(column, titles, strict=True):
            ax.set_title(f"{title}, {specimen}")
        column[3].set_xlabel("sample number")
    axes[0, 0].set_xlim(0, _END)


def figure_7(figure: Any, t: Traces) -> None:
    """Draw RLS with adaptive forgetting: estimate, innovation with alarm signal, comparison."""
    axes = figure.subplots(3, 2, sharex=True)
    three = {"slow": (SLOW, "0.995"), "fast": (FAST, "0.9"), "adaptive": (PAPER, "adaptive")}
    two = {"adaptive": (PAPER, "adaptive"), "handheld": (HANDHELD, "handheld")}
    _readouts_and_ratio(axes[0, 0], t, t.adaptive, PAPER, "adaptive")
    _alarm(axes[1, 0], t)
    _compared(axes[2, 0], t, three)
    _enlarged(
        axes[2, 0],
        t,
        [(t.fast, FAST), (t.slow, SLOW), (t.adaptive, PAPER)],
        (0.5, 0.12, 0.48, 0.6),
        0.008,
    )
    _readouts_and_ratio(axes[0, 1], t, t.handheld, HANDHELD, "handheld")
    _errors(axes[1, 1], t, two)
    _compared(axes[2, 1], t, two)
    _titles(axes, [["(a) adaptive forgetting", "(d) the same data, handheld scene"],
                   ["(b) innovation and alarm signal", "(e) distance from the truth"],
                   ["(c) three estimators", "(f) adaptive and handheld, enlarged"]])  # fmt: skip
    axes[2, 0].set_ylim(0, 1.1 * np.nanmax(t.truth))
    axes[2, 1].set_ylim(0.98 * np.nanmax(t.truth), 1.02 * np.nanmax(t.truth))
    axes[0, 0].set_xlim(0, _END)


def figure_9(figure: Any, t: Traces) -> None:
    """Draw touches on four specimens, one after the other."""
    axes = figure.subplots(3, 2, sharex=True)
    for ax in axes[0]:
        _readouts(ax, t)
        ax.legend(loc="upper left")
    for ax, name, colour in zip(axes[1], ("adaptive", "handheld"), (PAPER, HANDHELD), strict=True):
        _compared(ax, t, {name: (colour, name)})
        ax.set_ylim(0, 1.08 * np.nanmax(t.truth))
    axes[2, 0].plot(t.statistic, color=PAPER)
    axes[2, 0].set_ylabel("alarm signal, pF")
    _shade(axes[2, 0], t.paper_alarm, PAPER)
    axes[2, 1].plot(100 * t.standard_error / t.truth, color=HANDHELD)
    axes[2, 1].set_ylabel("standard error, %")
    axes[2, 1].set_ylim(bottom=0)
    _shade(axes[2, 1], t.alarm, HANDHELD)
    alarm = "shaded: alarm" if t.alarm.any() else "no alarm"
    _titles(axes, [["(a) readouts", "(d) readouts, the same"], ["(b) ratio, adaptive forgetting", "(e) ratio, handheld"],
                   ["(c) alarm signal; shaded: alarm on", f"(f) standard error; {alarm}"]])  # fmt: skip


def _readouts(ax: Any, t: Traces) -> None:
    ax.plot(t.hard, color=HARD, label="hard, $C_1$")
    ax.plot(t.soft, color=SOFT, label="soft, $C_2$")
    ax.set_ylabel("capacitance change, pF")


def _readouts_and_ratio(ax: Any, t: Traces, ratio: Array, colour: str, label: str) -> None:
    _readouts(ax, t)
    beside = ax.twinx()
    beside.grid(visible=False)
    beside.plot(t.truth, **_UNDER)
    beside.plot(ratio, color=colour, label=label)
    beside.set_ylabel("capacitance ratio")
    top = np.nanmax(t.hard)  # readouts below, ratio above, names where nothing is touched yet
    ax.set_ylim(-0.1 * top, 2.3 * top)
    beside.set_ylim(0, np.nanmax(t.truth) / 0.9)
    lines = [*ax.get_lines(), *beside.get_lines()]
    ax.legend(lines, [line.get_label() for line in lines], loc="upper left", labelspacing=0.25)


def _errors(ax: Any, t: Traces, names: dict[str, tuple[str, str]]) -> None:
    inside = np.isfinite(t.statistic)
    for name, (colour, label) in names.items():
        error = np.where(inside, 100 * np.abs(getattr(t, name) / t.truth - 1), np.nan)
        ax.semilogy(error, color=colour, label=label, linewidth=0.8)
    ax.semilogy(
        100 * t.standard_error / t.truth, color=HANDHELD, linestyle=":", label="standard error"
    )
    ax.set_ylim(1e-4, 300)
    ax.set_ylabel("error of the ratio, %")
    ax.legend(loc="lower left")


def _enlarged(
    ax: Any, t: Traces, ratios: list[tuple[Array, str]], place: tuple[float, ...], within: float
) -> None:
    """Draw ratios around the truth again: tenths of a per cent can be seen."""
    inset = ax.inset_axes(place)
    inset.plot(t.truth, **_UNDER)
    for ratio, colour in ratios:
        inset.plot(ratio, color=colour, linewidth=0.8)
    middle = np.nanmax(t.truth)
    inset.set_xlim(160, _END)
    inset.set_ylim((1 - within) * middle, (1 + within / 2) * middle)
    inset.tick_params(labelsize=6)
    inset.set_zorder(5)


def _alarm(ax: Any, t: Traces) -> None:
    settings = AdaptiveRls().settings
    threshold = settings["threshold"]
    drift = settings["drift"]
    ax.plot(t.innovation, color=HARD, label="innovation")
    ax.plot(t.statistic, color=PAPER, label="alarm signal")
    ax.axhline(threshold, **TRUTH, label=f"threshold, {threshold} pF")
    ax.axhline(drift, color=SOFT, linewidth=0.7, linestyle=":", label=f"drift, {drift} pF")
    _shade(ax, t.paper_alarm, PAPER, label=r"alarm on, $\lambda$ = 0.9")
    ax.set_ylabel("pF")
    ax.legend(loc="upper right")


def _compared(ax: Any, t: Traces, names: dict[str, tuple[str, str]]) -> None:
    ax.plot(t.truth, **_UNDER)
    for name, (colour, label) in names.items():
        ax.plot(getattr(t, name), color=colour, label=label)
    ax.set_ylabel("capacitance ratio")
    ax.legend(loc="upper left")


def _shade(ax: Any, alarm: Array, colour: str, label: str | None = None) -> None:
    ax.fill_between(np.arange(len(alarm)), 0, 1, where=alarm, color=colour, alpha=0.2, linewidth=0,
                    transform=ax.get_xaxis_transform(), label=label)  # fmt: skip


def _titles(axes: Any, titles: list[list[str]]) -> None:
    for ax, title in zip(axes.flat, np.ravel(titles), strict=True):
        ax.set_title(title)
    for ax in axes[-1]:
        ax.set_xlabel("sample number")
