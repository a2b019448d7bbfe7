"""`iio:` over plain files: what is read, and what is said where it cannot be."""

import errno
import itertools
import os
from pathlib import Path

import palpate
import pytest
from palpate import DeviceNotFound, DeviceRefused, ProtocolError, Status
from palpate.ad7746 import datasheet
from palpate.sources import iio, sysfs


def test_the_files_are_read_and_written(tmp_path: Path) -> None:
    offset = tmp_path / "in_capacitance0_offset"
    with pytest.raises(FileNotFoundError):
        sysfs.write(offset, "1")  # never a new file
    offset.write_text("0\n")
    sysfs.write(offset, "338646")
    assert sysfs.text_of(offset) == "338646"


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """Make a kernel's folder of a device, and one of another."""
    for number, name in ((0, "bme280"), (1, "ad7746")):
        folder = tmp_path / f"iio:device{number}"
        folder.mkdir()
        (folder / "name").write_text(f"{name}\n")
    files = {"in_capacitance0_raw": -1234, "in_capacitance1_raw": 5678, "in_capacitance_sampling_frequency": "50"}
    files |= {"in_capacitance0_scale": "0.000000488", "in_capacitance0_offset": 41 * 338646}
    for name, value in files.items():
        (folder / name).write_text(f"{value}\n")
    return tmp_path


def test_iio(tree: Path) -> None:
    assert iio.devices(tree) == [tree / "iio:device1"]
    ticks = itertools.count(0, 1000)
    with palpate.open("iio:", root=tree, clock_ns=lambda: next(ticks)) as source:
        samples = iter(source)
        first = next(samples)
        (tree / "iio:device1" / "in_capacitance0_raw").write_text("8388607")
        second = next(samples)
    assert first[3:] == (8387374, 8394286, -1234 / 2048000, 5678 / 2048000, 0, 0)
    assert first.t_soft_ns - first.t_hard_ns == 2000
    assert (second.seq, second.status, second.hard_raw) == (1, Status.HARD_SATURATED, datasheet.LAST_CODE)
    described = source.describe()
    assert described["capdac"] == {"hard": 41, "soft": None}
    assert described["excitation"] is None
    assert palpate.open("iio:", root=tree).describe()["period_s"] == 0.042  # of the table, before it is measured
    with palpate.open(f"iio:{tree}/iio:device1?hard_input=2") as swapped:
        assert next(iter(swapped)).soft_raw == datasheet.LAST_CODE
    with palpate.Stream(f"iio:{tree}/iio:device1") as stream:
        next(iter(stream))
        assert stream.epoch
        assert stream.source.zero_ns == stream.epoch.monotonic_ns
    assert source.zero_ns is None  # of another clock
    assert stream.counters.read == stream.counters.delivered


def test_iio_errors(tree: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(DeviceNotFound, match=r"0 devices in .* are an ad7746"):
        palpate.open("iio:", root=tree / "nothing")
    with pytest.raises(DeviceNotFound, match="is 'bme280', not an ad7746"):
        palpate.open(f"iio:{tree}/iio:device0")
    folder = tree / "iio:device1"
    ticks = itertools.count(0, 1000)
    with palpate.open(f"iio:{folder}", clock_ns=lambda: next(ticks)) as source:
        samples = iter(source)
        next(samples)
        (folder / "in_capacitance1_raw").write_text("later\n")
        assert [next(samples).status, next(samples).status] == [Status.LOST] * 2
        with pytest.raises(ProtocolError, match="got 'later'"):
            next(samples)
        assert source.counters == {"errors": 3}
    (folder / "in_capacitance1_raw").unlink()
    with pytest.raises(DeviceNotFound, match="not found"), palpate.open(f"iio:{folder}") as source:
        next(iter(source))

    def fail(number: int) -> None:
        def read_bytes(*_: object) -> bytes:
            raise OSError(number, os.strerror(number))

        monkeypatch.setattr("palpate.sources.sysfs.read_bytes", read_bytes)

    fail(errno.EACCES)
    with pytest.raises(DeviceRefused, match="no permission"):
        palpate.open(f"iio:{folder}")
    fail(errno.EIO)
    with pytest.raises(ProtocolError, match="Input/output error"):
        palpate.open(f"iio:{folder}")
