"""Steps with the driver: pairs a second, losses, uncertainty of the times."""

from collections.abc import Iterator
from dataclasses import asdict
from itertools import islice

from palpate.ad7746.configuration import HARD, SOFT
from palpate.ad7746.inputs import Look
from palpate.errors import SourceError
from palpate.kit.bench import Bench
from palpate.kit.step import Step, judged, left_out, one_line
from palpate.samples import Sample, Status

_PAIRS = 60
_RATE = 0.05  # relative difference of the measured and the described period
_MOST_US = 2000
_OF_CHANNEL = (Status.HARD_SATURATED | Status.EXCITATION, Status.SOFT_SATURATED | Status.EXCITATION)
_OF_INPUTS = _OF_CHANNEL[HARD] | _OF_CHANNEL[SOFT]


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
    yield from _quality(bench, found)


def _losses(bench: Bench) -> Step:
    counted = asdict(bench.source.driver.counters)
    direct = bench.chip.counters
    lost, errors = counted["lost"] + direct.lost, counted["errors"] + direct.errors
    unplugged = counted["reconnects"]
    do = "use another cable, or another USB port without a hub"
    if unplugged:
        do = f"the board was unplugged and came back: keep cable and plug still; if nobody pulled it, {do}"
    elif not errors:
        do = "no access failed: the computer was too busy: run this again without other programs"
    return judged(
        "losses",
        f"{counted['pairs']} pairs read; lost: {lost}, failed accesses: {errors}"
        + (f", unplugged: {unplugged} times" if unplugged else ""),
        "none lost, none failed",
        right=not (lost or errors),
        do=[do],
        values={"pairs": counted["pairs"], "lost": lost, "errors": errors, "reconnects": unplugged},
    )


def _changed(bench: Bench, found: list[Sample]) -> list[str]:
    """Return why pairs are not OK: the inputs are measured again, because they were right before."""
    status = Status.OK
    for sample in found:
        status |= sample.status
    do = ["lost: see the losses"] if status & Status.LOST else []
    if not status & _OF_INPUTS:
        return do
    try:
        return do + [_now(bench, channel) for channel in (HARD, SOFT) if status & _OF_CHANNEL[channel]]
    except SourceError as error:
        return [*do, f"the inputs cannot be measured again: {one_line(error)}"]


def _now(bench: Bench, channel: int) -> str:
    pin = bench.pin(channel)
    name = bench.configuration.channel(channel).excitation
    level = bench.chip.level(pin, name, bench.configuration)
    where = f"CIN{pin}+ and EXC{' and EXC'.join(name)}"
    if level.error:
        return f"{where}: an excitation pin was shorted after the inputs were measured: look at the wire and the plug"
    if Look(level.total_pF).is_empty:
        return f"{where}: a wire came off after the inputs were measured ({level} now): look at both wires"
    return f"{where}: the capacitance left the range ({level} now): keep the probe still in the air, and run this again"


def _quality(bench: Bench, found: list[Sample]) -> Iterator[Step]:
    bad = sum(sample.status != Status.OK for sample in found)
    yield judged(
        "status of the pairs",
        f"{len(found) - bad} of {len(found)} OK",
        "all OK",
        right=not bad,
        do=_changed(bench, found) if bad else (),
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
