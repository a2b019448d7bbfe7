"""Fig. 10, 11 and 12 of the paper: four touches on each of ten specimens, and the fitted curve."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from palpate import touches
from palpate.calibration import Calibration
from palpate.calibration.paper_figures import draw_spread, parameter_texts
from palpate.calibration.plot import draw_curve, moduli_axis
from palpate.calibration.specimen_fit import SpecimenTouches, combined_ratio, fit_specimens
from palpate.display.plots import HANDHELD, HARD, PAPER, SLOW, TRUTH
from palpate.elasticity import SORBOTHANE_MPA
from palpate.simulation.hand import Hand, session
from palpate.simulation.scenarios import PROBE

from bench.paper.touches import TREMOR

if TYPE_CHECKING:
    from palpate._core import _Scene


@dataclass(frozen=True)
class TenSpecimens:
    """The same recordings estimated by two scenes, and a calibration of each."""

    paper: list[SpecimenTouches]
    handheld: list[SpecimenTouches]
    smallest_p: Calibration  # as in the paper: for each specimen the touch with the smallest P
    every_touch: Calibration  # by the handheld scene

    def chosen(self) -> dict[str, list[float]]:
        """Return the ratio of each specimen, by the ways to find it that Fig. 11 compares."""
        return {
            "mean": [one.mean for one in self.paper],
            "smallest P": [combined_ratio(one.touches, "covariance").ratio for one in self.paper],
            "smallest standard error": [
                combined_ratio(one.touches, "standard_error").ratio for one in self.handheld
            ],
        }


def ten_specimens(seed: int) -> TenSpecimens:
    """Simulate four touches on each of ten specimens."""
    runs = session(seed, hand=Hand(tremor=TREMOR))

    def through(scene: "_Scene") -> list[SpecimenTouches]:
        return [
            SpecimenTouches(name, E, touches(runs[name], scene=scene))
            for name, E in SORBOTHANE_MPA.items()
        ]

    paper = through("paper")
    handheld = through("handheld")
    return TenSpecimens(
        paper, handheld, fit_specimens(paper, by="covariance"), fit_specimens(handheld)
    )


def figure_10(figure: Any, s: TenSpecimens) -> None:
    """Draw ratio against modulus: mean and standard deviation of four touches; inset: logarithmic moduli."""
    draw_spread(figure, s.paper)


def figure_11(figure: Any, s: TenSpecimens) -> None:
    """Draw two ways to choose a touch, compared with the mean."""
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=[2.2, 1])
    moduli = np.array([one.modulus for one in s.paper])
    truth = np.array([PROBE.ratio(E) for E in moduli])
    fine = np.geomspace(moduli[0] / 1.2, moduli[-1] * 1.2, 200)
    upper.plot(fine, [PROBE.ratio(E) for E in fine], label="truth, without scatter", **TRUTH)
    lower.axhline(0, **TRUTH)
    looks = (
        ("s", SLOW, "mean of four"),
        ("o", PAPER, "smallest $P$ (paper)"),
        ("^", HANDHELD, "smallest std. error (handheld)"),
    )
    for ratios, (mark, colour, label) in zip(s.chosen().values(), looks, strict=True):
        style: dict[str, Any] = {"color": colour, "mfc": "none", "markersize": 4.5}
        upper.plot(moduli, ratios, mark, label=label, **style)
        lower.plot(moduli, 100 * (np.array(ratios) / truth - 1), mark, **style)
    upper.set_ylabel("capacitance ratio")
    lower.set_ylabel("distance, %")
    moduli_axis(lower)
    upper.legend(loc="upper left")


def figure_12(figure: Any, s: TenSpecimens) -> None:
    """Draw eq. (2) fitted as in the paper, and fitted to every touch, with bands."""
    for ax, fitted, colour, title in zip(
        figure.subplots(1, 2, sharey=True),
        (s.smallest_p, s.every_touch),
        (PAPER, HANDHELD),
        ("(a) smallest $P$ of four, as in the paper", "(b) every touch, handheld scene"),
        strict=True,
    ):
        draw_curve(ax, fitted.curve(400), colour=colour)
        ax.plot(
            fitted.moduli, fitted.ratios, ".", color=HARD, markersize=3, label="measured", zorder=3
        )
        ax.set_title(title)
        ax.legend(loc="lower right")
        truth = f"truth: {PROBE.rigid_ratio:g} and {PROBE.half_modulus:g} MPa"
        ax.text(
            0.03,
            0.97,
            "\n".join([*parameter_texts(fitted), truth]),
            transform=ax.transAxes,
            va="top",
            fontsize=7,
        )
        ax.set_ylim(0, 13.5)
        ax.label_outer()
