"""Stiff and extreme cases: errors of each estimator in eps, and results of other libraries for comparison.

    python -m bench.accuracy.stability [--samples 1000000000] [--seeds 500]

Prints the tables. Needs a C++ compiler; uses padasip, river and filterpy if they are installed. For the paper's form as
printed and for another library the table has the distance of the last ratio from the exact one, per cent, or how it
failed. The libraries have the forgetting factor, initial ratio and initial covariance of each case; they have no
detector, and are compared with exact least squares of a fixed forgetting factor.
"""

import argparse
import json
import subprocess
import tempfile
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import palpate

from bench.accuracy.as_printed import after_a_step, as_set, distance, exact_ratio, printed
from bench.accuracy.coverage import coverage_table
from bench.accuracy.extremes import ending, exact_cases, long_idle, outcome, powers, press
from bench.accuracy.near_rigid import near_rigid_table
from bench.peers import PEERS

HERE = Path(__file__).parent

ESTIMATORS = (
    palpate.Rls,
    palpate.Rls32,
    palpate.AdaptiveRls,
    palpate.AdaptiveRls32,
    palpate.HandoverRls,
    palpate.HandoverRls32,
)


def case_table() -> Iterator[str]:
    """Print each case: palpate in float64 and float32, then the paper's equations as printed and the other libraries."""
    rivals = {name: PEERS[name] for name in PEERS if find_spec(name)}
    heads = "".join(f"{name:>13}" for name in ("printed", "printed, 32", *rivals))
    yield f"{'case':32} {'float64: ratio':>14} {'covar.':>7} {'float32: ratio':>15} {'covar.':>7}  {'ends':10}{heads}"
    for case, single in zip(exact_cases(np.float64), exact_cases(np.float32), strict=True):
        double = outcome(np.float64, palpate.AdaptiveRls, case)
        narrow = outcome(np.float32, palpate.AdaptiveRls32, single)
        switched, fixed = exact_ratio(case), exact_ratio(case, detector=False)
        # The largest and smallest numbers are those of the type.
        of_single = switched if np.array_equal(case.output, single.output) else exact_ratio(single)
        cells = [
            distance(switched, printed, case, np.float64),
            distance(of_single, printed, single, np.float32),
            *(distance(fixed, as_set, peer, case) for peer in rivals.values()),
        ]
        ends = double.ends if double.ends == narrow.ends else f"{double.ends}/{narrow.ends}"
        yield (
            f"{case.name:32} {double.ratio_eps:14.2g} {double.covariance_eps:7.2g} {narrow.ratio_eps:15.2g} "
            f"{narrow.covariance_eps:7.2g}  {ends:10}{''.join(f'{cell:>13}' for cell in cells)}"
        )


def printed_covariance() -> Iterator[str]:
    """Print what becomes of the covariance in the form that the paper prints, by its initial value."""
    yield "the paper's form as printed, P0 in 1/pF^2: P after one sample, and the ratio 300 samples after a step from 2.5 to 3"
    yield f"  {'P0':>6}" + "".join(f"{name:>24}" for name in ("float64", "float32", "AdaptiveRls32"))
    for power in range(2, 21, 2):
        cells = (after_a_step(10.0**power, kind) for kind in (np.float64, np.float32, palpate.AdaptiveRls32))
        yield f"  {10.0**power:6.0e}" + "".join(f"{first:12.3g} {ratio:11.6g}" for first, ratio in cells)


def ranges() -> Iterator[str]:
    """Print the sizes of the regressor with which each estimator is right."""
    yield "range of each estimator: a held press, ratio 2.5, default settings; |regressor|, pF, by powers of ten"
    yield f"  {'':14} {'right from':>11} {'to':>7} {'refused from':>13}   below the first the initial ratio has weight"
    for kind in ESTIMATORS:
        ends = {0.25 * 10.0**power: ending(kind, 10.0**power) for power in powers(kind)}
        right = [size for size, end in ends.items() if end == "right"]
        refused = [size for size, end in ends.items() if end == "refused"]
        assert "wrong" not in ends.values()
        yield f"  {kind.__name__:14} {min(right):11.1e} {max(right):7.0e} {min(refused):13.1e}"


def no_excitation() -> Iterator[str]:
    """Print the state of each estimator after a million samples with regressor 0."""
    case = long_idle()
    yield "after a press and 1e6 samples of regressor 0, lambda 0.9: ratio kept, covariance, ratio 20 samples into the next"
    output, regressor = press(20, 4.0)
    for kind in ESTIMATORS:
        names = {"forgetting", "steady", "alarmed"} & set(kind().settings)
        estimator = kind(**dict.fromkeys(names, 0.9))
        before = estimator.process(case.output[:100], case.regressor[:100])[-1]
        estimator.process(case.output[100:], case.regressor[100:])
        kept = "kept" if estimator.ratio == before else f"{estimator.ratio:.6g}, was {before:.6g}"
        covariance = estimator.covariance
        after = estimator.process(output, regressor)[-1]
        yield f"  {kind.__name__:14} {kept:6} {covariance:10.3g} {after:10.6g}"


def noise_only(size: int) -> Iterator[str]:
    """Print the state after noise only: required are no endless alarm and no diverging ratio."""
    rng = np.random.default_rng(5)
    yield f"noise of 4e-5 pF in both channels for {size:.0e} samples: largest |ratio|, alarm share, refused"
    output, regressor = 4e-5 * rng.standard_normal((2, size))
    for kind in ESTIMATORS:
        estimator, largest, alarms = kind(), 0.0, 0
        for first in range(0, size, 100_000):
            rows = estimator.trace(output[first : first + 100_000], regressor[first : first + 100_000])
            largest = max(largest, float(np.abs(rows["ratio"]).max()))
            alarms += int(np.count_nonzero(rows["alarm"]))
        yield f"  {kind.__name__:14} {largest:9.3g} {100 * alarms / size:8.3g} % {estimator.rejected}"


def long_run(samples: int) -> Iterator[str]:
    """Print the result of lambda = 1 for a very long time."""
    with tempfile.TemporaryDirectory() as folder:
        program = Path(folder) / "long_run"
        flags = ["-O2", "-std=c++17", "-ffp-contract=off", f"-I{palpate.get_include()}"]
        subprocess.run(["c++", *flags, str(HERE / "long_run.cpp"), "-o", str(program)], check=True)
        found = json.loads(subprocess.run([program, str(samples)], check=True, capture_output=True).stdout)
    yield f"lambda = 1 for {found.pop('samples'):.0e} samples, ratio 2, from half-way 3 (least squares: 2.5)"
    for name, values in found.items():
        share = values["information"] / values["exact information"]
        yield f"  {name:28} {values['half']:.7g}  {values['ratio']:.7g}  information / exact {share:.4g}"
    yield "  float: the information stops growing at 2^24 times the square of a regressor: keep a memory, 1 / (1 - lambda)"
    yield "  samples, below 1e6, or take double; compensated sums would do, at twice the state and 2.5 times the time"


def main() -> None:
    """Print all tables."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--samples", type=int, default=1_000_000_000, help="of the long run")
    parser.add_argument("--seeds", type=int, default=500, help="of each coverage")
    options = parser.parse_args()
    print("largest error on the way, eps; and what the others end with")
    for part in (
        case_table(),
        printed_covariance(),
        ranges(),
        coverage_table(options.seeds),
        near_rigid_table(),
        no_excitation(),
        noise_only(min(options.samples, 10_000_000)),
        long_run(options.samples),
    ):
        print(*part, "", sep="\n")


if __name__ == "__main__":
    main()
