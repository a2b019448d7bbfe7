"""`iio:` over a model of the kernel's driver: range, scale, period, excitation, and what another program changes."""

import errno
import itertools
from pathlib import Path
from typing import Any

import palpate
import pytest
from iio_kernel import LAST_OFFSET, Kernel
from palpate import DeviceNotFound, DeviceRefused, ProtocolError, Sample, Source, Status, Stream
from palpate.ad7746 import datasheet
from palpate.sources import iio, sysfs

IDLE = (6.9, 4.7)
"""Of the paper's probe, pF: out of the range of a CAPDAC at 0."""


def opened(kernel: Kernel, **options: Any) -> tuple[Source, list[str]]:
    """Open the source; return the list that its messages go to."""
    source = palpate.open(f"iio:{kernel.folder}", clock_ns=kernel.clock_ns, **options)
    said: list[str] = []
    source.notify = said.append
    return source, said


def pairs(source: Source, count: int) -> list[Sample]:
    return list(itertools.islice(source, count))


def test_a_range_at_0_is_told_with_the_line_that_moves_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    kernel = Kernel(tmp_path, IDLE).install(monkeypatch)
    with opened(kernel)[0] as source:
        said: list[str] = []
        source.notify = said.append
        samples = pairs(source, 20)
        assert {sample.status for sample in samples} == {Status.HARD_SATURATED | Status.SOFT_SATURATED}
        assert len(said) == 2
        for message, channel in zip(said, (0, 1), strict=True):
            line = f"sudo sh -c 'echo 13884486 > {tmp_path}/in_capacitance{channel}_offset'"
            assert line in message
            assert "its CAPDAC is at 0 steps" in message
        for channel in (0, 1):
            kernel.write(tmp_path / f"in_capacitance{channel}_offset", "13884486")
        [moved, after] = pairs(source, 2)
        assert (moved.status, after.status) == (Status.LOST, Status.OK)


