"""A probe that slides over objects, in the scene sliding: the running ratio during a slide, and the result after it."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from palpate.ad7746.registers import NOISE_PF
from palpate.simulation import Scenario, Simulation
from palpate.simulation.mechanics import Gauge

from bench.accuracy.presses import DEPTH_PF, LOST, RATIO, SIDES, Result, found, held, recordings
from bench.accuracy.scene_rows import scene_rows

LIGHT_PF = 0.02
SLIDE_S = 4.0  # from contact to the start of a slide
AFTER_S = 0.5  # that is judged after a slide
HOLD_S = 2.5  # from the end of a slide to the lift
DELAY_S = 0.039  # from the middle of an aligned pair to its last reading: 1.5 pairs
STEPS = 300


@dataclass(frozen=True)
class Slide:
    """A slide to another object, along half a period of a cosine.

    Attributes
    ----------
    share : float
        Change of the ratio.
    duration_s : float
    direct : float, %
        Limit of the largest error of `HandoverRls`, where the two signals are given to it: signal_rows.slides.
    """

    share: float
    duration_s: float
    direct: float

    @property
    def end_s(self) -> float:
        """Time from contact to the end of the slide."""
        return SLIDE_S + self.duration_s

    def scenario(self, depth_pF: float = DEPTH_PF, lag_s: float = 0.0) -> Scenario:
        """Return one press with this slide; the soft gauge lags."""
        part = np.linspace(0, 1, STEPS + 1)
        moments = SLIDE_S + self.duration_s * part
        ratios = RATIO * (1 + self.share * (1 - np.cos(np.pi * part)) / 2)
        hold_s = self.end_s + HOLD_S
        press = {
            "ratios": [(0.0, RATIO), *zip(moments.tolist(), ratios.tolist(), strict=True)],
            "depth_pF": depth_pF,
            "hold_s": hold_s,
        }
        gauges = (Gauge(), Gauge(lag_s=lag_s))
        return held(press=press, duration_s=hold_s + 4.5, gauges=gauges)

    def limit(self, depth_pF: float) -> float:
        """Return the limit of the largest error, %.

        It is a sum of three: the limit of the estimator, the largest motion of the ratio during the delay of the
        filters, and four standard deviations of the noise of a pair.
        """
        fastest = math.pi / 2 * self.share / self.duration_s / (1 + self.share / 2)
        noise = NOISE_PF[0] * math.hypot(1, RATIO) / (RATIO * depth_pF)
        return self.direct + 100 * (DELAY_S * fastest + 4 * noise)


SLIDES = [Slide(0.4, 1.5, 1.0), Slide(0.4, 0.3, 14.5), Slide(0.1, 0.75, 1.1)]


def during(run: Simulation, slide: Slide) -> list[Result]:
    """Return the running ratio of each pair, from the start of a slide to half a second after it."""
    rows = scene_rows(run, "sliding")
    since_s = run.t_hard_s - run.presses[0].start_s
    part = (since_s >= SLIDE_S) & (since_s < slide.end_s + AFTER_S) & (rows["touch"] > 0)
    errors = rows["ratio"][part] / run.true_ratio[part] - 1
    spread = rows["standard_error"][part] / run.true_ratio[part]
    return [Result(*pair) for pair in zip(errors.tolist(), spread.tolist(), strict=True)] or [LOST]


def largest_error(slide: Slide, depth_pF: float, seeds: int) -> tuple[float, float, int]:
    """Return the largest error, mean over the runs, %; the share of the intervals that hold the truth, and their number."""
    runs = [during(run, slide) for run in recordings(slide.scenario(depth_pF), range(seeds))]
    largest = [max(abs(one.error) for one in run) for run in runs]
    held_ones = [abs(one.error) <= SIDES * one.standard_error for run in runs for one in run]
    return 100 * float(np.mean(largest)), float(np.mean(held_ones)), len(held_ones)


def after_slides(slide: Slide, seeds: int, lag_s: float = 0.0) -> Iterator[Result]:
    """Yield the result of each touch with a slide."""
    truth = RATIO * (1 + slide.share)
    for run in recordings(slide.scenario(lag_s=lag_s), range(seeds)):
        touch = found(run, scene="sliding")
        if touch is None:
            yield LOST
        else:
            flags = frozenset(touch.flags)
            yield Result(touch.ratio / truth - 1, touch.standard_error / truth, flags)
