"""The bench of whole sessions: its simulator, its pressers and labels, how it judges, and a small run."""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import palpate
import pytest
from palpate.calibration.modulus import Modulus
from palpate.elasticity import Elasticity

from bench.accuracy import another_hand
from bench.accuracy.another_hand import Result, figures_of, results, score
from bench.accuracy.another_hand_rows import (
    NO_BOUNDS,
    ON_STAGE,
    REFERENCE,
    ROWS,
    STEADY,
    Row,
)
from bench.accuracy.another_hand_scores import Bounds, Estimate, Figures, Score, Share
from bench.accuracy.other_probe import RIGID, Array, Recorded, Way, stiffening, touch
from bench.accuracy.other_sessions import (
    DOMES,
    HAND,
    STAGE,
    WRONG_LABEL,
    Calibrating,
    Labels,
    Measuring,
    labels_MPa,
    objects,
    pressed,
    ratio_on,
    specimens,
)

SEED = 3
STILL = Way(tremor=0.0, noise=0.0)


def depth_pF(recording: Recorded) -> Array:
    """Return the change of the hard channel."""
    return np.asarray(recording.hard - recording.hard[0])


# The simulator


@pytest.mark.parametrize("modulus", [0.05, 0.4, 2.0, 30.0])
def test_the_ratio_is_that_of_eq_2(modulus: float) -> None:
    """Springs in series; both ways have the same three operations: 1e-14."""
    assert ratio_on(modulus) == pytest.approx(Elasticity().ratio(modulus), rel=1e-14)


@pytest.mark.parametrize("law", [1.0, 2.0, 3.0])
def test_a_layer_is_a_spring_that_stiffens(law: float) -> None:
    """At each depth the ratio is that of an object as stiff as the layer makes it."""
    modulus = 0.4
    way = Way(ratio=ratio_on(modulus), layer=0.2, law=law)
    depth = np.array([0.0, 0.5, 1.0, 2.0])
    factors = stiffening(way, depth, RIGID) / stiffening(way, depth, 1.0)
    expected = [ratio_on(modulus * (1 + 0.2 * d**law)) for d in depth]
    assert way.ratio * factors == pytest.approx(expected, rel=1e-12)


def test_a_layered_object_has_its_ratio_in_a_recording() -> None:
    """At the end of the hold it is above that of the thick object, as far as the depth makes it."""
    thick = touch(replace(STILL, exponent=1.5), SEED)
    layered = touch(replace(STILL, exponent=1.5, layer=0.2), SEED)
    ratios = []
    for recording in (thick, layered):
        deepest = np.argmax(recording.soft)
        ratios.append(depth_pF(recording)[deepest] / np.ptp(recording.soft))
    # Codes of .5 aF in .3 pF
    assert ratios[0] == pytest.approx(STILL.ratio, rel=1e-5)
    assert 1.05 < ratios[1] / ratios[0] < 1.5


def test_a_gain_is_of_the_hard_channel() -> None:
    before = touch(STILL, SEED)
    after = touch(replace(STILL, gain=1.02), SEED)
    # Rounding to codes: 1e-6 pF in each of four readings.
    assert depth_pF(after) == pytest.approx(1.02 * depth_pF(before), abs=4e-6)
    np.testing.assert_array_equal(after.soft, before.soft)


def test_both_bumps_have_one_exponent_unless_another_one_is_given() -> None:
    same = touch(replace(STILL, exponent=1.5, soft_exponent=1.5), SEED)
    default = touch(replace(STILL, exponent=1.5), SEED)
    other = touch(replace(STILL, exponent=1.5, soft_exponent=1.0), SEED)
    np.testing.assert_array_equal(same.soft, default.soft)
    assert np.abs(other.soft - default.soft).max() > 0.01


# Sessions


def test_labels_and_their_mistakes() -> None:
    right = labels_MPa()
    wrong = [one.label_MPa for one in specimens(Calibrating(labels=Labels.ONE_WRONG), SEED)]
    factors = np.array(wrong) / right
    changed = factors[factors != 1]
    assert len(changed) == 1
    assert abs(math.log(changed[0])) == pytest.approx(math.log(WRONG_LABEL))
    swapped = [one.label_MPa for one in specimens(Calibrating(labels=Labels.TWO_SWAPPED), SEED)]
    assert sorted(swapped) == right
    assert np.count_nonzero(np.array(swapped) != right) == 2


def test_true_moduli_scatter_around_the_labels() -> None:
    exact = specimens(Calibrating(), SEED)
    assert all(one.modulus_MPa == one.label_MPa for one in exact)
    errors = []
    for seed in range(3):
        for one in specimens(Calibrating(label_error=0.05), seed):
            errors.append(math.log(one.modulus_MPa / one.label_MPa))
    # 30 values: the standard deviation is known to 13 %; three of that.
    assert np.std(errors) == pytest.approx(0.05, rel=0.4)


def test_quick_touches_have_no_level_ratio() -> None:
    missing = 0
    for one in specimens(Calibrating(quick=5), SEED):
        for found in palpate.touches(one.recording, contact_exponent=1.5):
            missing += math.isnan(found.level_ratio)
    assert missing == 5


def test_objects_are_unknown_or_specimens() -> None:
    low = 0.2
    high = 0.6
    drawn = objects(Measuring(moduli_MPa=(low, high)), SEED)
    assert all(low <= one.modulus_MPa <= high for one in drawn)
    known = objects(Measuring(known=True), SEED)
    assert {one.modulus_MPa for one in known} <= set(labels_MPa())
    assert len({one.modulus_MPa for one in known}) == len(known)