@pytest.mark.parametrize("idle", [(6.9, 4.7), (0.0, 16.0), (3.0, 12.0)])
@pytest.mark.parametrize("step", [0.8, 1.0, 1.2])
def test_centre(idle: tuple[float, float], step: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    kernel = Kernel(tmp_path, idle, step_pF=datasheet.DAC_STEP_PF * step).install(monkeypatch)
    kernel.capdac = [100, 3]
    source, said = opened(kernel, centre="yes")
    with source:
        [sample, *_] = pairs(source, 3)
        described = source.describe()
    assert (said, sample.status) == ([], Status.OK)
    assert max(abs(sample.hard), abs(sample.soft)) < 1.0
    assert described["capdac"] == {"hard": kernel.capdac[0], "soft": kernel.capdac[1]}


def test_a_sensor_beyond_the_capdac(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    kernel = Kernel(tmp_path, (30.0, 1.0)).install(monkeypatch)
    source, said = opened(kernel, centre=True)
    with source:
        [sample] = pairs(source, 1)
    assert sample.status == Status.HARD_SATURATED
    assert kernel.capdac[0] == sysfs.LAST_STEP == LAST_OFFSET // sysfs.CODES_PER_STEP
    assert ["hard: CIN1 is above the range" in message for message in said] == [True]


def test_centre_without_permission(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    kernel = Kernel(tmp_path, IDLE, root=False).install(monkeypatch)
    with pytest.raises(DeviceRefused, match=r"offset: no permission to write it: run palpate as root, or `sudo chmod"):
        opened(kernel, centre="1")[0].__enter__()


@pytest.mark.parametrize(
    ("hz", "capf", "period_ms"), [(1000, 0, 29.4), (250, 0, 34.0), (100, 0, 60.0), (1000, 7, 227.4)]
)
def test_the_period_is_the_real_one(
    hz: int, capf: int, period_ms: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    kernel = Kernel(tmp_path, hz=hz).install(monkeypatch)
    kernel.capf = capf
    with Stream(opened(kernel)[0]) as stream:
        samples = [estimate.sample for estimate in itertools.islice(stream, 30)]
        described = stream.source.describe()["period_s"]
        counters = stream.counters
    real = (samples[-1].t_hard_ns - samples[0].t_hard_ns) / (samples[-1].seq - samples[0].seq) / 1e9
    assert described == pytest.approx(real, rel=0.05)
    assert described == pytest.approx(period_ms / 1e3, rel=0.1)
    assert counters.lost == counters.late == 0


@pytest.mark.parametrize(("hz", "most_us"), [(1000, 4_000), (300, 8_000), (250, 8_000), (100, 20_000)])
def test_times_and_their_uncertainty(hz: int, most_us: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    kernel = Kernel(tmp_path, hz=hz).install(monkeypatch)
    source, _ = opened(kernel)
    with source:
        begun = len(kernel.conversions)
        zero = kernel.now_ns
        samples, read = iter(source), []
        for number in range(40):
            if number == 20:
                kernel.now_ns += 77_777_777  # the host stalls between two pairs: the tick's phase is another one
            read.append(next(samples))
    for number, sample in enumerate(read):
        (_, hard, _), (_, soft, _) = kernel.conversions[begun + 2 * number : begun + 2 * number + 2]
        wrong_ns = (sample.t_soft_ns - sample.t_hard_ns) - (soft - hard)
        assert abs(wrong_ns) <= 1000 * sample.t_uncertainty_us <= 1000 * most_us
        assert abs(wrong_ns) < 100_000
        assert abs(sample.t_hard_ns - (hard - zero)) < 1_500_000


@pytest.mark.parametrize("stall_ms", [3, 30])
def test_a_stall_in_a_read(stall_ms: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    kernel = Kernel(tmp_path).install(monkeypatch)
    source, _ = opened(kernel)
    convert = kernel.convert

    def late(channel: int) -> int:
        kernel.now_ns += stall_ms * 1_000_000 * channel  # another program holds the driver's lock
        return convert(channel)

    with source:
        samples = iter(source)
        assert next(samples).status == Status.OK
        monkeypatch.setattr(kernel, "convert", late)
        during = next(samples)
        monkeypatch.setattr(kernel, "convert", convert)
        assert next(samples).status == Status.OK
    (_, hard, _), (_, soft, _) = kernel.conversions[-4:-2]
    if stall_ms == 30:
        assert (during.status, source.counters) == (Status.LOST, {"errors": 1})
    else:
        wrong_us = abs((during.t_soft_ns - during.t_hard_ns) - (soft - hard)) / 1000
        assert 2_500 < wrong_us <= during.t_uncertainty_us


def test_a_conversion_time_that_another_program_sets(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    kernel = Kernel(tmp_path).install(monkeypatch)
    source, _ = opened(kernel)
    with source:
        samples = iter(source)
        next(samples)
        kernel.capf = 4
        with pytest.raises(ProtocolError, match=r"lasted 6\d ms, allowed: 2\d ms: another program uses the driver, or"):
            list(samples)


@pytest.mark.parametrize("scale", ["0.000000977", "0.000488", "1", "later", "nan", ""])
def test_another_scale_is_refused(scale: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    kernel = Kernel(tmp_path).install(monkeypatch)
    kernel.scale = scale
    with pytest.raises(ProtocolError, match=r"in_capacitance_scale: got '.*', allowed: 0.000000488"):
        opened(kernel)


@pytest.mark.parametrize("scale", ["0.000000488", "4.8828125e-07", "0.000000000488"])
def test_the_scale_in_pF_and_in_nF(scale: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    kernel = Kernel(tmp_path, (2.0, 1.0)).install(monkeypatch)
    kernel.scale = scale
    with opened(kernel)[0] as source:
        [sample] = pairs(source, 1)
        assert source.describe()["scale"] == scale
    assert sample.hard == pytest.approx(2.0, abs=1e-3)
    assert sample.hard == datasheet.capacitance_pF(sample.hard_raw)


def test_an_offset_that_is_moved_is_a_gap(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    kernel = Kernel(tmp_path).install(monkeypatch)
    source, said = opened(kernel)
    with source:
        samples = iter(source)
        assert [next(samples).status for _ in range(5)] == [Status.OK] * 5
        assert list(source.gaps) == []
        kernel.write(tmp_path / "in_capacitance1_offset", str(3 * 338646 + 5))
        moved, after = next(samples), next(samples)
        [gap] = source.gaps
    assert (gap.seq, moved.seq, moved.status, after.status) == (5, 5, Status.LOST, Status.OK)
    assert "the CAPDACs were moved from [0, 0] to [0, 3] steps" in gap.text
    assert [message.startswith(gap.text) for message in said] == [True]


@pytest.mark.parametrize("root", [True, False])
def test_the_range_is_set_again(root: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    kernel = Kernel(tmp_path, root=root).install(monkeypatch)
    source, said = opened(kernel)
    assert isinstance(source, iio.IioSource)
    with source:
        samples = iter(source)
        next(samples)
        kernel.picofarads = IDLE
        assert next(samples).status == Status(3)
        source.centre()
        moved, after = next(samples), next(samples)
    if root:
        assert (moved.status, after.status, [gap.seq for gap in source.gaps]) == (Status.LOST, Status.OK, [2])
    else:
        assert (moved.status, after.status, source.gaps) == (Status(3), Status(3), ())
        assert "no permission to write it: run palpate as root" in said[0]


@pytest.mark.parametrize("capf", [0, 7])
def test_no_excitation_is_said_in_words(capf: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    kernel = Kernel(tmp_path, IDLE, pins="").install(monkeypatch)
    kernel.capf = capf
    source, said = opened(kernel)
    with source:
        pairs(source, 30)
    properties = "adi,exca-output-en; or adi,excb-output-en;"
    assert [properties in message for message in said] == [True] * 3
    assert said[0].startswith(f"{tmp_path}: no excitation")
    assert said[1].startswith("hard: CIN1 gives exactly 0 pF, 8 times in a row")
    assert kernel.now_ns - 10**12 < 8e9


@pytest.mark.parametrize("capf", range(8))
def test_a_quiet_sensor_is_not_flat(capf: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    kernel = Kernel(tmp_path).install(monkeypatch)
    kernel.capf = capf
    source, said = opened(kernel)
    with source:
        pairs(source, 500)
        assert source.describe()["excitation"] == "B"
    assert said == []


def test_a_device_that_fails_while_its_period_is_measured(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    kernel = Kernel(tmp_path).install(monkeypatch)
    source, _ = opened(kernel)
    kernel.failures["in_capacitance1_raw"] = errno.EREMOTEIO
    with source, pytest.raises(ProtocolError, match="Remote I/O error"):
        pairs(source, 10)
    assert source.counters == {"errors": iio.STREAK}
    kernel.failures["in_capacitance1_raw"] = errno.ENODEV
    with pytest.raises(DeviceNotFound), source:
        pytest.fail("it has begun")


def test_an_interruption_ends_within_a_conversion(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    kernel = Kernel(tmp_path).install(monkeypatch)
    source, _ = opened(kernel)
    with source:
        samples = iter(source)
        next(samples)
        read = kernel.read
        count = len(kernel.conversions)

        def interrupting(path: Path, most: int) -> bytes:
            source.interrupt()
            return read(path, most)

        monkeypatch.setattr(sysfs, "read_bytes", interrupting)
        assert list(samples) == []
    assert len(kernel.conversions) == count + 1
