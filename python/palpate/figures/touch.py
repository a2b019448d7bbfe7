"""Fig. 6, 7 and 9 of the paper: readouts and estimates during touches; the handheld scene on the same data."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate._core import AdaptiveRls, Rls, Tracker
from palpate.elasticity import SORBOTHANE_MPA
from palpate.figure_style import FAST, HANDHELD, HARD, PAPER, SLOW, SOFT, TRUTH
from palpate.simulation.press import Press
from palpate.simulation.probe import Simulation, simulate
from palpate.simulation.scenario import Scenario
from palpate.simulation.scenarios import PROBE

Array = NDArray[Any]
START_S = 3.9  # contact at about the 150th sample
SETTLED = 50  # samples after contact; later samples count as settled
_DRIFT_PF, _THRESHOLD_PF = 0.01, 0.05  # the paper's alarm


@dataclass(frozen=True)
class Traces:
    """All curves of one recording for the figures: arrays of shape (n,), nan outside touches.

    The ordinary and adaptive estimators run as in the paper: input are the changes from the mean before contact, for
    250 samples from contact on; the initial ratio is 1. The handheld scene gets the unchanged readings.
    """

    hard: Array  # changes, pF
    soft: Array
    truth: Array
    slow: Array  # ratio, lambda = 0.995
    fast: Array  # ratio, lambda = 0.9
    adaptive: Array
    innovation: Array  # pF
    statistic: Array  # pF, the paper's alarm signal
    handheld: Array
    standard_error: Array
    alarm: Array  # of the handheld scene

    def columns(self) -> dict[str, Array]:
        """Return the numbers of a figure as named columns."""
        names = {"hard": "hard_pF", "soft": "soft_pF", "innovation": "innovation_pF", "statistic": "alarm_signal_pF"}
        names |= {
            "slow": "ratio_0.995",
            "fast": "ratio_0.9",
            "adaptive": "ratio_adaptive",
            "handheld": "ratio_handheld",
        }
        return {"sample": np.arange(len(self.hard)), **{names.get(name, name): a for name, a in vars(self).items()}}


def one_touch(specimen: str, seed: int, *, tremor: float) -> Traces:
    """Simulate one touch on a specimen."""
    press = Press(START_S, [(0.0, PROBE.ratio(SORBOTHANE_MPA[specimen]))], hold_s=7.5)
    return traces(simulate(Scenario(presses=[press], duration_s=13.0, tremor=tremor), seed))


def four_touches(seed: int) -> Traces:
    """Simulate touches on four specimens, one after the other, from soft to hard."""
    presses = [
        Press(2.0 + 9.5 * i, [(0.0, PROBE.ratio(SORBOTHANE_MPA[name]))], depth_pF=0.2) for i, name in enumerate(FOUR)
    ]
    return traces(simulate(Scenario(presses=presses, duration_s=39.5, tremor=0.01), seed))


FOUR = ("30 OO", "70 OO", "40 A", "70 A")
"""The specimens of the paper's Fig. 9."""


def traces(run: Simulation) -> Traces:
    """Return the estimates of all estimators for a recording."""
    idle = run.t_hard_s < run.presses[0].start_s - 0.2
    hard, soft = run.hard - run.hard[idle].mean(), run.soft - run.soft[idle].mean()
    paper = Tracker("paper")
    paper.process(run.t_hard_s, run.t_soft_s, run.hard, run.soft)
    handheld = Tracker("handheld")
    rows = handheld.process(run.t_hard_s, run.t_soft_s, run.hard, run.soft)
    found = {name: np.full(len(hard), np.nan) for name in ("slow", "fast", "adaptive", "innovation", "statistic")}
    for touch in paper.touches:
        used = slice(touch.start, touch.start + touch.samples)
        found["slow"][used] = Rls(forgetting=0.995).process(hard[used], soft[used])
        found["fast"][used] = Rls(forgetting=0.9).process(hard[used], soft[used])
        adaptive = AdaptiveRls().trace(hard[used], soft[used])
        found["adaptive"][used] = adaptive["ratio"]
        found["innovation"][used], found["statistic"][used] = adaptive["innovation"], adaptive["statistic"]
    inside = rows["touch"] > 0
    return Traces(
        hard,
        soft,
        run.true_ratio,
        **found,
        handheld=np.where(inside, rows["ratio"], np.nan),
        standard_error=np.where(inside, rows["standard_error"], np.nan),
        alarm=rows["alarm"] & inside,
    )


