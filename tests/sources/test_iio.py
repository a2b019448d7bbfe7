"""`iio:` over a model of the kernel's driver: range, scale, period, excitation, and what another program changes."""

import errno
import itertools
from collections.abc import Callable
from pathlib import Path
from typing import Any

import palpate
import pytest
from iio_kernel import Kernel
from palpate import Sample, Source, Status, Stream
from palpate.ad7746 import registers
from palpate.errors import DeviceNotFound, DeviceRefused, ProtocolError
from palpate.sources import iio
from recording_bench import SampleReader

IDLE = (6.9, 4.7)
"""Of the paper's probe, pF: out of the range of a CAPDAC at 0."""
BOTH = Status.HARD_SATURATED | Status.SOFT_SATURATED


@pytest.fixture
def install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Kernel]:
    """Return a function that puts a kernel's driver in place of the files; its keywords are those of `Kernel`."""
    return lambda *given, **settings: Kernel(tmp_path, *given, **settings).install(monkeypatch)


def opened(kernel: Kernel, **options: Any) -> tuple[Source, list[str]]:
    """Open the source; return the list that its messages go to."""
    source, said = (
        palpate.open(f"iio:{kernel.folder}", clock_ns=kernel.clock_ns, **options),
        list[str](),
    )
    source.notify = said.append
    return source, said


def read(kernel: Kernel, count: int, **options: Any) -> tuple[list[Sample], list[str], Source]:
    """Read pairs; return them, the messages, and the source."""
    source, said = opened(kernel, **options)
    with source:
        return list(itertools.islice(SampleReader(source), count)), said, source


def test_a_signal_beyond_the_range(install: Callable[..., Kernel]) -> None:
    out = "its CAPDAC is at 0 steps: as root, iio:{0}?centre=yes moves it"
    for idle, options, status, parts in (
        (IDLE, {}, BOTH, [out] * 2),
        ((30.0, 1.0), {"centre": True}, Status.HARD_SATURATED, ["hard: CIN1 is above the range"]),
    ):
        kernel = install(idle)
        samples, said, _ = read(kernel, 20, **options)
        assert {sample.status for sample in samples} == {status}
        assert all(
            part.format(kernel.folder) in text for part, text in zip(parts, said, strict=True)
        )
        assert kernel.capdac[0] == (iio.LAST_STEP if options else 0)


@pytest.mark.parametrize("idle", [IDLE, (0.0, 16.0), (3.0, 12.0)])
@pytest.mark.parametrize("step", [0.8, 1.0, 1.2])
def test_centre(install: Callable[..., Kernel], idle: tuple[float, float], step: float) -> None:
    kernel = install(idle, step_pF=registers.DAC_STEP_PF * step)
    kernel.capdac = [100, 3]
    [sample], said, source = read(kernel, 1, centre="yes")
    assert source.describe()["capdac"] == {"hard": kernel.capdac[0], "soft": kernel.capdac[1]}
    assert (said, sample.status) == ([], Status.OK)
    assert max(abs(sample.hard), abs(sample.soft)) < 1.0
    with pytest.raises(DeviceRefused, match=r"offset: no permission: run palpate as root"):
        read(install(idle, root=False), 1, centre="1")


@pytest.mark.parametrize(
    ("hz", "capf", "period_ms"), [(1000, 0, 29.4), (250, 0, 34.0), (100, 0, 60.0), (1000, 7, 227.4)]
)
def test_the_period_is_the_real_one(
    install: Callable[..., Kernel], hz: int, capf: int, period_ms: float
) -> None:
    kernel = install(hz=hz)
    kernel.capf = capf
    with Stream(opened(kernel)[0]) as stream:
        samples = [estimate.sample for estimate in itertools.islice(stream, 30)]
        described = stream.source.describe()["period_s"]
        counters = stream.counters
    real = (samples[-1].t_hard_ns - samples[0].t_hard_ns) / (samples[-1].seq - samples[0].seq) / 1e9
    assert described == pytest.approx(real, rel=0.05)
    assert described == pytest.approx(period_ms / 1e3, rel=0.1)
    assert counters.lost == counters.late == 0


@pytest.mark.parametrize(("hz", "most_us"), [(1000, 4_000), (300, 8_000), (100, 20_000)])
def test_times_and_their_uncertainty(install: Callable[..., Kernel], hz: int, most_us: int) -> None:
    kernel = install(hz=hz)
    with opened(kernel)[0] as source:
        begun, zero, samples = len(kernel.conversions), kernel.now_ns, SampleReader(source)
        found = [next(samples) for _ in range(20)]
        kernel.now_ns += (
            77_777_777  # the host stalls between two pairs: the tick's phase is another one
        )
        found += [next(samples) for _ in range(20)]
    made = [middle for _, middle, _ in kernel.conversions[begun:]]
    for sample, hard, soft in zip(found, made[::2], made[1::2], strict=True):
        wrong_ns = (sample.t_soft_ns - sample.t_hard_ns) - (soft - hard)
        assert abs(wrong_ns) <= 1000 * sample.t_uncertainty_us <= 1000 * most_us
        assert abs(wrong_ns) < 100_000
        assert abs(sample.t_hard_ns - (hard - zero)) < 1_500_000


@pytest.mark.parametrize(("stall_ms", "lost"), [(3, False), (30, True)])
def test_a_stall_in_a_read(install: Callable[..., Kernel], stall_ms: int, lost: bool) -> None:
    kernel = install()
    with opened(kernel)[0] as source:
        samples = SampleReader(source)
        assert next(samples).status == Status.OK
        kernel.stall_ns = stall_ms * 1_000_000  # another program holds the driver's lock
        during = next(samples)
        kernel.stall_ns = 0
        assert next(samples).status == Status.OK
    (_, hard, _), (_, soft, _) = kernel.conversions[-4:-2]
    wrong_us = abs((during.t_soft_ns - during.t_hard_ns) - (soft - hard)) / 1000
    assert (during.status == Status.LOST, source.counters) == (
        lost,
        {"errors": int(lost), "reconnects": 0},
    )
    assert lost or 2_500 < wrong_us <= during.t_uncertainty_us


