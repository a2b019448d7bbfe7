"""`usb:` and `i2c:` over simulated devices: what the driver reads is what a stream gives; temperature and supply beside it."""

from itertools import pairwise
from pathlib import Path

import palpate
import pytest
from kit_bench import CENTRED, Bench
from palpate import Status, Stream
from palpate.ad7746 import registers
from palpate.ad7746.simulator.evalboard import Fault, FaultKind
from palpate.errors import SourceTimeout
from palpate.recording.reading import recorded
from palpate.recording.sidecar import load
from recording_bench import SampleReader


def test_usb(tmp_path: Path) -> None:
    with Bench() as bench:
        bench.another()
        source = palpate.open(
            "usb:1/2", backend=bench.carrier.backend(), clock=bench.carrier.clock, capf=1
        )
        with Stream(source, record=tmp_path / "run.csv") as stream:
            samples = [estimate.sample for _, estimate in zip(range(40), stream, strict=False)]
        codes = {(c.pin, c.code) for c in bench.kit.chip.conversions if not c.lost}
    assert {(1, s.hard_raw) for s in samples} | {(2, s.soft_raw) for s in samples} <= codes
    assert [s.seq for s in samples] == list(range(40))
    assert {s.status for s in samples} == {Status.OK}
    device = source.describe()
    described = recorded(tmp_path / "run.csv").describe()
    # a median of the last conversions
    assert described == device | {"period_s": described["period_s"]}
    assert described["period_s"] == pytest.approx(device["period_s"], rel=0.02)
    assert (device["stamps"], stream.tracker.settings["host_stamps"]) == ("converter", False)
    capdacs = [device["configuration"][name]["capdac"] for name in ("hard", "soft")]
    assert (device["configuration"]["capf"], *capdacs) == (
        1,
        CENTRED.hard.capdac,
        CENTRED.soft.capdac,
    )
    assert (device["device"]["address"], len(bytes.fromhex(device["registers"]))) == (
        2,
        registers.REGISTERS,
    )
    assert stream.counters.errors == stream.counters.reconnects == 0


def test_a_lost_soft_conversion_leaves_the_hard_reading() -> None:
    with Stream("sim:dropouts?seed=1") as stream:
        lost = [estimate.sample for estimate in stream if estimate.sample.status == Status.LOST]
    kept = [sample for sample in lost if sample.hard == sample.hard]
    assert 0 < len(kept) < len(lost)
    assert {sample.soft_raw for sample in lost} == {-1}
    assert all(sample.hard == registers.capacitance_pF(sample.hard_raw) for sample in kept)


def test_a_board_that_cannot_be_begun_is_given_back() -> None:
    with Bench() as bench:
        source = palpate.open("usb:", backend=bench.carrier.backend(), clock=bench.carrier.clock)
        bench.kit.faults.append(Fault(FaultKind.NO_ANSWER, times=1000))
        with pytest.raises(SourceTimeout), source:
            pytest.fail("it has begun")
        bench.kit.faults.clear()
        with palpate.open(
            "usb:", backend=bench.carrier.backend(), clock=bench.carrier.clock
        ) as again:
            assert next(SampleReader(again)).status == Status.OK


def conditions(path: Path, source: str) -> tuple[list[dict[str, float]], palpate.Stream, float]:
    with palpate.Stream(source, record=path) as stream:
        for estimate in stream:
            last = estimate
    return (load(path) or {})["conditions"], stream, last.sample.t_soft_ns / 1e9


@pytest.mark.parametrize(("capf", "steps"), [(0, 0), (4, 3)])
def test_they_are_in_the_recording_and_make_no_pair_late(
    tmp_path: Path, capf: int, steps: int
) -> None:
    """At the begin and the end; every 10 s where the period leaves time for it."""
    found, stream, end_s = conditions(
        tmp_path / "run.csv", f"sim:four-specimens?seed=1&capf={capf}"
    )
    times = [each["t_s"] for each in found]
    assert len(times) == 2 + steps
    assert times[0] < 3.0
    assert 0 <= times[-1] - end_s < 0.2
    assert all(9.9 < b - a < 10.5 for a, b in pairwise(times[:-1]))
    assert {each["temperature_C"] for each in found} == {25.0}
    assert [each["supply_V"] for each in found] == pytest.approx([3.3] * len(found), abs=0.001)
    assert (stream.counters.late, stream.counters.lost) == (0, 0)


def test_a_chip_that_cannot_be_read_has_none(tmp_path: Path) -> None:
    """The board is unplugged before the end: the error of the source counts, not the error of the temperature."""
    with pytest.raises(palpate.errors.DeviceNotFound):
        conditions(tmp_path / "run.csv", "sim:four-specimens?seed=1&replug=1&fault=unplug:inf@5")
    assert [each["temperature_C"] for each in (load(tmp_path / "run.csv") or {})["conditions"]] == [
        25.0
    ]