def _readouts(ax: Any, t: Traces) -> None:
    ax.plot(t.hard, color=HARD, label="hard, $C_1$")
    ax.plot(t.soft, color=SOFT, label="soft, $C_2$")
    ax.set_ylabel("capacitance change, pF")


def _readouts_and_ratio(ax: Any, t: Traces, ratio: Array, colour: str, label: str) -> None:
    _readouts(ax, t)
    beside = ax.twinx()
    beside.grid(visible=False)
    beside.plot(ratio, color=colour, label=label)
    beside.plot(t.truth, label="truth", **TRUTH)
    beside.set_ylabel("capacitance ratio")
    top, least = np.nanmax(t.hard), 0.9 - 0.6 * np.nanmax(t.truth)  # readouts below, ratio above, names between them
    ax.set_ylim(-0.1 * top, 2.3 * top)
    beside.set_ylim(least, least + (np.nanmax(t.truth) - least) / 0.92)
    lines = [*ax.get_lines(), *beside.get_lines()]
    ax.legend(lines, [line.get_label() for line in lines], loc="center", bbox_to_anchor=(0.6, 0.68), ncols=2)


def _errors(ax: Any, t: Traces, names: dict[str, tuple[str, str]]) -> None:
    for name, (colour, label) in names.items():
        ax.semilogy(100 * np.abs(getattr(t, name) / t.truth - 1), color=colour, label=label, linewidth=0.8)
    ax.semilogy(100 * t.standard_error / t.truth, color=HANDHELD, linestyle=":", label="handheld's standard error")
    ax.set_ylim(1e-4, 300)
    ax.set_ylabel("error of the ratio, %")
    ax.legend(loc="upper right", ncols=1)


def figure_6(figure: Any, t: Traces) -> None:
    """Draw ordinary RLS with two forgetting factors on one specimen."""
    axes = figure.subplots(2, 2, sharex=True)
    _readouts_and_ratio(axes[0, 0], t, t.slow, SLOW, r"ratio, $\lambda$ = 0.995")
    _readouts_and_ratio(axes[1, 0], t, t.fast, FAST, r"ratio, $\lambda$ = 0.9")
    _readouts_and_ratio(axes[0, 1], t, t.handheld, HANDHELD, "ratio, handheld")
    _errors(axes[1, 1], t, {"slow": (SLOW, "0.995"), "fast": (FAST, "0.9"), "handheld": (HANDHELD, "handheld")})
    _titles(axes, [["(a) ordinary RLS, forgetting 0.995", "(c) the same data, handheld scene"],
                   ["(b) ordinary RLS, forgetting 0.9", "(d) distance from the truth"]])  # fmt: skip
    axes[0, 0].set_xlim(100, 460)


