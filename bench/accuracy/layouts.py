"""Error of the ratio on a probe that is held at an angle, for one soft bump and for one split around the hard bump.

    python -m bench.accuracy.layouts [--seeds 40] [--out bench/results]

Each touch is on an object with a random ratio (1.3 to 7.5), pressed with 1 pF in both channels together, at an angle of either
sign that trembles by 0.03 degrees. Prints the rms error at each angle: of the ratio, and of the level ratio if this
version has it, of the touches that have one. Writes the table and a picture; needs the extra science.
"""

import argparse
import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import palpate
from palpate.display.plots import HANDHELD, PAGE_IN, PAPER, written
from palpate.simulation import Press, Scenario, Substrate, simulate

from bench.results_age import RESULTS, about

TREMOR_DEG = 0.03  # as in bench/accuracy/reliability.py
ANGLES_DEG = (0.0, 0.25, 0.5, 1.0, 2.0, 3.0)
_SPLIT = Substrate(layout="soft-hard-soft")
PROBES = {
    "hard-soft": Substrate(),
    "hard-soft, domes": Substrate(exponent=1.5),
    "soft-hard-soft": _SPLIT,
    "soft-hard-soft, domes": replace(_SPLIT, exponent=1.5),
    "hard bump misplaced by 5 %": replace(_SPLIT, misplaced=0.05),
    "halves unequal by 5 %": replace(_SPLIT, unequal=0.05),
    "all three": replace(_SPLIT, exponent=1.5, misplaced=0.05, unequal=-0.05),
    "pressed with 0.2 pF": _SPLIT,
}
PRESS_PF = {"pressed with 0.2 pF": 0.2}  # else 1
RATIOS = ("ratio", "level_ratio") if hasattr(palpate.Touch, "level_ratio") else ("ratio",)
Errors = dict[str, dict[str, list[float]]]


def sign(seed: int) -> int:
    """Return the sign of the angle: 1 or -1."""
    return 1 if seed % 2 else -1


def touched(probe: str, angle_deg: float, seed: int) -> tuple[palpate.Touch, float]:
    """Simulate one touch; return it, and the true ratio."""
    random = np.random.default_rng([seed, 7])
    ratio = math.exp(random.uniform(math.log(1.3), math.log(7.5)))
    press = Press(
        1.5,
        [(0.0, ratio)],
        depth_pF=PRESS_PF.get(probe, 1.0) / (1 + ratio),
        tilt_deg=(sign(seed) * angle_deg, 0.0),
    )
    substrate = replace(PROBES[probe], tremor_deg=TREMOR_DEG)
    run = simulate(
        Scenario(presses=[press], duration_s=10.0, tremor=0.02, substrate=substrate), seed=seed
    )
    settings: Any = {"contact_exponent": substrate.exponent} if "level_ratio" in RATIOS else {}
    return palpate.touches(run, **settings)[0], ratio


def measure(seeds: int) -> Errors:
    """Return the rms error at each angle, %, by kind of ratio and probe."""
    found: Errors = {kind: {} for kind in RATIOS}
    for probe in PROBES:
        touches = [
            [touched(probe, angle_deg, seed) for seed in range(seeds)] for angle_deg in ANGLES_DEG
        ]
        for kind in RATIOS:
            errors = [
                [getattr(touch, kind) / truth - 1 for touch, truth in some] for some in touches
            ]
            found[kind][probe] = [
                100 * rms([e for e in some if not math.isnan(e)]) for some in errors
            ]
    return found


def rms(errors: list[float]) -> float:
    """Return the root mean square; nan without an error."""
    return math.sqrt(sum(e * e for e in errors) / len(errors)) if errors else math.nan


def table(found: Errors) -> str:
    """Return the errors as text."""
    lines = []
    for kind, by_probe in found.items():
        title = f"{kind.replace('_', ' ')}: rms error, %"
        lines.append(f"{title:30}" + "".join(f"{angle:>6g} deg" for angle in ANGLES_DEG))
        lines += [
            f"{probe:30}" + "".join(f"{e:10.2g}" for e in row) for probe, row in by_probe.items()
        ]
    return "\n".join(lines)


def draw(found: Errors, path: Path) -> None:
    """Draw the errors of both layouts over the angle."""
    with written(path, PAGE_IN, 3.2) as figure:
        for ax, ending, title in zip(
            figure.subplots(1, 2, sharey=True), ("", ", domes"), ("flat", "domes"), strict=True
        ):
            for kind, by_probe in found.items():
                for layout, colour in (("hard-soft", PAPER), ("soft-hard-soft", HANDHELD)):
                    look: Any = (
                        {"marker": "o"}
                        if kind == "ratio"
                        else {"marker": "s", "mfc": "none", "ls": "--"}
                    )
                    label = f"{layout}, {kind.replace('_', ' ')}"
                    ax.semilogy(
                        ANGLES_DEG, by_probe[layout + ending], color=colour, label=label, **look
                    )
            ax.set_title(f"bumps: {title}")
            ax.set_xlabel("angle of the probe in the plane of the bumps, degrees")
        ax.legend()
        figure.axes[0].set_ylabel("error of the ratio, rms, %")


def main() -> None:
    """Run, print, write."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--seeds", type=int, default=40, help="touches at each angle")
    parser.add_argument(
        "--out", type=Path, default=RESULTS, help="folder for the table and the picture"
    )
    options = parser.parse_args()
    found = measure(options.seeds)
    print(table(found))
    document = about() | {"seeds": options.seeds, "table": table(found).split("\n")}
    (options.out / "layouts.json").write_text(json.dumps(document, indent=1) + "\n")
    draw(found, options.out / "layouts.png")


if __name__ == "__main__":
    main()
