"""Write four-specimens.csv: a simulated recording of four touches, softest specimen first; and its sidecar.

    python tests/data/make_four_specimens.py > tests/data/four-specimens.csv
    python tests/data/make_four_specimens.py --sidecar > tests/data/four-specimens.json

A hand presses four of the paper's specimens in turn. As on the real board, one converter reads the
two channels alternately, 13 ms apart, each conversion averaging over 11 ms, with the AD7746's noise
and 24-bit codes; the hand trembles at 4 to 11 Hz. Everything is seeded.
"""

import math
import random
import sys

MODULI_MPA = (0.143, 0.515, 1.54, 8.68)  # Table I: 30 OO, 70 OO, 40 A, 70 A
RIGID_RATIO = 10.0  # k_h / k_s
HALF_MODULUS_MPA = 2.0  # the modulus at which the ratio is half-way between 1 and RIGID_RATIO
PRESS_PF = 0.25  # change of the soft channel
TREMOR = ((4.1, 0.006), (6.7, 0.008), (8.9, 0.012), (10.6, 0.006))  # Hz, share of the press
BASELINE_PF = {"hard": 0.62, "soft": -0.41}
SKEW_S = 0.013
CONVERSION_S = 0.011
NOISE_PF = 40e-6
FIRST_S = 1.5
RISE_S = 0.35
HOLD_S = 6.7
FALL_S = 0.25
CYCLE_S = 8.8


def ratio(modulus: float) -> float:
    """Eq. (2) of the paper, inverted."""
    return (modulus * RIGID_RATIO + HALF_MODULUS_MPA) / (modulus + HALF_MODULUS_MPA)


def press(t: float) -> tuple[float, int]:
    """Change of the soft channel at time t, pF, and which specimen is under the probe."""
    specimen = min(max(int((t - FIRST_S) // CYCLE_S), 0), len(MODULI_MPA) - 1)
    since = t - FIRST_S - specimen * CYCLE_S
    if since < 0 or since > RISE_S + HOLD_S + FALL_S:
        return 0.0, specimen
    rise = min(since / RISE_S, 1.0)
    fall = min((RISE_S + HOLD_S + FALL_S - since) / FALL_S, 1.0)
    held = 0.5 - 0.5 * math.cos(math.pi * min(rise, fall))
    tremor = sum(a * math.sin(2 * math.pi * f * t + f) for f, a in TREMOR)
    return PRESS_PF * held * (1 + tremor), specimen


def code(channel: str, t: float, noise: random.Random) -> int:
    """One conversion that ends at time t."""
    steps = [press(t - CONVERSION_S * (i + 0.5) / 8) for i in range(8)]
    gains = [ratio(MODULI_MPA[s]) if channel == "hard" else 1.0 for _, s in steps]
    change = sum(p * g for (p, _), g in zip(steps, gains, strict=True)) / 8
    return (
        round((BASELINE_PF[channel] + change + noise.gauss(0.0, NOISE_PF)) * 2**24 / 8.192)
        + 0x800000
    )


def lines() -> list[str]:
    """Return the file, line by line."""
    noise = random.Random(20)
    result = ["seq,t_hard_s,t_soft_s,hard_raw,soft_raw,hard_pF,soft_pF,status"]
    for seq in range(int((FIRST_S + CYCLE_S * len(MODULI_MPA)) / (2 * SKEW_S))):
        t_hard = 2 * SKEW_S * seq
        t_soft = t_hard + SKEW_S
        # A conversion is dated at its middle.
        hard = code("hard", t_hard + CONVERSION_S / 2, noise)
        soft = code("soft", t_soft + CONVERSION_S / 2, noise)
        values = ",".join(f"{(raw - 0x800000) * 8.192 / 2**24:.7f}" for raw in (hard, soft))
        result.append(f"{seq},{t_hard:.3f},{t_soft:.3f},{hard},{soft},{values},0")
    return result


def described(rows: bytes) -> str:
    """Return the sidecar of the rows."""
    from palpate.ad7746.registers import SATURATED_PF
    from palpate.recording import sidecar

    device = {
        "name": "simulated probe, tests/data/make_four_specimens.py",
        "full_scale_pF": SATURATED_PF,
    }
    return sidecar.text_of({**sidecar.made(device, rows.count(b"\n") - 1, rows), "versions": {}})


if __name__ == "__main__":
    text = "\n".join(lines()) + "\n"
    sys.stdout.write(described(text.encode()) if sys.argv[1:] == ["--sidecar"] else text)
