"""Data of Fig. 6, 7 and 9 of the paper: readouts and all estimates during simulated touches."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from palpate._core import AdaptiveRls, Rls, Tracker
from palpate.elasticity import SORBOTHANE_MPA
from palpate.simulation.press import Press
from palpate.simulation.probe import Simulation, simulate
from palpate.simulation.scenario import Scenario
from palpate.simulation.scenarios import PROBE

Array = NDArray[Any]
START_S = 3.9  # contact at about the 150th sample
TREMOR = 0.01  # of the press, in each of these figures
SETTLED = 50  # samples after contact; later samples count as settled
PAIR = ("30 OO", "30 A")
"""The specimens of the paper's Fig. 6."""
ONE = "70 OO"
"""The specimen of the paper's Fig. 7."""
FOUR = ("30 OO", "70 OO", "40 A", "70 A")
"""The specimens of the paper's Fig. 9."""


@dataclass(frozen=True)
class Traces:
    """All curves of one recording for the figures: arrays of shape (n,).

    The ordinary and adaptive estimators run as in the paper: input are the changes from the mean before contact, for
    250 samples from contact on. The ratio is 1 before, and is set back to 1 after them. The handheld scene gets the
    unchanged readings; its ratio is nan outside touches, and so are innovation and statistic.
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

    def columns(self) -> dict[str, Array]:
        """Return the numbers of a figure as named columns."""
        names = {"hard": "hard_pF", "soft": "soft_pF", "innovation": "innovation_pF", "statistic": "alarm_signal_pF"}
        names |= {
            "slow": "ratio_0.995",
            "fast": "ratio_0.9",
            "adaptive": "ratio_adaptive",
            "paper_alarm": "alarm_adaptive",
            "handheld": "ratio_handheld",
            "alarm": "alarm_handheld",
        }
        return {"sample": np.arange(len(self.hard)), **{names.get(name, name): a for name, a in vars(self).items()}}


def two_specimens(seed: int) -> dict[str, Traces]:
    """Simulate one touch on each specimen of Fig. 6."""
    return {name: one_touch(name, seed) for name in PAIR}


def stacked(parts: Mapping[str, Traces]) -> dict[str, ArrayLike]:
    """Return the numbers of several recordings, one below the other, with the name of the specimen."""
    columns = [t.columns() for t in parts.values()]
    names = [name for name, t in parts.items() for _ in t.hard]
    return {"specimen": names, **{key: np.concatenate([c[key] for c in columns]) for key in columns[0]}}


def one_touch(specimen: str, seed: int) -> Traces:
    """Simulate one touch on a specimen."""
    press = Press(START_S, [(0.0, PROBE.ratio(SORBOTHANE_MPA[specimen]))], hold_s=7.5)
    return traces(simulate(Scenario(presses=[press], duration_s=13.0, tremor=TREMOR), seed))


def four_touches(seed: int) -> Traces:
    """Simulate touches on four specimens, one after the other, from soft to hard."""
    presses = [
        Press(2.0 + 9.5 * i, [(0.0, PROBE.ratio(SORBOTHANE_MPA[name]))], depth_pF=0.2) for i, name in enumerate(FOUR)
    ]
    return traces(simulate(Scenario(presses=presses, duration_s=39.5, tremor=TREMOR), seed))


def traces(run: Simulation) -> Traces:
    """Return the estimates of all estimators for a recording."""
    idle = run.t_hard_s < run.presses[0].start_s - 0.2
    hard, soft = run.hard - run.hard[idle].mean(), run.soft - run.soft[idle].mean()
    paper = Tracker("paper")
    paper.process(run.t_hard_s, run.t_soft_s, run.hard, run.soft)
    handheld = Tracker("handheld")
    rows = handheld.process(run.t_hard_s, run.t_soft_s, run.hard, run.soft)
    found = {name: np.ones(len(hard)) for name in ("slow", "fast", "adaptive")}
    found |= {name: np.full(len(hard), np.nan) for name in ("innovation", "statistic")}
    alarm = np.zeros(len(hard), bool)
    for touch in paper.touches:
        used = slice(touch.start, touch.start + touch.samples)
        found["slow"][used] = Rls(forgetting=0.995).process(hard[used], soft[used])
        found["fast"][used] = Rls(forgetting=0.9).process(hard[used], soft[used])
        adaptive = AdaptiveRls().trace(hard[used], soft[used])
        found["adaptive"][used], alarm[used] = adaptive["ratio"], adaptive["alarm"]
        found["innovation"][used], found["statistic"][used] = adaptive["innovation"], adaptive["statistic"]
    inside = rows["touch"] > 0
    return Traces(
        hard,
        soft,
        run.true_ratio,
        **found,
        paper_alarm=alarm,
        handheld=np.where(inside, rows["ratio"], np.nan),
        standard_error=np.where(inside, rows["standard_error"], np.nan),
        alarm=rows["alarm"] & inside,
    )