@pytest.mark.parametrize("scale", ["0.000000977", "nan", ""])
def test_another_scale_is_refused(install: Callable[..., Kernel], scale: str) -> None:
    kernel = install()
    kernel.scale = scale
    with pytest.raises(
        ProtocolError, match=r"in_capacitance_scale: got '.*', allowed: 4.87793e-07"
    ):
        opened(kernel)


def test_an_offset_that_is_moved_is_a_gap(install: Callable[..., Kernel]) -> None:
    kernel = install()
    source, said = opened(kernel)
    with source:
        samples = SampleReader(source)
        assert {next(samples).status for _ in range(5)} == {Status.OK}
        kernel.write(kernel.folder / "in_capacitance1_offset", str(3 * 338646 + 5))
        moved, after = next(samples), next(samples)
        [(gap_seq, text)] = samples.gaps
    assert (gap_seq, moved.seq, moved.status, after.status) == (5, 5, Status.LOST, Status.OK)
    assert "the CAPDACs were moved from [0, 0] to [0, 3] steps" in text
    assert said == []  # the stream reports each gap


@pytest.mark.parametrize("root", [True, False])
def test_the_range_is_set_again(install: Callable[..., Kernel], root: bool) -> None:
    kernel = install(root=root)
    source, said = opened(kernel)
    with source:
        samples = SampleReader(source)
        next(samples)
        kernel.picofarads = IDLE
        assert next(samples).status == BOTH
        source.centre()
        found = [next(samples).status for _ in range(2)], [seq for seq, _ in samples.gaps]
    assert found == (([Status.LOST, Status.OK], [2]) if root else ([BOTH, BOTH], []))
    assert root or "no permission: run palpate as root" in said[0]


@pytest.mark.parametrize("capf", [0, 7])
def test_no_excitation_is_said_in_words_and_a_quiet_sensor_has_one(
    install: Callable[..., Kernel], capf: int
) -> None:
    for pins, idle, count, messages in (("", IDLE, 30, 2), ("B", (1.0, -1.0), 500, 0)):
        kernel = install(idle, pins=pins)
        kernel.capf = capf
        said = read(kernel, count)[1]
        assert ["adi,exca-output-en; or adi,excb-output-en;" in message for message in said] == [
            True
        ] * messages
        assert not said or said[0].startswith("hard: CIN1 gives exactly 0 pF, 8 times in a row")


def test_a_device_that_fails(install: Callable[..., Kernel]) -> None:
    """Already while its period is measured."""
    kernel = install()
    source, _ = opened(kernel)
    kernel.failures["in_capacitance1_raw"] = errno.EREMOTEIO
    with source:
        samples = SampleReader(source)
        assert [next(samples).status for _ in range(2)] == [Status.LOST] * 2
        with pytest.raises(ProtocolError, match="Remote I/O error"):
            next(samples)
    assert source.counters == {"errors": iio.STREAK, "reconnects": 0}
    for number, error in ((errno.ENODEV, DeviceNotFound), (errno.EACCES, DeviceRefused)):
        kernel.failures["in_capacitance1_raw"] = number
        with pytest.raises(error), source:
            pytest.fail("it has begun")


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """Make a kernel's folder of a device, and one of another."""
    files: dict[str, object] = {"iio:device0/name": "bme280", "iio:device1/name": "ad7746"}
    channels = {"0_raw": -1234, "1_raw": 5678, "_sampling_frequency": "50", "_scale": "0.000000488",
                "0_offset": 41 * 338646, "1_offset": 0}  # fmt: skip
    files |= {f"iio:device1/in_capacitance{name}": value for name, value in channels.items()}
    for name, value in files.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(f"{value}\n")
    return tmp_path


def test_real_files(tree: Path) -> None:
    folder = tree / "iio:device1"
    with palpate.open("iio:", root=tree, clock_ns=itertools.count(0, 1000).__next__) as source:
        first = next(SampleReader(source))
        described = source.describe()
    assert first[3:] == (8387374, 8394286, -1234 / 2048000, 5678 / 2048000, 0, 0)
    assert first.t_soft_ns - first.t_hard_ns == 2000
    # of another clock
    assert (described["capdac"], source.zero_ns) == ({"hard": 41, "soft": 0}, None)
    # of the table, before it is measured
    assert palpate.open("iio:", root=tree).describe()["period_s"] == 0.042
    with palpate.Stream(f"iio:{folder}?hard_input=2") as stream:
        assert next(iter(stream)).sample.soft_raw == 8387374
        assert stream.epoch
        assert stream.source.zero_ns == stream.epoch.monotonic_ns
    with pytest.raises(FileNotFoundError):
        iio.write_text(folder / "in_capacitance9_offset", "1")  # never a new file
    iio.write_text(folder / "in_capacitance0_offset", "13884487")
    assert iio.read_text(folder / "in_capacitance0_offset") == "13884487"


def test_no_device(tree: Path) -> None:
    with pytest.raises(
        DeviceNotFound, match=r"no ad7746 in .*: load the driver of the kernel, or .* i2c:"
    ):
        palpate.open("iio:", root=tree / "nothing")
    with pytest.raises(DeviceNotFound, match="is 'bme280', not an ad7746"):
        palpate.open(f"iio:{tree}/iio:device0")
