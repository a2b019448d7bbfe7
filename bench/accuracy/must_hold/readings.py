"""Faults of the readings: lost conversions, and time stamps of the host."""

from collections.abc import Iterator

from palpate.simulation.converter import Converter, Stamps
from palpate.simulation.faults import Faults

from bench.accuracy.must_hold.physics import flags, results
from bench.accuracy.must_hold.presses import held, rms_row
from bench.accuracy.must_hold.row import Row


def rows(seeds: int) -> Iterator[Row]:
    """Return the rows of this theme."""
    scenes = {
        "10 % of the conversions lost": (held(faults=Faults(lost=0.1)), 0.010),
        "30 % of the conversions lost, in runs of 8": (held(faults=Faults(lost=0.3, lost_run=8.0)), 0.03),
        "host stamps of +-3 ms at 8 % tremor": (
            held(0.08, converter=Converter(jitter_s=0.0), stamps=Stamps(host_s=0.003)),
            0.015,
        ),
    }
    for name, (scene, limit) in scenes.items():
        found = results(scene, seeds)
        yield rms_row(name, found, limit, beside=f"flags: {flags(found)}")