def test_a_stage_scatters_less_than_a_hand() -> None:
    """By the angle alone a hand of .5 degrees changes the ratio of the hold by per cents."""
    scatters = []
    for presser in (STAGE, HAND):
        random = np.random.default_rng(SEED)
        recording = pressed(replace(DOMES, creep=(0.0, 0.0)), 1.0, [presser] * 6, random)
        ratios = [found.ratio for found in palpate.touches(recording)]
        assert len(ratios) == 6
        scatters.append(np.std(ratios) / np.mean(ratios))
    assert scatters[0] < 0.005
    assert scatters[1] > 3 * scatters[0]


# Scores


def test_an_estimate_is_compared_on_the_logarithm() -> None:
    found = Estimate.of(Modulus(1.1, 1.0, 1.21), 1.0)
    assert found.error == pytest.approx(math.log(1.1))
    assert found.half_width == pytest.approx(math.log(1.1))
    assert found.holds
    bound = Estimate.of(Modulus(math.nan, 0.0, 1.2), 1.0)
    assert math.isnan(bound.error)
    assert bound.half_width == math.inf
    assert bound.holds
    assert not Estimate.of(Modulus(1.1, 1.05, 1.2), 1.0).holds
    assert not Estimate.of(Modulus(math.nan, math.nan, math.nan), 1.0).holds


def figures_of_touches(*touches: Estimate) -> Figures:
    return Figures.of(Score(touches=list(touches)))


def test_figures_summarise_touches() -> None:
    found = figures_of_touches(
        Estimate(0.03, 0.05, holds=True),
        Estimate(-0.04, 0.02, holds=False),
        Estimate(math.nan, math.inf, holds=True),
        Estimate(0.0, 0.04, holds=True),
    )
    assert found.rms == pytest.approx(100 * math.sqrt((9 + 16) * 1e-4 / 3))
    assert found.half_width == pytest.approx(4.5)
    assert found.coverage == 75
    assert math.isnan(found.mean_coverage)


@pytest.mark.parametrize(
    ("bounds", "broken"),
    [
        (Bounds(rms=3.0, half_width=5.0, coverage=(90.0, 100.0)), []),
        (Bounds(rms=1.9), ["rms 2, at most 1.9"]),
        (Bounds(half_width=3.9), ["half-width 4, at most 3.9"]),
        (Bounds(coverage=(92.0, 98.0)), ["coverage 100, allowed 92 to 98"]),
        (Bounds(mean_coverage=(85.0, 100.0)), ["of means -, at least 85"]),
        (Bounds(shares={Share.STIFFENS: (0.0, 1.0)}), ["stiffens -, at most 1"]),
    ],
)
def test_bounds_name_what_is_broken(bounds: Bounds, broken: list[str]) -> None:
    found = figures_of_touches(Estimate(0.02, 0.04, holds=True))
    assert bounds.broken(found) == broken


def test_an_interval_that_is_too_wide_breaks_the_rule() -> None:
    wide = figures_of_touches(Estimate(0.02, 0.06, holds=True))
    assert Bounds().broken(wide) == ["half-width / rms 3, at most 2.5"]
    assert NO_BOUNDS.broken(wide) == []
    row = replace(REFERENCE, bounds=Bounds())
    assert str(Result(row, wide)).startswith("FAILS reference")
    assert Result(replace(row, bounds=Bounds(has_rule=False)), wide).verdict == ""
    assert Result(replace(row, bounds=Bounds(rms=9.0, has_rule=False)), wide).verdict == "holds"


def test_a_session_without_a_calibration_has_no_modulus() -> None:
    found = Figures.of(score(REFERENCE, None, SEED))
    assert found.shares[Share.WITHOUT] == 100
    assert found.shares[Share.RELIABLE] == 0
    assert "coverage -, allowed 92 to 98" in REFERENCE.bounds.broken(found)


# Runs


def test_titles_are_unique() -> None:
    titles = [row.title for row in ROWS]
    assert len(set(titles)) == len(titles)


def test_a_hand_after_a_stage_is_worse_than_the_stage() -> None:
    """Two sessions, 40 touches: a level stage reaches 1 %; 1.5 degrees add to its error."""
    stage = Row("stage", ON_STAGE, STEADY)
    hand = Row("hand", ON_STAGE, Measuring(presser=HAND.at(1.5)))
    by_stage, by_hand = (result.figures for result in results([stage, hand], 2))
    assert by_stage.rms < 1
    assert by_hand.rms > 2 * by_stage.rms
    assert by_stage == figures_of(stage, 2)


def test_the_results_are_written(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    rows = (Row("first", ON_STAGE, STEADY), replace(REFERENCE, title="second"))
    monkeypatch.setattr(another_hand, "ROWS", rows)
    arguments = ["another_hand", "--sessions", "1", "--rows", "^f", "--out", str(tmp_path)]
    monkeypatch.setattr("sys.argv", arguments)
    with pytest.raises(SystemExit) as ended:
        another_hand.main()
    assert ended.value.code == 0
    [header, line] = capsys.readouterr().out.splitlines()
    assert header.split()[:3] == ["rms", "+-", "holds"]
    assert line.split()[0] == "first"
    document = json.loads((tmp_path / another_hand.FILE).read_text())
    assert document["sessions"] == 1
    assert list(document["rows"]) == ["first"]
    written = document["rows"]["first"]
    assert f"{written['rms']:.2g}" == f"{float(line.split()[1]):.2g}"
    assert written["shares"]["without"] == float(line.split()[7])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--sessions", "0"], "--sessions is 0; give 1 or more"),
        (["--rows", "no such row"], "no row has 'no such row' in its title"),
        (["--rows", "("], "no regular expression"),
    ],
)
def test_wrong_arguments_are_refused(
    arguments: list[str],
    message: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr("sys.argv", ["another_hand", *arguments])
    with pytest.raises(SystemExit, match="2"):
        another_hand.main()
    assert message in capsys.readouterr().err
