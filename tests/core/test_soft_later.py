"""Readings in turn with one time a row: the lag is right, is said once, and an option takes it away."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import palpate
import pytest
from command_lines import document, run
from palpate.simulation import SCENARIOS, simulate
from project import FOUR

IN_TURN = palpate.read(FOUR)
ONE_TIME = replace(IN_TURN, t_soft_s=IN_TURN.t_hard_s)
LATER_S = float(np.median(IN_TURN.t_soft_s - IN_TURN.t_hard_s))  # half a pair
NOTE = f"soft is read {1000 * LATER_S:.1f} ms after hard: --soft-later-ms {1000 * LATER_S:.1f}"


def table(path: Path) -> Path:
    columns = np.column_stack([ONE_TIME.t_hard_s, ONE_TIME.hard, ONE_TIME.soft])
    np.savetxt(path, columns, "%.9f", ",", header="t_s,hard_pF,soft_pF", comments="")
    return path


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("name", ["tremor", "stiff-steady", "four-specimens"])
def test_the_lag_of_a_flag_is_right(name: str, seed: int) -> None:
    """Within a tenth; as a slope from pair to pair it was 1.5 to 2 times as large."""
    run_ = simulate(SCENARIOS[name], seed)
    touches = palpate.touches(run_.hard, run_.soft, times_s=run_.t_hard_s)
    later_ms = 1000 * float(np.median(run_.t_soft_s - run_.t_hard_s))
    for touch in touches:
        assert "lag" in touch.flags
        assert touch.effects["lag"] == pytest.approx(-later_ms, rel=0.1)
    assert touches.soft_later_s == pytest.approx(later_ms / 1000, rel=0.02)


def test_it_is_said_once_and_the_option_takes_it_away() -> None:
    found = palpate.touches(ONE_TIME)
    assert found.notes == (NOTE,)
    assert found[:2].soft_later_s == found.soft_later_s
    right = palpate.touches(ONE_TIME, soft_later=round(found.soft_later_s, 4))
    assert right.notes == ()
    for touch, expected in zip(right, palpate.touches(IN_TURN), strict=True):
        assert touch.flags == ()
        assert touch.ratio == pytest.approx(expected.ratio, rel=5e-5)
    early = replace(ONE_TIME, hard=ONE_TIME.soft, soft=ONE_TIME.hard)
    assert palpate.touches(early).soft_later_s == pytest.approx(-LATER_S, rel=0.05)


def test_offline_uses_it() -> None:
    lags = [touch.lag_s for touch in palpate.offline(ONE_TIME)]
    assert lags == pytest.approx([-LATER_S] * 4, rel=0.1)
    for touch in palpate.offline(ONE_TIME, soft_later=LATER_S):
        assert abs(touch.lag_s) < 0.03 * LATER_S


@pytest.mark.parametrize("times", ["in turn", "no lag", "real lag"])
def test_nothing_is_said_without_reason(times: str) -> None:
    """Channels with their own times; read at once; and a bump that gives way slowly."""
    recordings: dict[str, Any] = {
        "in turn": IN_TURN,
        "no lag": simulate(SCENARIOS["together"], 1),
        "real lag": simulate(SCENARIOS["lag"], 1),
    }
    touches = palpate.touches(recordings[times])
    assert touches.soft_later_s == 0
    assert not any("soft-later-ms" in note for note in touches.notes)


def test_replay_says_it_in_place_of_the_flags(tmp_path: Path) -> None:
    path = table(tmp_path / "table.csv")
    done = run("replay", path)
    assert done.stderr.count(NOTE) == 1
    assert not any(f"{flag}:" in done.stdout for flag in ("offset", "lag", "curve"))
    found = document("replay", path, "--soft-later-ms", f"{1000 * LATER_S:.1f}")
    assert found["settings"]["soft_later"] == pytest.approx(LATER_S, abs=1e-4)
    assert [touch["flags"] for touch in found["touches"]] == [[]] * 4


def test_its_range_and_its_scenes() -> None:
    with pytest.raises(ValueError, match=r"soft_later: got 15\.6, allowed: -1 < soft_later < 1"):
        palpate.Tracker(soft_later=15.6)
    with pytest.raises(TypeError, match="soft_later"):
        palpate.Tracker("paper", soft_later=0.01)  # type: ignore[call-overload]
    with pytest.raises(TypeError, match=r"soft_later_s: got it without .*, soft_later=0\.0156"):
        palpate.touches(IN_TURN, soft_later_s=0.01)  # type: ignore[call-overload]
