"""Drawings of Fig. 6, 7 and 9 of the paper: readouts and estimates during touches; the handheld scene on the same data."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from palpate._core import AdaptiveRls
from palpate.figure_style import FAST, HANDHELD, HARD, PAPER, SLOW, SOFT, TRUTH
from palpate.figures.traces import Array, Traces

_CUSUM = AdaptiveRls().settings
_END = 395  # sample; the touch ends a little later
_UNDER: dict[str, Any] = {"color": "0.78", "linewidth": 3.0, "zorder": 1.5, "solid_capstyle": "butt", "label": "truth"}
"""The truth, a wide line under the estimates: an estimate that is right is seen on it."""


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
    ax.semilogy(100 * t.standard_error / t.truth, color=HANDHELD, linestyle=":", label="standard error")
    ax.set_ylim(1e-4, 300)
    ax.set_ylabel("error of the ratio, %")
    ax.legend(loc="lower left")


def _enlarged(
    ax: Any, t: Traces, ratios: list[tuple[Array, str]], place: tuple[float, float, float, float], within: float
) -> None:
    """Draw ratios around the truth again, so that tenths of a per cent are seen."""
    inset = ax.inset_axes(place)
    inset.plot(t.truth, **_UNDER)
    for ratio, colour in ratios:
        inset.plot(ratio, color=colour, linewidth=0.8)
    middle = np.nanmax(t.truth)
    inset.set_xlim(160, _END)
    inset.set_ylim((1 - within) * middle, (1 + within / 2) * middle)
    inset.tick_params(labelsize=6)
    inset.set_zorder(5)


def figure_6(figure: Any, parts: Mapping[str, Traces]) -> None:
    """Draw ordinary RLS with two forgetting factors on two specimens, a column each."""
    axes = figure.subplots(4, 2, sharex=True)
    for column, (name, t) in enumerate(parts.items()):
        for row, (ratio, colour, label) in enumerate(
            (
                (t.slow, SLOW, r"$\lambda$ = 0.995"),
                (t.fast, FAST, r"$\lambda$ = 0.9"),
                (t.handheld, HANDHELD, "handheld"),
            )
        ):
            _readouts_and_ratio(axes[row, column], t, ratio, colour, label)
            _enlarged(axes[row, column], t, [(ratio, colour)], (0.56, 0.6, 0.42, 0.23), 0.004)
        _errors(axes[3, column], t, {"slow": (SLOW, r"$\lambda$ = 0.995"), "fast": (FAST, r"$\lambda$ = 0.9"),
                                     "handheld": (HANDHELD, "handheld")})  # fmt: skip
        titles = ("(a) forgetting 0.995", "(b) forgetting 0.9", "(c) handheld scene", "(d) distance from the truth")
        for ax, title in zip(axes[:, column], titles, strict=True):
            ax.set_title(f"{title}, {name}")
        axes[-1, column].set_xlabel("sample number")
    axes[0, 0].set_xlim(0, _END)


def figure_7(figure: Any, t: Traces) -> None:
    """Draw RLS with adaptive forgetting: estimate, innovation with alarm signal, comparison."""
    axes = figure.subplots(3, 2, sharex=True)
    three = {"slow": (SLOW, "0.995"), "fast": (FAST, "0.9"), "adaptive": (PAPER, "adaptive")}
    two = {"adaptive": (PAPER, "adaptive"), "handheld": (HANDHELD, "handheld")}
    _readouts_and_ratio(axes[0, 0], t, t.adaptive, PAPER, "adaptive")
    _alarm(axes[1, 0], t)
    _compared(axes[2, 0], t, three)
    _enlarged(axes[2, 0], t, [(t.fast, FAST), (t.slow, SLOW), (t.adaptive, PAPER)], (0.5, 0.12, 0.48, 0.6), 0.008)
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
    for ax, ratio, colour, label in ((axes[1, 0], t.adaptive, PAPER, "adaptive"),
                                     (axes[1, 1], t.handheld, HANDHELD, "handheld")):  # fmt: skip
        ax.plot(t.truth, **_UNDER)
        ax.plot(ratio, color=colour, label=label)
        ax.set_ylabel("capacitance ratio")
        ax.set_ylim(0, 1.08 * np.nanmax(t.truth))
        ax.legend(loc="upper left")
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


def _alarm(ax: Any, t: Traces) -> None:
    threshold, drift = _CUSUM["threshold"], _CUSUM["drift"]
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
    for row, names in zip(axes, titles, strict=True):
        for ax, name in zip(row, names, strict=True):
            ax.set_title(name)
    for ax in axes[-1]:
        ax.set_xlabel("sample number")