def figure_7(figure: Any, t: Traces) -> None:
    """Draw RLS with adaptive forgetting: estimate, innovation with alarm signal, comparison."""
    axes = figure.subplots(3, 2, sharex=True)
    _readouts_and_ratio(axes[0, 0], t, t.adaptive, PAPER, "ratio, adaptive")
    _alarm(axes[1, 0], t)
    _compared(axes[2, 0], t, {"slow": (SLOW, "0.995"), "fast": (FAST, "0.9"), "adaptive": (PAPER, "adaptive")})
    _readouts_and_ratio(axes[0, 1], t, t.handheld, HANDHELD, "ratio, handheld")
    _errors(axes[1, 1], t, {"adaptive": (PAPER, "adaptive"), "handheld": (HANDHELD, "handheld")})
    _compared(axes[2, 1], t, {"adaptive": (PAPER, "adaptive"), "handheld": (HANDHELD, "handheld")})
    _titles(axes, [["(a) adaptive forgetting", "(d) the same data, handheld scene"],
                   ["(b) innovation and alarm signal", "(e) distance from the truth"],
                   ["(c) three estimators", "(f) adaptive and handheld, enlarged"]])  # fmt: skip
    middle = np.nanmax(t.truth)
    axes[2, 1].set_ylim(0.98 * middle, 1.02 * middle)
    inset = axes[2, 0].inset_axes((0.42, 0.4, 0.55, 0.43))
    for ratio, colour in ((t.fast, FAST), (t.slow, SLOW), (t.adaptive, PAPER)):
        inset.plot(ratio, color=colour, linewidth=0.8)
    inset.plot(t.truth, **TRUTH)
    inset.set_xlim(160, 400)
    inset.set_ylim(0.992 * middle, 1.004 * middle)
    inset.tick_params(labelsize=6)
    axes[0, 0].set_xlim(100, 460)


def figure_9(figure: Any, t: Traces) -> None:
    """Draw touches on four specimens, one after the other."""
    axes = figure.subplots(3, 2, sharex=True)
    for ax in axes[0]:
        _readouts(ax, t)
        ax.legend(loc="upper left")
    for ax, ratio, colour, label in ((axes[1, 0], t.adaptive, PAPER, "adaptive"),
                                     (axes[1, 1], t.handheld, HANDHELD, "handheld")):  # fmt: skip
        ax.plot(ratio, color=colour, label=label)
        ax.plot(t.truth, label="truth", **TRUTH)
        ax.set_ylabel("capacitance ratio")
        ax.legend(loc="upper left")
    axes[2, 0].plot(t.statistic, color=PAPER)
    axes[2, 0].set_ylabel("alarm signal, pF")
    axes[2, 1].plot(100 * t.standard_error / t.truth, color=HANDHELD)
    axes[2, 1].set_ylabel("standard error, %")
    axes[2, 1].set_ylim(bottom=0)
    _shade(axes[2, 1], t.alarm, HANDHELD)
    alarm = "shaded: alarm" if t.alarm.any() else "no alarm"
    _titles(axes, [["(a) readouts", "(d) readouts, the same"], ["(b) ratio, adaptive forgetting", "(e) ratio, handheld"],
                   ["(c) alarm signal", f"(f) standard error; {alarm}"]])  # fmt: skip


def _alarm(ax: Any, t: Traces) -> None:
    ax.plot(t.innovation, color=HARD, label="innovation")
    ax.plot(t.statistic, color=PAPER, label="alarm signal")
    ax.axhline(_THRESHOLD_PF, **TRUTH, label=f"threshold, {_THRESHOLD_PF} pF")
    ax.axhline(_DRIFT_PF, color=SOFT, linewidth=0.7, linestyle=":", label=f"drift, {_DRIFT_PF} pF")
    ax.set_ylabel("pF")
    ax.legend(loc="upper right")


def _compared(ax: Any, t: Traces, names: dict[str, tuple[str, str]]) -> None:
    for name, (colour, label) in names.items():
        ax.plot(getattr(t, name), color=colour, label=label)
    ax.plot(t.truth, label="truth", **TRUTH)
    ax.set_ylabel("capacitance ratio")
    ax.legend(loc="lower right", ncols=2)


def _shade(ax: Any, alarm: Array, colour: str) -> None:
    sample = np.arange(len(alarm))
    ax.fill_between(
        sample, 0, 1, where=alarm, color=colour, alpha=0.25, linewidth=0, transform=ax.get_xaxis_transform()
    )


def _titles(axes: Any, titles: list[list[str]]) -> None:
    for row, names in zip(axes, titles, strict=True):
        for ax, name in zip(row, names, strict=True):
            ax.set_title(name)
    for ax in axes[-1]:
        ax.set_xlabel("sample number")
