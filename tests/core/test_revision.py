"""The reviser: the core against the reference, and in the tracker."""

from collections.abc import Callable

import numpy as np
import pytest
from effort import examples
from hypothesis import given
from hypothesis import strategies as st
from numeric import around, drive, edge
from numpy.typing import NDArray
from palpate.reference.tracker import Known, Revised, Seen, line_share, revised

KINDS = ["none", "drift", "creep", "baseline"]
EPS = np.finfo(float).eps

noises = st.sampled_from([1e-6, 4e-5, 1e-3])
changes = st.sampled_from([0.0, 0.0]) | st.floats(-5, 5) | st.floats(-12, 12) | st.floats(-40, 40)
slopes = st.sampled_from([0.0, 1.0, -1.0]) | st.floats(-0.2, 0.2)


@st.composite
def channels(draw: st.DrawFn) -> tuple[Known, Known]:
    """Draw the baseline of a channel before and after a touch; the change in units of its standard deviation."""
    noise = draw(noises)
    level = draw(st.sampled_from([0.62, -0.41, 3.9]))
    variances = [noise**2 * draw(st.floats(0.01, 0.05)) for _ in range(2)]
    moved = draw(changes) * (variances[0] + variances[1]) ** 0.5
    # far below: measured in contact
    moved = draw(st.sampled_from([moved, moved, moved, draw(st.floats(-0.15, 0.0))]))
    ages = [draw(st.floats(0, 63)) for _ in range(2)]
    slow = draw(st.sampled_from([0.0, 0.0, 0.01, 1.0])) * noise**2
    return (
        Known(level, variances[0], ages[0], noise, slow=slow),
        Known(level + moved, variances[1], ages[1], noise, 16 * draw(slopes) * noise),
    )


@st.composite
def touches(draw: st.DrawFn) -> dict[str, float]:
    samples = draw(st.integers(1, 400))
    return {
        "start": draw(st.sampled_from([0, 100, 10**6])),
        "samples": samples,
        "forgetting": draw(st.sampled_from([1.0, 0.995, 0.9])),
        "change": draw(st.integers(-1, samples - 1)),
        "kept": draw(st.integers(1, 40)),
        "wait": draw(st.integers(1, 100)),
        "ratio": draw(st.sampled_from([1.0, 2.8, 9.0])),
        "mean": draw(st.sampled_from([1e-3, 0.25, 4.0, -0.25])),
    }


@st.composite
def evidence(draw: st.DrawFn) -> dict[str, float]:
    """Draw what a touch shows of how its baselines moved; all relative to what an even change would give."""
    return {
        "drift": draw(st.sampled_from([0.0, 1.0]) | st.floats(-0.5, 1.5)),
        "error": draw(st.sampled_from([0.0, 0.01]) | st.floats(0.001, 1.5)),
        "length": draw(st.floats(0.1, 1.0)),
        "level": draw(st.sampled_from([np.nan, 0.0, 1.0]) | st.floats(-2, 3)),
        "level_error": draw(st.sampled_from([1e-5, 1e-3])),
    }


UNKNOWN = {"drift": 0.0, "error": 0.0, "length": 0.5, "level": np.nan, "level_error": 1e-3}  # fmt: skip


def mean_age(touch: dict[str, float]) -> float:
    """Return the mean age of the samples: weights forgetting^age; those that a hand-over kept have the same weight."""
    weights = np.zeros(0)  # the newest last
    for i in range(int(touch["samples"])):
        if i == touch["change"]:
            weights = np.ones(int(touch["kept"]))
        else:
            weights = np.append(touch["forgetting"] * weights, 1.0)
    return float(weights @ np.arange(len(weights))[::-1] / weights.sum())


