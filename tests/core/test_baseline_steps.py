"""Baselines that step when the probe makes contact or is lifted, beside baselines that drift."""

import numpy as np
import pytest
from hand_session import Errors, Press, Session, errors_of
from numpy.typing import NDArray

SEEDS = range(20)


def stepped(seed: int, step_pF: float, when: str, depth_pF: float = 0.25) -> Session:
    """Return a session with a step of the hard channel, of either sign, in each press; "even": a ramp during the press."""
    session = Session(seed, depth_pF=depth_pF)
    time_s = session.t_hard

    def step(press: Press) -> NDArray[np.float64]:
        if when == "even":
            return np.clip((time_s - press.begin_s) / (press.end_s - press.begin_s), 0, 1)
        at_s = {"contact": press.begin_s, "release": press.end_s - press.fall_s}[when]
        return np.where(time_s >= at_s, 1.0, 0.0)

    for press in session.presses:
        session.hard = session.hard + step_pF * session.sign() * step(press)
    return session


def found(step_pF: float, when: str, depth_pF: float = 0.25) -> Errors:
    return errors_of([stepped(seed, step_pF, when, depth_pF) for seed in SEEDS])


@pytest.mark.parametrize("depth_pF", [0.25, 0.05])
@pytest.mark.parametrize("when", ["contact", "release"])
@pytest.mark.parametrize(("step_pF", "least"), [(1e-3, 0.65), (3e-3, 0.8), (10e-3, 0.8)])
def test_the_interval_contains_the_ratio_after_a_step(
    step_pF: float, least: float, when: str, depth_pF: float
) -> None:
    assert found(step_pF, when, depth_pF).coverage >= least


@pytest.mark.parametrize("when", ["contact", "release"])
def test_a_step_that_is_told_is_corrected(when: str) -> None:
    """Half of a step of 5 fF is .2 % of these ratios or more: too much by ten times."""
    assert found(5e-3, when).rms < 2e-3 / 5


def test_an_even_drift_is_still_corrected() -> None:
    """Half of it, as before: the error is .2 % rms, from touches in which the ramp looks like a change of the ratio."""
    errors = found(5e-3, "even")
    assert np.median(np.abs(errors.errors)) < 1e-3
    assert errors.rms < 2.5e-3
    assert errors.coverage > 0.8
    assert np.median(errors.halves) < 2.3 * 1.8e-3


@pytest.mark.parametrize(("tilt_pF", "share"), [(0.0, 0.0), (10e-3, 0.5)])
def test_a_tilt_decides_nothing(tilt_pF: float, share: float) -> None:
    """The level ratio of a tilted probe is far from the ratios of both steps: half of the step is corrected, and half is open.

    The tilt makes the hard channel larger, all over the hold.
    """
    step_pF = 3e-3
    shares = []
    halves = []
    for seed in SEEDS:
        session = stepped(seed, step_pF, "release")
        for press in session.presses:
            session.hard = session.hard + np.minimum(press.shape(session.t_hard), tilt_pF)
        for press, touch in session.touches():
            whole = step_pF / press.depth_pF  # of the ratio
            shares.append(abs(touch.ratio - touch.first_ratio) / whole)
            halves.append(touch.standard_error > 0.4 * whole)
    assert np.median(shares) == pytest.approx(share, abs=0.1)
    assert np.mean(halves) > 0.75 or not tilt_pF
