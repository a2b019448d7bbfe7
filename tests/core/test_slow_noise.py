"""Noise that is slower than the readings: the core against the reference, and intervals of sessions with such noise."""

import numpy as np
import palpate
import pytest
from effort import examples
from hand_session import Press, Scene, Session, errors_of
from hypothesis import given
from hypothesis import strategies as st
from numeric import drive
from palpate.reference.slow_noise import SlowNoise

EPS = np.finfo(float).eps
# of a value
ENDS = 0  # a block may end
SUSPECTED = 1  # a touch is suspected
TOUCH = 2  # a touch begins


@st.composite
def idle_values(draw: st.DrawFn) -> tuple[np.ndarray, np.ndarray]:
    """Draw the values of some pauses, and what each of them is."""
    random = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    size = draw(st.sampled_from([0, 7, 16, 150, 160, 1000, 3000]))
    level = draw(st.sampled_from([0.0, 0.62, -3.9, 100.0]))
    walk = draw(st.sampled_from([0.0, 1e-5, 1e-3])) * random.standard_normal(size).cumsum()
    values = level + 4e-5 * random.standard_normal(size) + walk
    spikes = draw(st.sampled_from([0.0, 0.01]))
    values = values + 0.2 * (random.random(size) < spikes)
    shares = [1 - 0.15 - draw(st.sampled_from([0.0, 0.002, 0.02])), 0.15]
    what = random.choice([ENDS, SUSPECTED, TOUCH], size, p=[*shares, 1 - sum(shares)])
    return values, what


@examples(200)
@given(idle_values(), st.floats(1, 1000), st.sampled_from([0.0, 1.6e-9]))
def test_the_core_is_the_reference(
    idle: tuple[np.ndarray, np.ndarray], length: float, white: float
) -> None:
    values, what = idle
    blocks = SlowNoise()
    for value, kind in zip(values.tolist(), what.tolist(), strict=True):
        if kind == TOUCH:
            blocks.interrupt()
        else:
            blocks.add(value, suspected=kind == SUSPECTED)
    right = blocks.of_mean(length, white)
    rows = np.column_stack([values, what]).ravel()
    [[found]] = drive("slow_noise", np.concatenate([[length, white], rows]), 1)
    # Each mean has some eps of the level, and the variance is a square: both times the longest extrapolation.
    level = np.abs(values).max(initial=0.0)
    changes = np.ptp(values) if len(values) else 0.0
    most = max(length / 8, 1.0) * (1e-11 * changes**2 + 20 * EPS * level * changes + EPS * white)
    assert abs(found - right) <= most + (20 * EPS * level) ** 2 * max(length / 8, 1.0)


def spread_of(kind: str, length: float, size: int = 20_000) -> float:
    """Return the standard deviation of a mean by slow noise, over that of a value."""
    random = np.random.default_rng(7)
    blocks = SlowNoise()
    noise = random.standard_normal(size)
    if kind == "autoregression":
        for k in range(1, size):
            noise[k] = 0.9 * noise[k - 1] + np.sqrt(1 - 0.81) * noise[k]
    if kind == "walk":
        noise = noise.cumsum()
    if kind == "drift":
        noise = noise + np.arange(size)
    for value in noise.tolist():
        blocks.add(value, suspected=False)
    return float(np.sqrt(blocks.of_mean(length, white=1.0 if kind != "walk" else 0.0)))


@pytest.mark.parametrize(
    ("kind", "right"),
    [
        ("white", 0.0),
        ("drift", 0.0),
        # half of the variance of the difference between two means of n steps: n / 3, as of two neighbours in time
        ("walk", np.sqrt(64 / 3)),
        # (1 + .9) / (1 - .9) times that of white noise, 1 / n, less what is white
        ("autoregression", np.sqrt((19 - 1) / 64)),
    ],
)
def test_the_variance_of_a_mean(kind: str, right: float) -> None:
    """Within a quarter: so long a session has the last 255 differences, and the margin for white noise is taken away."""
    assert spread_of(kind, 64) == pytest.approx(right, rel=0.25, abs=0.02)


