"""The moments of the simulator's random parts, over random settings.

Each limit is 5 standard deviations of the moment's estimate, from as many values as make it less than a tenth of the moment: a
moment that is wrong by 10 % fails, and chance fails about once in two million.
"""

from dataclasses import replace

import numpy as np
import palpate
import pytest
from effort import examples
from hypothesis import given
from hypothesis import strategies as st
from numeric import EXACT, STEP_PF, changes, held
from numpy.typing import NDArray
from palpate.ad7746.registers import CODES_PER_PF, NOISE_PF
from palpate.elasticity import SORBOTHANE_MPA
from palpate.simulation import (
    BaselineModel,
    ConverterModel,
    Faults,
    Lines,
    Peaks,
    Press,
    Scenario,
    Tilt,
    simulate,
)
from palpate.simulation.board_input import board_scenarios
from palpate.simulation.hand import SESSIONS, Hand
from palpate.simulation.press import tilting
from palpate.simulation.probe import TrueCapacitance
from palpate.simulation.scenarios import PROBE

MANY = 4000  # independent values: a standard deviation is known to 1 / sqrt(8000) = 1.1 %
WITHIN = 5 / np.sqrt(2 * MANY)
# averages nothing
FAST = ConverterModel(jitter_s=0.0, noise_pF=0.0, together=True, conversion_s=0.001, bus_s=0.019)

seeds = st.integers(0, 2**31)


def has_deviation(values: NDArray[np.float64], expected: float) -> None:
    """Check a standard deviation and that the mean is 0."""
    assert np.std(values) == pytest.approx(expected, rel=5 / np.sqrt(2 * values.size))
    assert abs(np.mean(values)) < 5 * expected / np.sqrt(values.size)


def powers(values: np.ndarray, step_s: float) -> tuple[np.ndarray, np.ndarray]:
    """Return frequencies, Hz, and power; the sum of the power is the variance."""
    power = np.abs(np.fft.rfft(values * np.hanning(values.size))) ** 2
    return np.fft.rfftfreq(values.size, step_s), power / power.sum() * values.var()


@examples(20)
@given(seeds, st.floats(1e-5, 1e-2) | st.integers(0, 7), st.floats(-3.5, 3.5), st.floats(-3.5, 3.5))
def test_noise_has_its_variance_and_is_white(
    seed: int, noise: float, hard: float, soft: float
) -> None:
    """Of another converter, pF; or of the AD7746 at a CAPF, by the data sheet."""
    converter = ConverterModel(noise_pF=noise)
    levels = (BaselineModel(hard), BaselineModel(soft))
    if isinstance(noise, int):
        converter = ConverterModel(capf=noise)
        noise = NOISE_PF[noise]
    run = simulate(
        Scenario(
            duration_s=MANY * converter.period_s, tremor=0.0, baselines=levels, converter=converter
        ),
        seed,
    )
    assert np.array_equal(run.hard, (run.hard_raw - 0x800000) / CODES_PER_PF)
    deviations = run.hard - hard, run.soft - soft
    for values in deviations:
        has_deviation(values, noise)
        assert abs(np.corrcoef(values[1:], values[:-1])[0, 1]) < 5 / np.sqrt(values.size)
    assert abs(np.corrcoef(*deviations)[0, 1]) < 5 / np.sqrt(run.hard.size)


@examples(5)
@given(
    seeds,
    st.just(Peaks())
    | st.builds(Lines, st.tuples(st.floats(3.2, 6.0), st.floats(7.0, 11.8)), sway=st.just(0.0)),
)
def test_a_tremor_has_an_rms_of_one_between_3_and_12_hz(seed: int, spectrum: Peaks | Lines) -> None:
    """Sines near each other beat: in 200 s the mean square is known to 10 %, of 40 hands to 1.6 %; 5 of it."""
    step_s = 0.02
    random = np.random.default_rng(seed)
    squares = []
    t = np.arange(0, 200, step_s)
    for _ in range(40):
        values = spectrum.course(random)(t)
        squares.append(np.mean(values**2))
        frequency, power = powers(values, step_s)
        assert power[(frequency > 2.97) & (frequency < 12.03)].sum() > 0.999 * power.sum()
    assert np.mean(squares) == pytest.approx(1.0, abs=0.08)


@examples(4)
@given(seeds, st.floats(0.005, 0.1), st.floats(0.05, 0.8), st.floats(1.1, 3.0))
def test_the_force_trembles_by_its_share(
    seed: int, tremor: float, depth: float, ratio: float
) -> None:
    """Both channels alike: it is the force, not the readings. The mean square of 8 hands is known to 3.5 % or less."""
    press = Press(0.0, [(0.0, ratio)], depth_pF=depth, hold_s=200.0)
    scenario = Scenario(presses=[press], duration_s=195.0, tremor=tremor, converter=FAST)
    squares = []
    for hand in range(8):
        run = simulate(scenario, seed + hand)
        hard, soft = (change[held(run)] for change in changes(run))
        squares.append(np.mean((soft / depth - 1) ** 2))
        assert hard == pytest.approx(ratio * soft, abs=5 * STEP_PF)
    assert np.mean(squares) == pytest.approx(tremor**2, rel=0.18)  # an rms of 9 %


