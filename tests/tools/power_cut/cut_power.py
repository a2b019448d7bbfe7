"""Power cuts: a Linux kernel in QEMU records on ext4 and FAT, and no row that was synced is lost at any of its writes.

The guest (`record`) writes to two disks, and says after each sync how many bytes are on the disk. QEMU logs each write
and each flush. For each cut the disk is built again as it may be after any prefix of this log: all before the last
flush, and any of the sectors written after it. Then the system's repair (e2fsck, fsck.fat), `check` and `check --repair` have their
turn. As a control, cuts of a disk that ignores flushes have to lose rows. The log is that of Linux' dm-log-writes:
Documentation/admin-guide/device-mapper/log-writes.rst, and drivers/md/dm-log-writes.c for the bytes.

Usage: python tests/tools/power_cut/cut_power.py [CUTS [SEED]]; 100 cuts of each disk, seed 0. RECORD_S (60) is how long it records, s.
Needs what ../guest/boot needs, and apt-get install e2fsprogs dosfstools mtools.
"""

import json
import mmap
import os
import shutil
import struct
import subprocess
import sys
import tempfile
import time
import zlib
from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from itertools import chain, count, takewhile
from pathlib import Path
from random import Random
from typing import Any

from palpate import Stream, check
from palpate.errors import RecordingError
from palpate.recording.sidecar import load

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[2]
SIZE = 40 << 20  # of a file system, bytes; FAT32 has 34 million at least
SAID = 1 << 20  # behind it, for what the guest says
MODULES = "virtio_blk ext4 vfat nls_cp437 nls_ascii"
SECTOR = 512  # of the log
WHOLE = 4096  # bytes that a disk writes whole, its physical sector
_MAGIC = 0x6A736677736872
_VERSION = 1
_FLUSH = 1
LENGTHS_S = (0.3, 2.5, 10.0)
SOURCE = (
    "sim:drift-both?speed=12&idle=120"  # some hundred pairs a second, for longer than the longest
)
LOST = "lost by the cut"
NO_SIDECAR = "without a sidecar"
WRONG = (
    LOST,
    "lost by the repair",
    "wrong checkpoints",
    "faults after it",
    NO_SIDECAR,
    "closed, not clean",
)


def shell(command: str, most: int = 0) -> None:
    """Run a command, which may end with exit codes up to `most`."""
    environment = {**os.environ, "PATH": f"{os.environ['PATH']}:/usr/sbin:/sbin"}
    done = subprocess.run(
        command, check=False, shell=True, capture_output=True, text=True, env=environment
    )
    assert done.returncode <= most, (
        f"{command}: exit code {done.returncode}\n{done.stdout}{done.stderr}"
    )


@dataclass(frozen=True)
class Write:
    """A request: data at an offset in bytes, or a flush of all before it."""

    offset: int
    data: bytes
    flush: bool


def read_log(path: Path) -> list[Write]:
    """Return the requests in their order."""
    log = path.read_bytes()
    at = SECTOR
    writes = []
    magic, version, requests, sector = struct.unpack_from("<QQQI", log)
    assert (magic, version, sector) == (_MAGIC, _VERSION, SECTOR), f"{path}: not a log of writes"
    for _ in range(requests):
        begin, sectors, flags, _ = struct.unpack_from("<4Q", log, at)
        assert flags in (0, _FLUSH), f"a request with flags {flags}: neither write nor flush"
        data = log[at + SECTOR : at + SECTOR + sectors * SECTOR]
        at += SECTOR + len(data)
        writes.append(Write(begin * SECTOR, data, bool(flags)))
    return writes


def apply(image: bytearray, writes: Sequence[Write]) -> None:
    for write in writes:
        image[write.offset : write.offset + len(write.data)] = write.data


def cut(image: bytearray, writes: Sequence[Write], random: Random) -> None:
    """Apply what a power cut leaves of writes: all before the last flush, and any sectors of the rest, in their order."""
    flushed = max((number for number, write in enumerate(writes) if write.flush), default=0)
    apply(image, writes[:flushed])
    share = random.choice((0.0, 0.1, 0.5, 0.9, 1.0))
    for write in writes[flushed:]:
        for at in range(0, len(write.data), WHOLE):
            if random.random() < share:
                apply(
                    image,
                    [replace(write, offset=write.offset + at, data=write.data[at : at + WHOLE])],
                )