def with_noise(session: Session, kind: str) -> Session:
    if kind == "breathing":
        return session.breathe(1e-3)
    if kind == "walk":
        return session.walk(0.2e-3)
    if kind == "flicker":
        return session.flicker(0.3e-3)
    if kind == "autoregression":
        return session.autoregress(4e-5)
    return session


KINDS = ("breathing", "walk", "flicker", "autoregression")


@pytest.mark.parametrize("depth_pF", [0.25, 0.05])
@pytest.mark.parametrize("rate_hz", [38.0, 115.0, 300.0])
@pytest.mark.parametrize("kind", KINDS)
def test_the_interval_contains_the_ratio(kind: str, rate_hz: float, depth_pF: float) -> None:
    """After 10 s of rest; a touch that slow noise alone begins is no touch of a press."""
    seeds = range(20 if rate_hz < 300 else 10)
    sessions = [
        with_noise(Session(seed, rate_hz, depth_pF, seconds=32.0, rest_s=12.0), kind)
        for seed in seeds
    ]
    assert errors_of(sessions).coverage >= (0.8 if depth_pF > 0.1 and rate_hz != 115 else 0.75)


@pytest.mark.parametrize("kind", KINDS)
def test_pauses_are_a_rest_too(kind: str) -> None:
    """Touches after 20 s, of which half are pauses of 1.5 to 4 s."""
    sessions = [with_noise(Session(seed, seconds=50.0), kind) for seed in range(10)]
    assert errors_of(sessions, after_s=20.0).coverage >= 0.8


@pytest.mark.parametrize("kind", ["breathing", "walk"])
def test_the_interval_contains_a_ratio_that_may_move(kind: str) -> None:
    sessions = [with_noise(Session(seed, seconds=32.0, rest_s=12.0), kind) for seed in range(20)]
    assert errors_of(sessions, scene="sliding").coverage >= 0.7


@pytest.mark.parametrize("scene", ["handheld", "sliding"])
def test_white_noise_has_the_interval_of_its_readings(scene: Scene) -> None:
    """The bound is the one of a mean of all samples and of two baselines, which have 64 to 127 values."""
    sessions = [Session(seed, seconds=40.0) for seed in range(20)]
    found = errors_of(sessions, scene)
    rows = [(session, press) for session in sessions for press, _ in session.touches(scene)]
    bounds = np.array([bound_of(session, press) for session, press in rows])
    assert found.coverage >= 0.9
    assert np.median(found.halves / (1.96 * bounds)) < 1.5


def bound_of(session: Session, press: Press) -> float:
    """Return the standard error of a ratio by white noise, share of it."""
    samples = session.rate_hz * (press.end_s - press.begin_s)
    variance = 4e-5**2 * (1 + session.ratio**-2) * (1 / samples + 1 / 128)
    return float(np.sqrt(variance) / press.depth_pF)


def test_a_running_touch_has_it() -> None:
    """The standard error of each row, and the first one of the touch."""
    for kind, most in (("none", 3e-4), ("walk", np.inf)):
        session = with_noise(Session(3, seconds=20.0, rest_s=12.0), kind)
        tracker = palpate.Tracker("handheld")
        rows = tracker.process(session.t_hard, session.t_soft, session.hard, session.soft)
        [touch] = tracker.touches
        live = rows["standard_error"][rows["contact"]][20:] / session.ratio
        first = touch.first_standard_error / session.ratio
        assert live.max() < most
        assert first < most
        if kind == "walk":
            assert live.min() > 3e-4
            assert first > 3e-4


def test_a_jump_at_rest_is_no_slow_noise() -> None:
    """A channel falls by .1 pF: the baselines are measured again, and the noise with them."""
    session = Session(5, seconds=40.0, rest_s=14.0)
    session.hard = session.hard - 0.1 * (session.t_hard > 6)
    right = errors_of([Session(5, seconds=40.0, rest_s=14.0)])
    assert np.median(errors_of([session]).halves) < 1.5 * np.median(right.halves)
