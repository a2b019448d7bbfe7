"""The tracker: the bookkeeping, and what it does with readings that are not as they should be."""

import pickle
from typing import Any

import numpy as np
import palpate
import pytest
from hypothesis import given
from hypothesis import strategies as st
from palpate.simulation import scenarios
from tracking import SCENES, process


def test_the_handheld_scene_is_its_stages() -> None:
    """The tracker's ratio is HandoverRls on changes through the matched pair of filters: recomputed here with numpy."""
    run = scenarios.run("tremor", 2)
    tracker, rows = process("handheld", run)
    [touch] = tracker.touches
    used = np.flatnonzero(rows["touch"] == 1)
    assert touch.samples == len(used) in (250, 251)
    # The pair that reading k completes is around hard k - 1; the jitter of its times is ignored here.
    h, s = run.hard, run.soft
    hard = (1 - 2 * 0.21048) * h[used - 1] + 0.21048 * (h[used - 2] + h[used])
    soft = (0.5 - 0.04482) * (s[used - 2] + s[used - 1]) + 0.04482 * (s[used - 3] + s[used])
    # The baselines are not shown; two ratios of the touch give them back.
    ratios = rows["ratio"][used]
    base = [np.median(c[run.t_hard_s < 1.9]) for c in (run.hard, run.soft)]
    again = palpate.HandoverRls().process(hard - base[0], soft - base[1])
    # Baselines from other samples: 2 * 40 aF / sqrt(40) over 0.25 pF; and the jitter.
    assert ratios[20:] == pytest.approx(again[20:], rel=4e-4)


def test_saturated_readings_are_left_out_and_counted() -> None:
    run = scenarios.run("saturating", 2)
    [touch] = palpate.touches(run)
    assert touch.saturated > 200
    assert "saturated" in touch.flags


def test_lost_readings_are_counted() -> None:
    run = scenarios.run("dropouts", 2)
    [touch] = palpate.touches(run)
    inside = slice(touch.start, touch.start + 300)
    missing = int((run.status[inside] == palpate.Status.LOST).sum())
    # A window has four soft values and three hard ones: those that are not whole are left out.
    assert missing < touch.refused <= 4 * missing
    assert "refused" not in touch.flags


def test_states_and_rows_tell_the_same() -> None:
    run = scenarios.run("four-specimens", 1)
    tracker = palpate.Tracker()
    states = []
    for row in zip(run.t_hard_s, run.t_soft_s, run.hard, run.soft, strict=True):
        tracker.feed(*map(float, row))
        states.append(tracker.state)
    order = [s for s, before in zip(states, [None, *states], strict=False) if s != before]
    assert order == ["baseline", "waiting", "contact", "done"] + ["baseline", "waiting", "contact", "done"] * 3 + [
        "baseline",
        "waiting",
    ]
    _, rows = process("handheld", run)
    assert [touch.samples in (250, 251) for touch in tracker.touches] == [True] * 4
    assert (rows["touch"] > 0).sum() == sum(touch.samples for touch in tracker.touches)
    assert tracker.readings == len(run.hard)
    assert np.isfinite(tracker.standard_error)


def test_tare_after_the_baseline_jumped() -> None:
    run = scenarios.run("tremor", 1)
    t = [run.t_hard_s, run.t_soft_s]
    jumped = np.arange(len(run.hard)) < 40
    tracker = palpate.Tracker()
    tracker.process(t[0][:60], t[1][:60], run.hard[:60] - 0.5 * jumped[:60], run.soft[:60])
    assert tracker.state == "contact"
    with pytest.raises(RuntimeError, match="contact"):
        tracker.tare()
    assert tracker.state == "contact"
    tracker.tare(force=True)
    assert (tracker.state, len(tracker.touches)) == ("baseline", 1)
    again = tracker.process(t[0] + 100, t[1] + 100, run.hard, run.soft)
    tracker.finish()
    assert len(tracker.touches) == 2
    assert tracker.touches[1].ratio == pytest.approx(run.true_ratio[200], rel=1e-3)
    assert again["touch"].max() == 2