@dataclass
class Disk:
    """An image with a file system: how it is made, repaired and copied without mounting it; {} is the image."""

    image: Path
    make: str
    repair: str
    copy: str
    may: str = ""  # what cannot be held against a recorder on it
    whole: dict[str, bytes] = field(default_factory=dict)  # its recordings in the end

    def begin(self, letter: str, seconds: float) -> tuple[list[str], str, str]:
        """Make the image; return its arguments for QEMU, and what the guest does to begin and to end."""
        image = self.image
        name = self.image.name
        image.write_bytes(bytes(SIZE))
        shell(self.make.format(image))
        os.truncate(image, SIZE + SAID)
        shutil.copy(image, f"{image}.before")
        Path(f"{image}.log").touch()
        nodes = {part: {"driver": "file", "filename": f"{image}{end}", "cache": {"no-flush": True}}
                 for part, end in (("file", ""), ("log", ".log"))}  # fmt: skip
        arguments = [
            "-blockdev",
            json.dumps({"driver": "blklogwrites", "node-name": name, **nodes}),
        ]
        arguments += [
            "-device",
            f"virtio-blk-pci,drive={name},write-cache=on,discard=off,write-zeroes=off",
        ]
        mount = f"mkdir /run/{name} && mount -t {name} /dev/vd{letter} /run/{name}"
        run = (
            f"{sys.executable} {__file__} record /run/{name} /dev/vd{letter} {seconds} & {name}=$!"
        )
        return arguments, f"{mount}\n{run}", f"wait ${name} && umount /run/{name} || code=1"

    def contents(self, data: bytearray) -> Path:
        """Return a folder with the files of an image with these bytes after the system's repair."""
        path = self.image.with_suffix(".cut")
        into = self.image.with_suffix(".files")
        path.write_bytes(memoryview(data)[:SIZE])
        shell(self.repair.format(path), 1)
        shutil.rmtree(into, ignore_errors=True)
        into.mkdir()
        shell(self.copy.format(path, into=into))
        return into

    def judge(self, cuts: int, random: Random) -> bool:
        """Cut as often as asked for, print the counts; return whether they are right."""
        before = Path(f"{self.image}.before").read_bytes()
        writes = read_log(Path(f"{self.image}.log"))
        apply(ended := bytearray(before), writes)
        self.whole = {path.name: path.read_bytes() for path in self.contents(ended).glob("*.csv")}
        tally = Counter[str]()
        control = Counter[str]()
        last = len(writes)

        def said(moment: int) -> dict[str, dict[str, Any]]:
            lines = (json.loads(write.data) for write in writes[:moment] if write.offset >= SIZE)
            return {line["name"]: line for line in lines}

        for number in range(cuts):
            moment = random.randint(number * last // cuts, (number + 1) * last // cuts)
            cut(image := bytearray(before), writes[:moment], random)
            tally += self.compare(image, said(moment))
        # a disk that ignores flushes has only the writes up to an earlier moment
        for _ in range(max(1, cuts // 10)):
            moment = random.randint(last // 2, last)
            apply(image := bytearray(before), writes[: random.randint(0, moment)])
            control += self.compare(image, said(moment))
        print(
            f"{self.image.name}: {last} writes and flushes, {cuts} cuts, {len(self.whole)} recordings"
        )
        for name in ("recordings", "synced rows", "checkpoints", *WRONG):
            print(f"  {tally[name]:9d} {name}")
        print(f"  control: {control[LOST]} of {control['synced rows']} rows lost without flushes")
        return bool(control[LOST]) and not any(tally[name] for name in WRONG if name != self.may)

    def compare(self, image: bytearray, said: dict[str, dict[str, Any]]) -> Counter[str]:
        """Return the counts over all recordings of which the guest had said something."""
        files = self.contents(image)
        tally = Counter[str]()
        for name, line in said.items():
            tally += look(files / name, self.whole[name][: line["bytes"]], closed=line["closed"])
        for path in files.glob("*.csv"):
            # nothing may be synced yet: a report, or a documented error
            with suppress(RecordingError):
                check(path)
        return tally


def look(path: Path, synced: bytes, *, closed: bool) -> Counter[str]:
    """Return the counts of one recording after a cut, before and after `check --repair`."""
    tally = Counter({"recordings": 1, "synced rows": rows(synced)})
    if lost := rows(synced) - kept(path, synced):
        return tally + Counter({LOST: lost})
    document = None
    with suppress(RecordingError):
        document = load(path)
    if checkpoint := (document or {}).get("checkpoint"):
        data = path.read_bytes()[: checkpoint["bytes"]]
        tally["checkpoints"] = 1
        tally["wrong checkpoints"] = (
            zlib.crc32(data) != checkpoint["crc32"] or rows(data) != checkpoint["rows"]
        )
    found = check(path, repair=document is not None)
    tally[NO_SIDECAR] = document is None
    tally["lost by the repair"] = rows(synced) - min(kept(path, synced), found.survey.rows)
    tally["faults after it"] = document is not None and found.faults != ()
    tally["closed, not clean"] = closed and not found.clean
    return tally


def rows(data: bytes) -> int:
    return max(0, data.count(b"\n") - 1)


def kept(path: Path, synced: bytes) -> int:
    """Return how many of the synced rows a file begins with."""
    data = path.read_bytes() if path.exists() else b""
    same = takewhile(
        lambda pair: pair[0] == pair[1], zip(data.splitlines(), synced.splitlines(), strict=False)
    )
    return max(0, sum(1 for _ in same) - 1)


def measure(path: Path, seconds: float) -> None:
    """Record for a time."""
    with Stream(SOURCE, record=path) as stream:
        ends_s = time.monotonic() + seconds
        for _ in takewhile(lambda _: time.monotonic() < ends_s, stream.batches()):
            pass


def record(folder: Path, device: str, seconds: float) -> None:
    """In the guest: record again and again, for a time, and write behind the file system what is on the disk.

    After each sync of a recording, and after each close, a line of JSON goes to the device, past every cache; so the log
    of the device's writes has it in its place.
    """
    disk = os.open(device, os.O_WRONLY | os.O_DIRECT)
    # O_DIRECT takes whole sectors from an aligned address
    sector = memoryview(mmap.mmap(-1, mmap.PAGESIZE))[:512]

    def say(path: Path, size: int, *, closed: bool) -> None:
        sector[:] = (
            json.dumps({"name": path.name, "bytes": size, "closed": closed}).encode().ljust(512)
        )
        os.pwritev(disk, [sector], SIZE)

    def saying(sync: Callable[[int], None]) -> Callable[[int], None]:
        def synced(descriptor: int) -> None:
            size = os.fstat(descriptor).st_size
            path = Path(f"/proc/self/fd/{descriptor}").readlink()
            sync(descriptor)
            if path.suffix == ".csv":
                say(path, size, closed=False)

        return synced

    system: Any = os
    system.fdatasync, system.fsync = saying(os.fdatasync), saying(os.fsync)
    until = time.monotonic() + seconds
    for number in count():
        path = folder / f"{number}.csv"
        measure(path, LENGTHS_S[number % len(LENGTHS_S)])
        say(path, path.stat().st_size, closed=True)
        if time.monotonic() >= until:
            return


def main(cuts: int = 100, seed: int = 0) -> None:
    print(f"{cuts} power cuts of each disk, seed {seed}", flush=True)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        # FAT has no journal: between two of its writes, a file that is replaced can be neither the old nor the new one.
        fat = (
            "mkfs.vfat -F 32 -s 1 {}",
            "fsck.vfat -a {}",
            "mcopy -s -n -i {} :: {into}",
            NO_SIDECAR,
        )
        disks = (
            Disk(
                folder / "ext4",
                "mkfs.ext4 -q -F -b 4096 {}",
                "e2fsck -fy {}",
                "debugfs -R 'rdump / {into}' {}",
            ),
            Disk(folder / "vfat", *fat),
        )
        seconds = float(os.environ.get("RECORD_S", "60"))
        arguments, begins, ends = zip(
            *(disk.begin(a, seconds) for disk, a in zip(disks, "ab", strict=True)), strict=True
        )
        home = "export HOME=/run TMPDIR=/run PYTHONDONTWRITEBYTECODE=1 PATH=/usr/bin:/bin:/usr/sbin:/sbin"
        lines = [f"cd {ROOT}; {home}; code=0", *begins, *ends, "echo $code > /mnt/code"]
        (folder / "command").write_text("\n".join(lines))
        subprocess.run(
            [HERE.parent / "guest" / "boot", folder, MODULES, *chain(*arguments)], check=True
        )
        good = [disk.judge(cuts, Random(seed)) for disk in disks]
    sys.exit(0 if all(good) else "power cuts: not as it has to be")


if __name__ == "__main__":
    if sys.argv[1:2] == ["record"]:
        record(Path(sys.argv[2]), sys.argv[3], float(sys.argv[4]))
    else:
        main(*map(int, sys.argv[1:]))
