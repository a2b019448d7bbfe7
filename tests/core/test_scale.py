"""Signals of any scale: `handheld` and `sliding` find the same touches, ratios and flags."""

from pathlib import Path
from typing import Any

import numpy as np
import palpate
import pytest
from command_lines import document, run
from palpate.reference import handheld
from project import FOUR

PLAY = palpate.read(FOUR)
STREAMED = ("start_s", "samples", "flags", "ratio", "standard_error")


def table(folder: Path, scale: float) -> Path:
    path = folder / "signals.csv"
    columns = np.column_stack(
        [PLAY.t_hard_s, PLAY.t_soft_s, PLAY.hard * scale, PLAY.soft * scale]
    ).tolist()
    path.write_text(
        "t_hard,t_soft,hard,soft\n" + "".join(",".join(map(repr, row)) + "\n" for row in columns)
    )
    return path


@pytest.mark.parametrize("scene", ["handheld", "sliding"])
@pytest.mark.parametrize("scale", [1e-9, 1e-6, 1e-3, 1e3, 1e6])
def test_any_scale_has_the_same_touches(scene: Any, scale: float, tmp_path: Path) -> None:
    """The initial ratio is as good as unknown: it counts 1e-10 / (sum of 250 x^2), below 1e-11, in pF as elsewhere.

    The noise of the first three innovations, which are left out of the standard error at pF as well, may differ by the
    weight of the initial ratio in them, 1e-10 / x^2 with x^2 of some noise variances of 1.6e-9: 1e-6 after the mean of 250.
    """
    expected = palpate.touches(PLAY, scene=scene)
    path = table(tmp_path, scale)
    with palpate.Stream(str(path), scene=scene, unit="N") as stream:
        for _ in stream.batches():
            pass
    found = palpate.touches(path, scene=scene, unit="N")
    shown = document("replay", path, "--unit", "N", "--scene", scene)
    assert (found.unit, shown["unit"], len(found)) == ("N", "N", len(expected))
    for mine, streamed, record, pF in zip(
        found, stream.touches, shown["touches"], expected, strict=True
    ):
        assert (
            mine.as_dict()
            == streamed.as_dict()
            == {key: record[key] for key in mine.as_dict()} | {"flags": ()}
        )
        assert (mine.start_s, mine.samples, mine.flags) == (pF.start_s, pF.samples, pF.flags)
        assert mine.ratio == pytest.approx(pF.ratio, rel=1e-9)
        assert mine.standard_error == pytest.approx(pF.standard_error, rel=1e-6)


def test_the_reference_agrees_at_another_scale() -> None:
    hard = PLAY.hard[:380] * 1e-6
    soft = PLAY.soft[:380] * 1e-6
    t_hard, t_soft = (
        np.rint(t[:380] * 1e9).astype(np.int64) for t in (PLAY.t_hard_s, PLAY.t_soft_s)
    )
    [expected], _ = handheld(t_hard, t_soft, hard, soft)
    tracker = palpate.Tracker("handheld")
    tracker.process(t_hard, t_soft, hard, soft)
    tracker.finish()
    [touch] = tracker.touches
    assert touch.ratio == pytest.approx(expected.ratio, rel=1e-9)
    assert touch.standard_error == pytest.approx(expected.standard_error, rel=1e-6)


def test_the_unit_is_shown_and_kept(tmp_path: Path) -> None:
    path = table(tmp_path, 1e3)
    assert "unit: N; of the covariance: 1/(N)^2" in run("replay", path, "--unit", "N").stdout
    assert run("record", path, "--unit", "N", "-o", tmp_path / "kept.csv").exit_code == 0
    assert palpate.read(tmp_path / "kept.csv").unit == "N"
    assert document("replay", tmp_path / "kept.csv")["unit"] == "N"


def test_what_is_refused(tmp_path: Path) -> None:
    path = table(tmp_path, 1e3)
    with pytest.raises(
        ValueError,
        match="drift, threshold, initial_covariance, max_covariance: got none for signals in N",
    ):
        palpate.touches(path, unit="N", scene="paper")
    given: Any = {"drift": 10, "threshold": 50, "initial_covariance": 1e6, "max_covariance": 1e6}
    assert len(palpate.touches(path, unit="N", scene="paper", **given)) == 4
    with pytest.raises(
        ValueError, match="initial_covariance, max_covariance: got none for signals in N"
    ):
        palpate.Stream(str(path), unit="N", scene="fixed")
    with pytest.raises(ValueError, match="unit: got 'N' with a recording in memory"):
        palpate.touches(PLAY, unit="N")
    assert "unit: got 'pf', allowed: aF, fF" in run("replay", path, "--unit", "pf").stderr
