"""The simulated session that the page in a browser shows at once: three specimens, two touches each, and their truth."""

import base64
import json
import zlib
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from palpate.ad7746.datasheet import ZERO_CODE
from palpate.elasticity import SORBOTHANE_MPA
from palpate.samples import Block
from palpate.simulation import simulate
from palpate.simulation.hand import EVERY_S, Hand
from palpate.simulation.scenario import Scenario
from palpate.simulation.scenarios import PROBE

SPECIMENS = ("40 OO", "70 OO", "50 A")
TOUCHES = 2
SEED = 22
HAND = Hand(nonlinearity=0.0)  # so that the truth of a touch is one number: its ratio
STEP_NS = 100_000
"""The times are rounded to these steps: they need fewer bytes then."""


def scenario() -> Scenario:
    """Return the touches: one specimen after the other."""
    random = np.random.default_rng(SEED)
    parts = [HAND.touches(PROBE.ratio(SORBOTHANE_MPA[name]), TOUCHES, random) for name in SPECIMENS]
    presses = [
        replace(press, start_s=press.start_s + TOUCHES * EVERY_S * number)
        for number, part in enumerate(parts)
        for press in part.presses
    ]
    duration_s = parts[-1].duration_s + TOUCHES * EVERY_S * (len(parts) - 1)
    return replace(parts[0], presses=presses, duration_s=duration_s)


def block() -> Block:
    """Return the readings of the session, with times of whole steps."""
    made = simulate(scenario(), seed=SEED).block()
    if not (np.diff(made["seq"]) == 1).all() or made["status"].any() or (made["t_uncertainty_us"] != -1).any():
        raise ValueError("sample: got lost or saturated readings, allowed: all are there")
    for name in ("t_hard_ns", "t_soft_ns"):
        made[name] = np.rint(made[name] / STEP_NS).astype(np.int64) * STEP_NS
    return made


def sample() -> str:
    """Return the module `sample.js`: differences from row to row of each column, packed.

    Each difference is an integer whose lowest bit is its sign, of three bytes: first the lowest bytes of all rows, then the
    next. The columns are t_hard, t_soft - t_hard, both in steps, and the two codes above that of 0 pF.
    """
    made = block()
    t_hard, t_soft = made["t_hard_ns"] // STEP_NS, made["t_soft_ns"] // STEP_NS
    codes = (made[name].astype(np.int64) - ZERO_CODE for name in ("hard_raw", "soft_raw"))
    columns = (t_hard, t_soft - t_hard, *codes)
    data = b"".join(_planes(np.diff(column, prepend=0)) for column in columns)
    packed = base64.b64encode(zlib.compress(data, 9)).decode()
    told = {"rows": len(made), "step_ns": STEP_NS, "truth": truth(), "packed": packed}
    return f"export const SAMPLE = {json.dumps(told)};\n"


def truth() -> list[dict[str, Any]]:
    """Return what each touch was of: the specimen, its modulus and ratio, the ratio of this touch as it was held, and the hand's scatter."""
    return [
        {
            "touch": number + 1,
            "name": (name := SPECIMENS[number // TOUCHES]),
            "modulus_MPa": SORBOTHANE_MPA[name],
            "ratio": PROBE.ratio(SORBOTHANE_MPA[name]),
            "touch_ratio": press.ratios[0][1],
            "scatter": HAND.oblique,
        }
        for number, press in enumerate(scenario().presses)
    ]


def _planes(differences: NDArray[np.int64]) -> bytes:
    rest = 2 * np.abs(differences) + (differences < 0)
    if (rest >= 1 << 24).any():
        raise ValueError(f"sample: got a step of {np.abs(differences).max()}, allowed: below 2**23")
    return b"".join((rest >> shift & 255).astype(np.uint8).tobytes() for shift in (0, 8, 16))