@examples(30)
@given(
    seeds,
    st.floats(1.0, 10.0),
    st.floats(0.05, 0.35),
    st.floats(0.0, 0.1),
    st.floats(-0.03, 0.03),
    st.floats(0.0, 0.05),
    st.floats(-0.2, 0.3),
)
def test_readings_without_noise_have_the_true_ratio(
    seed: int, ratio: float, depth: float, tremor: float, ramp: float, rock: float, relaxes: float
) -> None:
    """A conversion averages a product of two slopes, some 1e-5 of it; and a code has its step."""
    press = Press(2.0, [(0.0, ratio)], depth_pF=depth, relaxes=relaxes)
    tilt = Tilt(ramp_per_s=ramp, rock=rock)
    run = simulate(Scenario(presses=[press], tremor=tremor, tilt=tilt, converter=EXACT), seed)
    hard, soft = (change[held(run)] for change in changes(run))
    truth = run.true_ratio[held(run)]
    assert (
        np.abs(hard / soft - truth).max() < 3e-5 * ratio + (1 + 1.5 * ratio) * STEP_PF / soft.min()
    )
    since = run.t_hard_s[held(run)] - 2.0
    expected = (
        ratio
        * (1 + relaxes * np.expm1(-since))
        * (1 + ramp * since)
        * (1 + rock * np.sin(np.pi * since))
    )
    assert truth == pytest.approx(expected, rel=1e-12)


@examples(12)
@given(seeds, st.floats(0.1, 0.6))
def test_conversions_are_lost_at_their_rate(seed: int, lost: float) -> None:
    """Binomial: 5 standard deviations of a share of 0.1 are 10 % of it from 22,500 conversions."""
    run = simulate(Scenario(duration_s=350.0, tremor=0.0, faults=Faults(lost=lost)), seed)
    gone = np.isnan(np.stack((run.hard, run.soft)))
    assert gone.size > 22_500
    assert gone.mean() == pytest.approx(lost, abs=5 * np.sqrt(lost * (1 - lost) / gone.size))
    assert (gone[0] & gone[1]).mean() == pytest.approx(
        lost**2, abs=5 * lost / np.sqrt(gone[0].size)
    )


@examples(12)
@given(seeds, st.floats(8.0, 30.0), st.floats(0.01, 1.0))
def test_spikes_have_their_rate_size_and_both_signs(seed: int, rate: float, size: float) -> None:
    """Poisson: 5 standard deviations of 2,800 spikes are 9.4 %."""
    plain = Scenario(duration_s=350.0, tremor=0.0, converter=ConverterModel(noise_pF=0.0))
    run = simulate(replace(plain, faults=Faults(spikes_per_s=rate, spike_pF=size)), seed)
    calm = simulate(plain, seed)
    spikes = np.concatenate([run.hard - calm.hard, run.soft - calm.soft])
    hits = spikes[spikes != 0]
    assert hits.size == pytest.approx(
        rate * plain.duration_s, abs=5 * np.sqrt(rate * plain.duration_s)
    )
    assert np.abs(hits) == pytest.approx(size, abs=2 * STEP_PF)
    assert (hits > 0).mean() == pytest.approx(0.5, abs=2.5 / np.sqrt(hits.size))


@examples(3)
@given(seeds, st.floats(6.0, 8.0), st.floats(0.05, 0.12), st.floats(0.0, 30.0))
def test_bursts_take_their_share_of_the_time(
    seed: int, rate: float, length: float, factor: float
) -> None:
    """A time is outside if no burst begins in the span before it: exp(-rate length), of 30,000 spans."""
    duration_s = 3000.0
    random = np.random.default_rng(seed)
    noise = Faults(bursts_per_s=rate, burst_s=length, burst_factor=factor).burst_noise(
        duration_s, random
    )
    found = np.concatenate([noise(random.uniform(1, duration_s, 1000)) for _ in range(30)])
    outside = np.exp(-rate * length)
    spread = np.sqrt(outside * (1 - outside) * (1 / found.size + length / duration_s))
    assert (found == 1.0).mean() == pytest.approx(outside, abs=5 * spread)
    assert set(found.tolist()) <= {1.0, factor}


