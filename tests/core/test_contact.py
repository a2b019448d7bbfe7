"""The gate: bursts, falls, its patience, and the next touch before a new baseline is measured."""

import numpy as np
import pytest
from driving import drive
from numpy.typing import ArrayLike, NDArray

CONTACT, IDLE, AGE, FELL, SUSPECTS = range(5)
LIMIT, CLIP, SLACK, PATIENCE_S = 16.0, 6.0, 1.5, 30.0


def gate(changes: ArrayLike, noise: float = 1.0) -> NDArray[np.float64]:
    """Return the state after each change, while a touch takes samples."""
    rows = np.array(changes, float)
    more = [np.full(rows.shape, noise), np.zeros(rows.shape), np.zeros(rows.shape)]
    return drive("contact", np.column_stack([rows, *more]), 5)


def test_a_touch_takes_four_values_and_begins_at_the_first() -> None:
    rows = gate([0.5] * 10 + [100.0] * 5)
    assert np.flatnonzero(rows[:, CONTACT])[0] == 13  # 4 * 4.5 = 18 >= 16
    assert rows[13, AGE] == 4
    assert not gate([0.5] * 5 + [1e9, 1e9, 1e9] + [0.5] * 40)[:, CONTACT].any()


def test_a_burst_of_noise_is_no_touch() -> None:
    """20 times the noise for 12 values: the signed change is as often below 0. The magnitude would be a touch each time."""
    touches = magnitudes = 0
    for seed in range(100):
        rng = np.random.default_rng(seed)
        values = rng.standard_normal(60)
        values[20:32] *= 20
        touches += int(gate(values)[:, CONTACT].any())
        magnitudes += int(gate(np.abs(values))[:, CONTACT].any())
    assert magnitudes > 95
    assert touches < 30


def test_noise_alone_neither_rises_nor_falls() -> None:
    rows = gate(np.random.default_rng(0).standard_normal(100_000))
    assert not rows[:, CONTACT].any()
    assert not rows[:, FELL].any()
    assert rows[:, SUSPECTS].any()


def test_channels_that_fall_are_noticed() -> None:
    """Three times the limit of a touch: 48 by 4.5 a value; a few wild values are no fall."""
    rows = gate([0.0] * 10 + [-100.0] * 15)
    assert np.flatnonzero(rows[:, FELL])[0] == 20
    assert not rows[:, CONTACT].any()
    assert not gate([0.0] * 5 + [-1e9] * 10 + [0.0] * 40)[:, FELL].any()
    slow = gate([-2.5] * 80)  # a slack of 1.5: 1 a value
    assert np.flatnonzero(slow[:, FELL])[0] == 47


@pytest.mark.parametrize("stays", [30.0, 100.0])
def test_the_patience_ends_a_release_that_never_comes(stays: float) -> None:
    """After the touch has its samples: for 30 s above idle, then the channels are idle, wherever they are."""
    changes = [0.0] * 5 + [100.0] * 4
    running = gate([*changes, *[stays] * 3000])
    assert not running[9:, IDLE].any()
    waited = np.arange(3000) * 0.026
    rows = drive(
        "contact",
        np.array([[c, 1, 0, 0] for c in changes] + [[stays, 1, since, 0] for since in waited]),
        5,
    )
    ends = np.flatnonzero(rows[9:, IDLE])[0]
    assert ends == np.searchsorted(waited, PATIENCE_S)


def between(height: float, later: list[float], noise: float) -> NDArray[np.float64]:
    """Return the contact of changes while a baseline is measured, after a touch of this height and its release."""
    rows = [[0.0, noise, 0, 0]] * 3 + [[height, noise, 0, 0]] * 10 + [[0.0, noise, 0, 0]] * 6
    done = drive("contact", np.array(rows + [[c, noise, 0, 1] for c in later]), 5)
    assert done[len(rows) - 1, IDLE]
    return done[len(rows) :, CONTACT]


def test_the_next_touch_is_above_a_fifth_of_the_last_and_above_the_noise() -> None:
    assert np.flatnonzero(between(100.0, [21.0] * 10, 1.0))[0] == 3  # four in a row
    assert not between(100.0, [19.0] * 10, 1.0).any()
    assert not between(100.0, [21.0, 21.0, 21.0, 0.0] * 5, 1.0).any()
    # After a light touch a fifth of it is noise: 6 standard deviations are the least.
    assert not between(20.0, [5.9] * 10, 1.0).any()
    assert np.flatnonzero(between(20.0, [6.1] * 10, 1.0))[0] == 3
    assert not between(20.0, list(np.random.default_rng(0).standard_normal(5000)), 1.0).any()
