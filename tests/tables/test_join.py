"""Two channels with their own times become pairs."""

import time

import numpy as np
import pytest
from effort import examples
from hypothesis import given
from hypothesis import strategies as st
from palpate.tables.times.pairs import Floats, Pairs, joined, partners
from palpate.tables.times.times import Times

PERIOD = 0.026


def join(hard_s: Floats, soft_s: Floats) -> Pairs:
    """Join readings of which the value is the time."""
    pairs = joined(Times(hard_s, "s"), hard_s.copy(), Times(soft_s, "s"), soft_s.copy())
    assert pairs.t_hard_s.tolist() == pairs.hard.tolist()
    assert pairs.t_soft_s.tolist() == pairs.soft.tolist()
    return pairs


@pytest.mark.parametrize("offset", [-0.5, -0.49, -0.25, 0, 0.1, 0.49, 0.5])
def test_channels_that_are_read_in_turn_lose_nothing(offset: float) -> None:
    rng = np.random.default_rng(5)
    even = np.arange(500.0) * PERIOD
    pairs = join(even + rng.uniform(-0.2, 0.2, 500) * PERIOD, even + (offset + rng.uniform(-0.2, 0.2, 500)) * PERIOD)
    assert len(pairs.hard) >= 499  # at half a period, the partner may be the one before or after: one at an end is left
    assert np.ptp(np.searchsorted(even, pairs.hard) - np.searchsorted(even, pairs.soft)) <= 3
    assert np.abs(pairs.t_soft_s - pairs.t_hard_s).max() < PERIOD


def test_what_has_no_partner_is_left_out_and_counted() -> None:
    even = np.arange(100.0) * PERIOD
    soft = np.delete(even + 0.3 * PERIOD, [7, 8, 60])[5:]  # begins later, with gaps
    pairs = join(even, soft)
    assert pairs.soft.tolist() == soft.tolist()
    assert np.rint(pairs.hard / PERIOD).astype(int).tolist() == [*range(5, 7), *range(9, 60), *range(61, 100)]
    assert pairs.notes == [
        "8 of 100 hard and 0 of 92 soft readings have none of the other channel near in time: left out"
    ]
    assert join(even, even).notes == []


@pytest.mark.parametrize("times", [1, 2, 3, 4])
def test_a_channel_with_a_higher_rate_loses_the_rest(times: int) -> None:
    hard = np.arange(400.0) * PERIOD
    soft = np.arange(0.0, 400, times) * PERIOD + 0.2 * PERIOD
    for pairs in (join(hard, soft), join(soft, hard)):
        assert len(pairs.hard) == len(soft)
        assert np.abs(pairs.hard - pairs.soft).max() == pytest.approx(0.2 * PERIOD, rel=1e-6)


def test_clocks_that_drift_keep_the_nearest_reading() -> None:
    hard, soft = np.arange(2000.0) * PERIOD, np.arange(2000.0) * PERIOD * 1.003
    pairs = join(hard, soft)
    assert np.abs(pairs.hard - pairs.soft).max() <= 0.51 * PERIOD
    assert len(pairs.hard) > 1980


def test_equal_stamps_are_paired_in_their_order() -> None:
    stamps = np.repeat(np.arange(50.0) * 0.1, 4)  # four rows come at once
    hard, soft = partners(stamps, stamps)
    assert hard.tolist() == soft.tolist() == list(range(200))


def test_jitter_that_goes_back_is_put_in_order() -> None:
    hard = np.arange(100.0) * PERIOD
    hard[[40, 41]] = hard[[41, 40]]
    pairs = join(hard, np.arange(100.0) * PERIOD)
    assert pairs.hard.tolist() == pairs.soft.tolist() == sorted(hard)


@pytest.mark.parametrize(
    ("hard", "soft", "message"),
    [
        (
            Times(np.arange(9.0) * PERIOD, "s"),
            Times(np.arange(9.0) * PERIOD + 60, "s"),
            r"0 to 0\.208 s .* 60 to 60\.208 s",
        ),
        (Times(np.array([1.0]), "s"), Times(np.array([2.0]), "s"), "allowed: times that overlap"),
        (Times(np.array([1.0, 2]), "s"), Times(np.empty(0), ""), "got 1 to 2 s .* and no times for the soft channel"),
        (
            Times(np.arange(9.0) * PERIOD, "dates", None, [], 1_763_726_400 * 10**9),
            Times(np.arange(9.0) * PERIOD, "dates", None, [], 1_763_730_000 * 10**9),
            r"2025-11-21T12:00:00\.000 to .* 2025-11-21T13:00:00\.000 to ",
        ),
        (
            Times(np.arange(9.0) * PERIOD, "dates", None, [], 1_763_726_400 * 10**9),
            Times(np.arange(9.0) * PERIOD, "s"),
            r"got 2025-11-21.* for the hard and 0 to 0\.208 s \(s\) for the soft channel, allowed: the same kind",
        ),
    ],
)
def test_times_that_do_not_overlap_are_refused_with_both_ranges(hard: Times, soft: Times, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        joined(hard, hard.seconds, soft, soft.seconds)


def test_dates_of_two_files_are_on_one_axis() -> None:
    zero = 1_763_726_400 * 10**9
    even = np.arange(50.0) * PERIOD
    pairs = joined(
        Times(even, "dates (UTC)", zero, [], zero), even, Times(even, "", zero + 10**9, [], zero + 10**9), even + 1
    )
    assert np.abs(pairs.t_hard_s - pairs.t_soft_s).max() < PERIOD / 2
    assert pairs.soft == pytest.approx(pairs.t_soft_s)


readings = st.lists(st.integers(0, 400), min_size=1, max_size=60).map(lambda counts: np.sort(np.array(counts)) * 1e-3)


@examples(60)
@given(readings, readings)
def test_any_readings_are_in_one_pair_at_most_and_in_order(hard_s: Floats, soft_s: Floats) -> None:
    hard, soft = partners(hard_s, soft_s)
    assert (np.diff(hard) > 0).all()
    assert (np.diff(soft) > 0).all()
    whole = partners(hard_s, hard_s)
    assert whole[0].tolist() == whole[1].tolist() == list(range(len(hard_s)))


@examples(60)
@given(st.integers(2, 80), st.floats(-0.45, 0.45), st.floats(0, 0.2), st.integers(0, 2**32 - 1), st.data())
def test_readings_of_one_pass_find_each_other(
    count: int, offset: float, jitter: float, seed: int, data: st.DataObject
) -> None:
    rng = np.random.default_rng(seed)
    even = np.arange(float(count)) * PERIOD
    hard_s = even + rng.uniform(-jitter, jitter, count) * PERIOD
    soft_s = even + (offset + rng.uniform(-jitter, jitter, count)) * PERIOD
    lost = data.draw(st.sets(st.integers(0, count - 1), max_size=count // 8))
    kept = np.setdiff1d(np.arange(count), list(lost))
    hard, soft = partners(hard_s, soft_s[kept])
    wrong = int(np.count_nonzero(hard != kept[soft]))
    assert len(hard) >= len(kept) - 1
    assert wrong in {0, len(hard)}  # near half a period all may be paired with the neighbour, which is as near


def test_the_cost_is_that_of_sorting() -> None:
    def took(count: int) -> float:
        even = np.arange(float(count)) * PERIOD
        begun = time.thread_time()
        assert len(join(even, even + 0.4 * PERIOD).hard) == count
        return time.thread_time() - begun

    short = min(took(20_000) for _ in range(5))
    assert min(took(200_000) for _ in range(3)) < 60 * short