def by_both(
    before: tuple[Known, Known],
    after: tuple[Known, Known],
    touch: dict[str, float],
    of_touch: dict[str, float] = UNKNOWN,
) -> tuple[Revised, NDArray[np.float64]]:
    """Return what the reference and the core make of a touch."""
    last = touch["start"] + touch["samples"] - 1
    end = touch["start"] + touch["samples"] + touch["wait"]
    share = line_share(last - mean_age(touch), touch["start"], end, (before[0].age, after[0].age))
    changed = touch["change"] >= 0
    ratio = touch["ratio"]
    mean = touch["mean"]
    rise = [later.level - earlier.level for earlier, later in zip(before, after, strict=True)]
    whole = -(rise[0] - ratio * rise[1]) / mean
    span = end - after[0].age - touch["start"] + before[0].age
    expected = -whole / ratio * of_touch["length"]
    drift = of_touch["drift"] * expected
    error = of_touch["error"] * abs(expected)
    level = ratio + of_touch["level"] * whole
    errors = level, of_touch["level_error"]
    seen = Seen(drift if error else np.nan, error, of_touch["length"], *errors)
    right = revised(before, after, ratio=ratio, mean=mean, share=share, changed=changed, seen=seen)
    head = [*(touch[name] for name in ("start", "samples", "forgetting", "change", "kept")), end]
    known = [drift, error, of_touch["length"] * span, *errors]
    given_ = [*head, ratio, mean, *known, *np.ravel([*before, *after])]
    return right, drive("revise", given_, 5)[0]


@examples(400)
@given(channels(), channels(), touches(), evidence())
def test_the_core_is_the_reference(
    hard: tuple[Known, Known],
    soft: tuple[Known, Known],
    touch: dict[str, float],
    of_touch: dict[str, float],
) -> None:
    before, after = zip(hard, soft, strict=True)
    right, (kind, shift, variance, left_open, significant) = by_both(before, after, touch, of_touch)
    # The levels are subtracted: 10 eps of them, against what is left; and some eps of the shares.
    levels = 10 * EPS * (1 + touch["ratio"]) * 4 / abs(touch["mean"])
    # A place on the line is a difference of two times of up to a million readings.
    span = touch["samples"] + touch["wait"]
    place = 4 * EPS * (touch["start"] + span) / span
    moves = [later.level - earlier.level for earlier, later in (hard, soft)]
    allowed = (
        levels
        + 1e-11 * abs(right.shift)
        + place * abs(moves[0] - touch["ratio"] * moves[1]) / abs(touch["mean"])
    )
    variances = sum(
        (known.variance + known.slow) * weight
        for pair, weight in ((hard, 1.0), (soft, touch["ratio"] ** 2))
        for known in pair
    )
    assert KINDS[int(kind)] == right.kind
    assert abs(shift - right.shift) <= allowed
    assert abs(variance - right.variance) <= 1e-11 * right.variance + 2 * place * variances
    assert abs(left_open - right.open) <= 3 * allowed * (abs(right.shift) + allowed)  # of a square
    assert significant == right.significant


@pytest.mark.parametrize(
    ("decides", "rise", "slope", "most"),
    [
        (lambda found: found.significant, 1.0, 0.0, 1e-3),
        (lambda found: found.open > 0, 1.0, 0.0, 1e-3),
        (lambda found: found.kind == "baseline", -1.0, 0.0, 0.2),
        (lambda found: found.kind == "creep", 1.0, -4e-5, 1e-3),
        (lambda found: found.kind == "creep", 1e-3, -1.0, 1e-4),
    ],
    ids=[
        "significant",
        "drifted",
        "measured in contact",
        "creep, by its change",
        "creep, by its slope",
    ],
)
def test_each_limit_is_that_of_the_reference(
    decides: Callable[[Revised], bool], rise: float, slope: float, most: float
) -> None:
    """Of a rise or a slope: the one that is 1 is varied."""
    before = (Known(0.62), Known(-0.41))
    touch = {
        "start": 100.0,
        "samples": 200,
        "forgetting": 0.995,
        "change": -1,
        "kept": 1,
        "wait": 40,
        "ratio": 2.8,
    }

    def both(size: float) -> tuple[Revised, NDArray[np.float64]]:
        rises = size * rise if abs(rise) == 1 else rise
        slopes = size * slope if abs(slope) == 1 else slope
        return by_both(
            before,
            (Known(0.62 + rises, recovery=16 * slopes), Known(-0.41)),
            touch | {"mean": 0.25},
        )

    for size in around(edge(lambda size: decides(both(size)[0]), 0.0, most)):
        right, (kind, _, _, left_open, significant) = both(size)
        assert (KINDS[int(kind)], left_open > 0, significant) == (
            right.kind,
            right.open > 0,
            right.significant,
        )