@examples(8)
@given(seeds, st.floats(1e-5, 1.0), st.floats(0.05, 50.0), st.floats(0.05, 2.0))
def test_a_baseline_wanders_by_its_rms_and_time_constant(
    seed: int, rms: float, tau: float, lag: float
) -> None:
    """Of independent courses: the level, and the change in a time t, whose variance is 2 rms^2 (1 - exp(-t / tau))."""
    random = np.random.default_rng(seed)
    step_s = min(0.01, tau / 10)
    # on the grid: between its points the course is a line
    lag = max(round(lag / 50 / step_s), 1) * step_s
    courses = (
        BaselineModel(wander_pF=rms, wander_s=tau).course(np.inf, 3 * lag, random)
        for _ in range(MANY)
    )
    levels = np.array([course(np.array([step_s, step_s + lag]), 0.011) for course in courses])
    has_deviation(levels[:, 0], rms)
    has_deviation(levels[:, 1], rms)
    has_deviation(np.diff(levels, axis=1).ravel(), rms * np.sqrt(-2 * np.expm1(-lag / tau)))


@examples(6)
@given(seeds, st.floats(1e-4, 0.02), st.floats(0.1, 2.0))
def test_a_tilt_walks_with_the_root_of_the_time(seed: int, walk: float, after: float) -> None:
    random = np.random.default_rng(seed)
    ends = [
        tilting(Tilt(walk=walk), 1.0 + after, random)(1.0, np.array([1.0 + after]))[0] - 1
        for _ in range(MANY)
    ]
    has_deviation(np.array(ends), walk * np.sqrt(after))


@examples(10)
@given(seeds, st.floats(1e-3, 0.1))
def test_oblique_contact_scatters_the_ratio_from_touch_to_touch(seed: int, oblique: float) -> None:
    presses = [Press(float(k), [(0.0, 2.5)]) for k in range(MANY)]
    scenario = Scenario(presses=presses, duration_s=0.1, tilt=Tilt(oblique=oblique))
    made = TrueCapacitance(scenario, np.random.default_rng(seed), seed).presses
    has_deviation(np.array([press.ratios[0][1] / 2.5 - 1 for press in made]), oblique)


@examples(10)
@given(seeds, st.floats(0.005, 0.08), st.floats(0.1, 0.3), st.floats(0.3, 3.0), st.floats(1.2, 9.0))
def test_a_hand_scatters_presses_and_ratios(
    seed: int, oblique: float, spread: float, press_pF: float, ratio: float
) -> None:
    """A press is limited to 2.2 times the median: 2.6 standard deviations of its logarithm or more."""
    hand = Hand(press_pF=press_pF, press_spread=spread, oblique=oblique)
    made = hand.touches(ratio, MANY, np.random.default_rng(seed)).presses
    factors = np.array([press.ratios[0][1] for press in made]) / ratio - 1
    has_deviation(factors, oblique)
    shares = np.log(np.array([press.depth_pF for press in made]) * (1 + ratio) / press_pF)
    assert np.std(shares) == pytest.approx(spread, rel=WITHIN + 0.01)
    assert abs(np.median(shares)) < 1.26 * 5 * spread / np.sqrt(MANY)


def test_lines_and_sway_have_their_bands() -> None:
    t = np.arange(0, 400, 0.02)
    for seed in range(5):
        values = Lines((4.0, 9.0), width_Hz=0.4, sway=0.5).course(np.random.default_rng(seed))(t)
        frequency, power = powers(values - values.mean(), 0.02)
        tremor = power[(frequency > 2.98) & (frequency < 12.02)].sum()
        sway = power[(frequency > 0.08) & (frequency < 1.02)].sum()
        # The window weights 400 s unevenly, and two of 12 sines may be closer than 1 / 400 s.
        assert tremor == pytest.approx(1.0, rel=0.05)
        assert sway == pytest.approx(0.25, rel=0.1)
        assert tremor + sway == pytest.approx(power.sum(), rel=1e-3)


def test_a_line_has_its_width() -> None:
    t = np.arange(0, 100, 0.02)
    second = []
    middle = 7.0
    for seed in range(60):
        values = Lines((middle,), width_Hz=0.4, sway=0.0).course(np.random.default_rng(seed))(t)
        frequency, power = powers(values, 0.02)
        second.append((power * (frequency - middle) ** 2).sum() / power.sum())
    # 60 x 12 sines of unequal power count as 360: an s.d. is known to 1 / sqrt(720) = 3.7 %; 4 of it.
    assert np.sqrt(np.mean(second)) == pytest.approx(0.4, rel=0.15)


def test_ten_specimens() -> None:
    scenario = SESSIONS["ten-specimens"]
    assert "ten-specimens" in board_scenarios()
    begins = [press.start_s for press in scenario.presses]
    assert np.allclose(np.diff(begins), 8.9)
    assert begins[0] > 5  # s: a list of specimens is entered, and a busy computer has its baseline
    found = palpate.touches(simulate(scenario, seed=1))
    assert len(found) == 40
    # the gauges bend a little: the firmest presses are flagged
    assert sum(bool(touch.flags) for touch in found) <= 4
    means = np.array([touch.ratio for touch in found]).reshape(10, 4).mean(axis=1)
    truth = [PROBE.ratio(modulus) for modulus in SORBOTHANE_MPA.values()]
    assert np.abs(means / truth - 1).max() < 0.05
