"""Steps with the driver: pairs a second, losses, uncertainty of the times."""

from collections.abc import Iterator
from dataclasses import asdict
from itertools import islice

from palpate.kit.bench import Bench
from palpate.kit.step import Step, judged, left_out
from palpate.samples import Sample, Status

_PAIRS = 60
_RATE = 0.05  # relative difference of the measured and the described period
_MOST_US = 2000


def pairs(bench: Bench) -> Iterator[Step]:
    """Read pairs as a measurement does."""
    with_driver = islice(bench.source, _PAIRS + 1)  # it centres the CAPDACs first
    found = list(with_driver)
    if len(found) < 2:
        yield left_out("pairs a second", "the source ended")
        return
    described = float(bench.source.describe()["period_s"])
    period = (found[-1].t_hard_ns - found[0].t_hard_ns) / 1e9 / (found[-1].seq - found[0].seq)
    yield judged(
        "pairs a second",
        f"{1 / period:.1f}",
        f"{1 / described:.1f}, as described",
        right=abs(period / described - 1) <= _RATE,
        do=["run this again without other programs, and without a hub"],
        values={"pairs_per_s": round(1 / period, 3), "described_per_s": round(1 / described, 3)},
    )
    yield _losses(bench)
    yield from _quality(found)


def _losses(bench: Bench) -> Step:
    counted = asdict(bench.source.driver.counters)
    direct = bench.chip.counters
    lost, errors = counted["lost"] + direct.lost, counted["errors"] + direct.errors
    return judged(
        "losses",
        f"{counted['pairs']} pairs read; lost: {lost}, failed accesses: {errors}",
        "none lost, none failed",
        right=not (lost or errors),
        do=["use another cable, or another USB port without a hub"]
        if errors
        else ["the computer was too busy: run this again without other programs"],
        values={"pairs": counted["pairs"], "lost": lost, "errors": errors},
    )


def _quality(found: list[Sample]) -> Iterator[Step]:
    bad = sum(sample.status != Status.OK for sample in found)
    yield judged(
        "status of the pairs",
        f"{len(found) - bad} of {len(found)} OK",
        "all OK",
        right=not bad,
        do=["lost: see the losses; saturated or shorted: see the inputs, and keep the probe in the air"],
        values={"not_ok": bad},
    )
    known = [sample.t_uncertainty_us for sample in found if sample.t_uncertainty_us >= 0]
    if not known:
        yield left_out("uncertainty of the times", "unknown")
        return
    yield judged(
        "uncertainty of the times",
        f"up to {max(known) / 1000:.2f} ms between the two readings of a pair",
        f"up to {_MOST_US / 1000:g} ms",
        right=max(known) <= _MOST_US,
        do=["run this again without other programs"],
        values={"t_uncertainty_us": max(known)},
    )
