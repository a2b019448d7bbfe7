"""Jumps, steps and channels that do not follow: the tracker against its reference, on faults of a lab in any order."""

from typing import Any

import numpy as np
import palpate
from effort import examples
from hand_presses import Press, Session, session
from hypothesis import given, reject
from hypothesis import strategies as st
from palpate import reference

CHANNELS = st.sampled_from(["hard", "soft"])
SIZES = st.sampled_from([0.02, 0.3, 3.0, -0.02, -0.3, 0.134, 1e-3])


@st.composite
def presses(draw: st.DrawFn) -> list[Press]:
    """Draw presses of a hand or of a stage, taps and holds beyond the longest one of a stage."""
    made: list[Press] = []
    begin = draw(st.floats(1.5, 3.0))
    for _ in range(draw(st.integers(1, 3))):
        hold = draw(st.sampled_from([0.05, 1.0, 2.5, 8.0, 13.0]))
        depth = draw(st.sampled_from([0.25, 0.05, 0.4]))
        made.append(Press(begin, depth, rise=draw(st.sampled_from([0.1, 0.3, 1.5])), hold=hold))
        begin = made[-1].end + draw(st.sampled_from([0.3, 1.0, 3.0]))
    return made


@st.composite
def sessions(draw: st.DrawFn) -> Session:
    """Draw a session with up to three faults."""
    made = session(
        draw(st.integers(0, 2**31)),
        draw(presses()),
        pairs_per_s=draw(st.sampled_from([38.0, 38.0, 60.0, 20.0, 250.0])),
        tremor=draw(st.sampled_from([0.01, 0.003, 0.0])),
        noise=draw(st.sampled_from([4e-5, 4e-5, 1e-6])),
    )
    duration = float(made.t_hard[-1])
    for _ in range(draw(st.integers(0, 2))):
        at_s = draw(st.floats(1.5, duration))
        until_s = at_s + draw(st.sampled_from([1.0, 12.0, np.inf]))
        size = draw(SIZES)
        channels = draw(st.sampled_from([["hard"], ["soft"], ["hard", "soft"]]))
        for channel in channels:
            made.step(channel, at_s, size, until_s)
    if draw(st.booleans()):
        values = made.values_of(draw(CHANNELS))
        share = draw(st.floats(0.3, 0.9))
        np.minimum(values, values.min() + share * np.ptp(values), out=values)
    decimals = draw(st.sampled_from([None, 2, 3, 4, 6]))
    if decimals is not None:
        made.print(decimals)
    if draw(st.sampled_from([False, False, True])):
        made.hard = -made.hard
        made.soft = -made.soft
    return made


@examples(40)
@given(sessions(), st.sampled_from(["handheld", "sliding"]))
def test_the_levels_are_as_by_the_reference(made: Session, scene: Any) -> None:
    """The same judgements at the same times, the same touches with the same flags, the same rows."""
    t_hard, t_soft = (np.rint(1e9 * t).astype(np.int64) for t in (made.t_hard, made.t_soft))
    readings = t_hard, t_soft, made.hard, made.soft
    tracker = palpate.Tracker(scene)
    rows = tracker.process(*readings)
    tracker.finish()
    references = {"handheld": reference.handheld, "sliding": reference.sliding}
    try:
        touches, right = references[scene](*readings)
    except ZeroDivisionError:  # one channel jumps, and the other one does not change by a digit
        reject()
    screened = reference.screen(*readings).judgements
    wanted = [each.in_seconds() for each in [*screened, *right.judgements]]
    for one, other in zip(sorted(tracker.judgements), sorted(wanted), strict=True):
        assert one[1:3] == other[1:3]
        assert np.allclose([one.time_s, *one[3:]], [other[0], *other[3:]], rtol=1e-6)
    assert np.array_equal(rows["contact"], right.contact)
    assert np.array_equal(rows["revised"], right.revised)
    assert len(tracker.touches) == len(touches)
    for touch, expected in zip(tracker.touches, touches, strict=True):
        assert (touch.start, touch.samples) == (expected.start, expected.samples)
        assert touch.saturated >= expected.saturated
        assert {"step", "jumped"} & set(touch.flags) == {expected.level_flag} - {""}
