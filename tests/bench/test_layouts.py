"""Layouts of the bumps: the error of a tilted probe is what its geometry says, and docs/simulation.md shows the last table."""

import json
import math
from pathlib import Path

import pytest
from palpate.simulation.scenarios import PROBE
from project import ROOT

from bench.accuracy import layouts
from bench.results_age import RESULTS

ANGLE_DEG = 1.0


@pytest.mark.parametrize("seed", [1, 2])  # one angle of each sign
@pytest.mark.parametrize("probe", [name for name in layouts.PROBES if name not in layouts.PRESS_PF])
def test_the_error_of_a_tilt_is_that_of_the_geometry(probe: str, seed: int) -> None:
    touch, truth = layouts.touched(probe, ANGLE_DEG, seed)
    substrate = layouts.PROBES[probe]
    sign = layouts.sign(seed)
    stiffness = substrate.soft_pF_per_mm * (1 - 1 / truth) / (1 - 1 / PROBE.rigid_ratio)
    depth = (1 / (1 + truth) / stiffness) ** (1 / substrate.exponent)
    share = sign * substrate.spacing_mm * math.tan(math.radians(ANGLE_DEG)) / depth  # g / d
    power = substrate.exponent
    if substrate.layout == "hard-soft":
        between = 1 - (truth - 1) / (truth + 1) * share / 2  # of both bumps, for this force
        expected = ((between + share / 2) / (between - share / 2)) ** power - 1
    else:
        curved = power * (power - 1) / 2 * share**2
        expected = (substrate.misplaced - substrate.unequal) * power * share - curved
    # 5 %: second order of g / d, its mean over a trembling angle and force, which weighs deep samples more.
    assert touch.ratio / truth - 1 == pytest.approx(
        expected, rel=0.05, abs=4 * touch.standard_error / truth
    )


def test_the_page_shows_the_last_table(tmp_path: Path) -> None:
    page = (ROOT / "docs" / "simulation.md").read_text(encoding="utf-8")
    assert (
        "\n".join(json.loads((RESULTS / "layouts.json").read_text(encoding="utf-8"))["table"])
        in page
    )
    picture = tmp_path / "layouts.png"
    layouts.draw(layouts.measure(1), picture)
    assert picture.stat().st_size > 10_000
