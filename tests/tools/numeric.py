"""What the numeric tests share: estimators and samples for them, single stages of the core, simulated touches."""

import subprocess
import tempfile
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import palpate
import pytest
from hypothesis import strategies as st
from numpy.typing import ArrayLike, NDArray
from palpate.simulation import ConverterModel, Press, Scenario, Simulation, simulate
from project import ROOT, need, run

NAMES = ("Rls", "AdaptiveRls", "HandoverRls")
ALL = [getattr(palpate, name + bits) for bits in ("", "32") for name in NAMES]


def bank_of(single: Any) -> Any:
    """Return what makes a bank of this kind of estimators, of three if no number is given."""

    def made(streams: int = 3, **settings: float) -> palpate.Bank:
        return palpate.Bank(single(**settings), streams)

    made.__name__ = f"Bank{single.__name__}"
    return made


BANKS = [bank_of(single) for single in ALL]
every = pytest.mark.parametrize("kind", ALL)
every_block = pytest.mark.parametrize("kind", [*ALL, *BANKS])


def dtype_of(kind: Any) -> np.dtype[Any]:
    """Return the type of the numbers of an estimator or a bank."""
    return np.dtype(np.float32 if kind.__name__.endswith("32") else np.float64)


def reals(low: float, high: float, width: Any) -> st.SearchStrategy[float]:
    """Floats of a width within [low, high]; 0 in place of values below 2^-40. The ends need not be exact in this width.

    So no product is subnormal, and powers of two scale all results exactly. core/test_extremes.py has the other values.
    """
    return st.floats(low, high, width=width, allow_subnormal=False).map(
        lambda v: v if abs(v) >= 2.0**-40 else 0.0
    )


@st.composite
def adaptive_settings(draw: st.DrawFn, width: int) -> dict[str, float]:
    """Parameters of AdaptiveRls, the complete useful range for data of about 1 pF."""
    steady = draw(reals(0.5, 1.0, width))
    threshold = draw(reals(0.0, 4.0, width))
    return {
        "steady": steady,
        "alarmed": draw(reals(0.25, steady, width)),
        "drift": draw(reals(0.0, 0.5, width)),
        "threshold": threshold,
        "clear_level": draw(
            st.one_of(st.just(0.0), st.just(threshold), reals(0.0, threshold, width))
        ),
        "initial_ratio": draw(reals(-16.0, 16.0, width)),
        "initial_covariance": draw(reals(2.0**-10, 2.0**20, width)),
        "max_covariance": 2.0**20,
    }


@st.composite
def any_samples(draw: st.DrawFn, width: int, max_size: int = 40) -> tuple[list[float], list[float]]:
    """Arbitrary outputs and regressors: independent, of both signs, over six decades, with zeros in between."""
    regressor = st.one_of(
        st.just(0.0), reals(2.0**-10, 2.0**10, width), reals(-(2.0**10), -(2.0**-10), width)
    )
    pairs = draw(
        st.lists(
            st.tuples(reals(-(2.0**10), 2.0**10, width), regressor), min_size=1, max_size=max_size
        )
    )
    return [output for output, _ in pairs], [x for _, x in pairs]


@st.composite
def touch_samples(draw: st.DrawFn, width: int) -> tuple[list[float], list[float]]:
    """Draw a realistic press: a ratio of 1 to 8 with at most one step, and noise of up to 2 per cent."""
    size = draw(st.integers(20, 120))
    ratios = draw(st.tuples(reals(1.0, 8.0, width), reals(1.0, 8.0, width)))
    step = draw(st.integers(0, size))
    random: Any = draw(st.randoms(use_true_random=False))
    rounded = (lambda v: float(np.float32(v))) if width == 32 else float
    regressor = [
        rounded(0.25 * min(1.0, (k + 1) / 10) * random.uniform(0.95, 1.05)) for k in range(size)
    ]
    output = [
        rounded(x * ratios[k >= step] * (1 + 0.02 * random.uniform(-1, 1)))
        for k, x in enumerate(regressor)
    ]
    return output, regressor


@cache
def _program() -> tuple[Path, tempfile.TemporaryDirectory[str]]:
    folder = tempfile.TemporaryDirectory()
    made = Path(folder.name) / "drive"
    flags = ("-std=c++17", "-O1", "-ffp-contract=off", "-DPALPATE_CONTRACTION_OFF")
    run(
        need("c++"),
        *flags,
        f"-I{ROOT / 'cpp' / 'include'}",
        ROOT / "tests" / "cpp" / "drive.cpp",
        "-o",
        made,
    )
    return made, folder


def drive(stage: str, values: ArrayLike, columns: int) -> NDArray[Any]:
    """Return the rows that a stage makes of these numbers."""
    data = np.ascontiguousarray(values, float).tobytes()
    done = subprocess.run([_program()[0], stage], input=data, capture_output=True, check=True)
    return np.frombuffer(bytearray(done.stdout)).reshape(-1, columns)


def edge(decides: Callable[[float], bool], no: float, yes: float) -> float:
    """Return a value at which a decision changes, by bisection from one that gives no and one that gives yes."""
    assert decides(yes)
    assert not decides(no)
    for _ in range(40):
        middle = (no + yes) / 2
        no, yes = (no, middle) if decides(middle) else (middle, yes)
    return yes


def around(limit: float) -> tuple[float, float]:
    """Return values just below and just above a limit."""
    return 0.997 * limit, 1.003 * limit


HARD_PF, SOFT_PF = (baseline.level_pF for baseline in Scenario().baselines)
STEP_PF = 8.192 / 2**24
"""Step of the codes."""
EXACT = ConverterModel(jitter_s=0.0, noise_pF=0.0, together=True)
QUIET = Scenario(presses=[Press(2.0, [(0.0, 2.5)])], tremor=0.0, converter=EXACT)


def changes(run: Simulation) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the changes of the hard and of the soft channel from their levels, pF."""
    return run.hard - HARD_PF, run.soft - SOFT_PF


def quiet(seed: int = 0, **parts: Any) -> Simulation:
    """Return a simulation of QUIET with other parts."""
    return simulate(replace(QUIET, **parts), seed)


def held(run: Simulation) -> NDArray[np.bool_]:
    """Return which pairs are in the hold of the first press."""
    press = run.presses[0]
    begin = press.start_s + press.rise_s + 0.05
    return np.asarray((run.t_hard_s > begin) & (run.t_hard_s < press.stop_s - press.fall_s - 0.05))


SCENES = ["fixed", "paper", "handheld", "sliding"]


def process(
    scene: Any, run: Simulation, **settings: Any
) -> tuple[palpate.Tracker, np.ndarray[Any, Any]]:
    tracker = palpate.Tracker(scene, **settings)
    rows = tracker.process(run.t_hard_s, run.t_soft_s, run.hard, run.soft)
    tracker.finish()
    return tracker, rows