def test_the_fixed_scene_is_rls_on_changes() -> None:
    random = np.random.default_rng(2)
    soft = random.uniform(0.1, 0.3, 100)
    t = np.arange(100) * 0.02
    tracker = palpate.Tracker("fixed", forgetting=0.98)
    rows = tracker.process(t, t, 3 * soft, soft)
    assert np.array_equal(rows["ratio"], palpate.Rls(forgetting=0.98).process(3 * soft, soft))
    assert tracker.finish().samples == 100  # type: ignore[union-attr]
    assert tracker.finish() is None


@pytest.mark.parametrize(
    ("scene", "settings", "message"),
    [
        ("moon", {}, "scene: got 'moon', allowed: fixed, paper, handheld, sliding"),
        ("handheld", {"seconds": -1.0}, "seconds: got -1.0, allowed: 0 < seconds <= 9e9, or None"),
        ("sliding", {"seconds": 0}, "seconds: got 0.0, allowed: 0 < seconds"),
        ("paper", {"seconds": float("nan")}, "seconds: got nan, allowed: 0 < seconds"),
        ("handheld", {"samples": 2.5}, "samples: got 2.5, allowed: a whole number >= 1, or None"),
        ("handheld", {"samples": 0}, "samples: got 0.0"),
        ("handheld", {"release": 1.0}, "release: got 1.0"),
        ("handheld", {"full_scale": 0.0}, "full_scale: got 0.0"),
        ("handheld", {"drift": 3.0}, r"drift: got 3.0, allowed: 0 <= drift < clip \(3.0\)"),
        ("fixed", {"forgetting": 2.0}, "forgetting: got 2.0"),
    ],
)
def test_settings_are_checked(scene: Any, settings: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        palpate.Tracker(scene, **settings)


def test_readings_are_checked() -> None:
    with pytest.raises(
        TypeError, match="got an unexpected keyword 'clip', allowed: samples, seconds, full_scale, release, steady"
    ):
        palpate.Tracker("paper", clip=3)  # type: ignore[call-overload]
    with pytest.raises(TypeError, match="drift: got 'x', allowed: a number"):
        palpate.Tracker(drift="x")  # type: ignore[call-overload]
    tracker = palpate.Tracker()
    with pytest.raises(ValueError, match="t_soft: got shape"):
        tracker.process([0.0, 1.0], [0.0], [1.0, 1.0], [1.0, 1.0])
    with pytest.raises(ValueError, match="t_hard: got nan"):
        tracker.process([np.nan], [0.0], [1.0], [1.0])
    with pytest.raises(ValueError, match="t_hard: got inf"):
        tracker.feed(np.inf, 0.0, 1.0, 1.0)
    with pytest.raises(TypeError, match="hard: got dtype"):
        tracker.process([0.0], [0.0], ["a"], [1.0])
    with pytest.raises(TypeError, match="__init__"):
        palpate.Tracker.__new__(palpate.Tracker).finish()
    assert tracker.readings == 0


@pytest.mark.parametrize("scene", SCENES)
def test_settings_and_repr_round_trip(scene: Any) -> None:
    tracker = palpate.Tracker(scene, samples=77)
    assert tracker.settings["samples"] == 77
    assert palpate.Tracker(scene, **tracker.settings).settings == tracker.settings
    assert palpate.Tracker(scene, samples=None).settings["samples"] is None
    assert repr(palpate.Tracker(scene)).startswith(f"<Tracker('{scene}'): ")
    assert repr(tracker).startswith(f"<Tracker('{scene}', samples=77")
    assert repr(tracker).endswith(", 0 touches>")


def test_touches_are_values() -> None:
    touches = palpate.touches(scenarios.run("four-specimens", 1))
    assert pickle.loads(pickle.dumps(touches)) == touches
    assert touches[0] != touches[1]
    assert repr(touches[0]).startswith("<Touch at ")
    assert touches[0].as_dict()["ratio"] == touches[0].ratio


def test_the_most_reliable_touch() -> None:
    touches = palpate.touches(scenarios.run("four-specimens", 1))
    for by in ("standard_error", "covariance"):
        best = palpate.most_reliable(touches, by=by, scatter=None)
        assert best == min(touches, key=lambda t: getattr(t, by))
    short = palpate.touches(scenarios.run("four-specimens", 1), scene="paper", samples=400)
    with pytest.raises(ValueError, match=r"touches: got no usable touch \(short"):
        palpate.most_reliable(short)
    with pytest.raises(ValueError, match="no touches"):
        palpate.most_reliable([])
    with pytest.raises(ValueError, match="by: got 'luck'"):
        palpate.most_reliable(touches, by="luck")


@given(
    st.lists(
        st.tuples(*[st.floats(allow_nan=True, allow_infinity=True)] * 2, st.integers(-(10**9), 10**9)), max_size=120
    ),
    st.sampled_from(SCENES),
)
def test_any_readings_keep_the_tracker_sane(readings: list[tuple[float, float, int]], scene: Any) -> None:
    tracker = palpate.Tracker(scene)
    run = scenarios.run("tremor", 1)
    tracker.process(run.t_hard_s[:200], run.t_soft_s[:200], run.hard[:200], run.soft[:200])
    hard, soft, ticks = ([r[i] for r in readings] for i in range(3))
    times = np.array(ticks, np.int64)
    rows = tracker.process(times, times, np.array(hard, float), np.array(soft, float))
    assert np.isfinite(rows["ratio"]).all()
    assert not np.isinf(rows["standard_error"]).any()
    tracker.finish()
    assert tracker.readings == 200 + len(readings)


def test_the_memory_of_the_baseline_is_64_values_long() -> None:
    random, n = np.random.default_rng(1), 20000
    t = 0.025 * np.arange(n)
    hard, soft = 1e-4 * random.standard_normal((2, n))
    rows = palpate.Tracker("handheld").process(t, t + 0.013, hard, soft)
    assert not rows["contact"].any()
    for name in ("hard_baseline", "soft_baseline"):
        # Of a running mean with weight 1/64: sqrt(1 / 127) of the noise.
        assert np.std(rows[name][200:]) / 1e-4 == pytest.approx((1 / 127) ** 0.5, rel=0.1)


def test_the_scene_fixed_goes_on_after_a_tare_and_an_end() -> None:
    """Nothing is released there: the next sample begins the next touch, and none is ignored."""
    tracker = palpate.Tracker("fixed")
    t = np.arange(300) * 0.026
    tracker.process(t, t, np.full(300, 0.5), np.full(300, 0.25))
    tracker.tare()
    assert tracker.state == "waiting"
    tracker.process(t + 8, t + 8, np.full(300, 0.75), np.full(300, 0.25))
    tracker.finish()
    tracker.process(t + 16, t + 16, np.full(300, 1.0), np.full(300, 0.25))
    tracker.finish()
    assert [(touch.start, touch.samples, round(touch.ratio, 3)) for touch in tracker.touches] == [
        (0, 300, 2.0),
        (300, 300, 3.0),
        (600, 300, 4.0),
    ]


def test_the_touches_that_are_new() -> None:
    tracker, _ = process("handheld", scenarios.run("four-specimens", 1))
    assert tracker.touch_count == len(tracker.touches) == 4
    assert [tracker.touches_since(k) for k in range(6)] == [tracker.touches[k:] for k in range(6)]
    with pytest.raises(ValueError, match="count: got -1, allowed: 0 or more"):
        tracker.touches_since(-1)
    with pytest.raises(TypeError, match=r"count: got 1\.5, allowed: a whole number"):
        tracker.touches_since(1.5)  # type: ignore[arg-type]
