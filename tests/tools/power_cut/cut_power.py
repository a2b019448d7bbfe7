"""Power cuts: a Linux kernel in QEMU records on ext4 and FAT, and no row that was synced is lost at any of its writes.

The guest (record.py) writes to two disks, and says after each sync how many bytes are on the disk. QEMU logs each write
and each flush. For each cut the disk is built again as it may be after any prefix of this log: all before the last
flush, and any of the sectors written after it (write_log.py). Then the system's repair (e2fsck, fsck.fat), `check` and
`check --repair` have their turn. As a control, cuts of a disk that ignores flushes have to lose rows.

Usage: python tests/tools/power_cut/cut_power.py [CUTS [SEED]]; 100 cuts of each disk. RECORD_S (60) is how long it records, s.
Needs what ../guest/boot needs, and apt-get install e2fsprogs dosfstools mtools.
"""

import json
import os
import shutil
import subprocess
import sys
import tempfile
import zlib
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import takewhile
from pathlib import Path
from random import Random
from typing import Any

from palpate import RecordingError, check
from palpate.recording.sidecar import load
from write_log import Write, apply, cut, flushed, read_log

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[2]
SIZE = 40 << 20  # of a file system, bytes; FAT32 has 34 million at least
SAID = 1 << 20  # behind it, for what the guest says
MODULES = "virtio_blk ext4 vfat nls_cp437 nls_ascii"


@dataclass(frozen=True)
class System:
    """A file system: how it is made, repaired (exit codes 0 and 1) and copied without mounting it; {} is the disk."""

    name: str
    make: str
    repair: str
    copy: str
    may: tuple[str, ...] = ()  # what cannot be held against a recorder on it


# FAT has no journal: between two of its writes, a file that is replaced can be neither the old one nor the new one.
SYSTEMS = (
    System("ext4", "mkfs.ext4 -q -F -b 4096 {}", "e2fsck -fy {}", "debugfs -R 'rdump / {into}' {}"),
    System(
        "vfat",
        "mkfs.vfat -F 32 -s 1 {}",
        "fsck.vfat -a {}",
        "mcopy -s -n -i {} :: {into}",
        may=("without a sidecar",),
    ),
)


def shell(command: str, allowed: Sequence[int] = (0,)) -> None:
    environment = {**os.environ, "PATH": f"{os.environ['PATH']}:/usr/sbin:/sbin"}
    done = subprocess.run(command, check=False, shell=True, capture_output=True, text=True, env=environment)
    assert done.returncode in allowed, f"{command}: exit code {done.returncode}\n{done.stdout}{done.stderr}"


def disk(folder: Path, system: System) -> Path:
    return folder / system.name


def record(folder: Path, seconds: float) -> None:
    """Make the disks, and let a guest record on both for some seconds."""
    arguments: list[str] = []
    mounts, begins, ends = [], [], []
    for letter, system in zip("ab", SYSTEMS, strict=True):
        image, name = disk(folder, system), system.name
        with image.open("wb") as file:
            file.truncate(SIZE)
        shell(system.make.format(image))
        os.truncate(image, SIZE + SAID)
        shutil.copy(image, f"{image}.before")
        nodes = {part: {"driver": "file", "filename": f"{image}{end}", "cache": {"no-flush": True}}
                 for part, end in (("file", ""), ("log", ".log"))}  # fmt: skip
        Path(f"{image}.log").touch()
        arguments += ["-blockdev", json.dumps({"driver": "blklogwrites", "node-name": name, **nodes})]
        arguments += ["-device", f"virtio-blk-pci,drive={name},write-cache=on,discard=off,write-zeroes=off"]
        mounts.append(f"mkdir /run/{name} && mount -t {name} /dev/vd{letter} /run/{name}")
        begins.append(f"{sys.executable} {HERE / 'record.py'} /run/{name} /dev/vd{letter} {SIZE} {seconds} & {name}=$!")
        ends.append(f"wait ${name} && umount /run/{name} || code=1")
    home = "export HOME=/run TMPDIR=/run PYTHONDONTWRITEBYTECODE=1 PATH=/usr/bin:/bin:/usr/sbin:/sbin"
    (folder / "command").write_text(
        "\n".join([f"cd {ROOT}; {home}; code=0", *mounts, *begins, *ends, "echo $code > /mnt/code"])
    )
    subprocess.run([HERE.parent / "guest" / "boot", folder, MODULES, *arguments], check=True)


def contents(folder: Path, image: bytearray, system: System) -> Path:
    """Return a folder with the files of a disk after the system's repair."""
    path, into = folder / f"{system.name}.cut", folder / f"{system.name}.files"
    path.write_bytes(memoryview(image)[:SIZE])
    shell(system.repair.format(path), (0, 1))
    shutil.rmtree(into, ignore_errors=True)
    into.mkdir()
    shell(system.copy.format(path, into=into))
    return into


@dataclass
class Recorded:
    """What a guest wrote to a disk, and what it said of it."""

    folder: Path
    system: System
    writes: list[Write]
    whole: dict[str, bytes] = field(default_factory=dict)  # the files in the end

    @classmethod
    def of(cls, folder: Path, system: System) -> "Recorded":
        self = cls(folder, system, read_log(Path(f"{disk(folder, system)}.log")))
        image = self.before()
        apply(image, self.writes)
        self.whole = {path.name: path.read_bytes() for path in contents(folder, image, system).glob("*.csv")}
        return self

    def before(self) -> bytearray:
        return bytearray(Path(f"{disk(self.folder, self.system)}.before").read_bytes())

    def said(self, moment: int) -> dict[str, dict[str, Any]]:
        """Return by name what the guest had said of its recordings at a moment."""
        lines = (json.loads(write.data) for write in self.writes[:moment] if write.offset >= SIZE)
        return {line["name"]: line for line in lines}

    def cut(self, moment: int, random: Random) -> Counter[str]:
        """Cut the power at a moment; return counts over all recordings of which the guest had said something."""
        image, writes = self.before(), self.writes[:moment]
        cut(image, writes, flushed(writes), random)
        return self.compare(image, moment)

    def control(self, moment: int, random: Random) -> Counter[str]:
        """Return the counts if the disk has only the writes up to an earlier moment: it ignores flushes."""
        image = self.before()
        apply(image, self.writes[: random.randint(0, moment)])
        return self.compare(image, moment)

    def compare(self, image: bytearray, moment: int) -> Counter[str]:
        files, tally = contents(self.folder, image, self.system), Counter(cuts=1)
        for name, said in self.said(moment).items():
            tally += self.look(files / name, said)
        for path in files.glob("*.csv"):
            look_without_promise(path)
        return tally

    def look(self, path: Path, said: dict[str, Any]) -> Counter[str]:
        """Return the counts of one recording after a cut, before and after `check --repair`."""
        synced = self.whole[path.name][: said["bytes"]]
        tally = Counter({"recordings": 1, "synced rows": rows(synced)})
        tally["lost by the cut"] = rows(synced) - kept(path, synced)
        if tally["lost by the cut"]:
            return tally
        try:
            document = load(path)
        except RecordingError:
            document = None
        if document is None:
            tally["without a sidecar"] = 1
        elif checkpoint := document.get("checkpoint"):
            data = path.read_bytes()[: checkpoint["bytes"]]
            tally["checkpoints"] = 1
            tally["wrong checkpoints"] = zlib.crc32(data) != checkpoint["crc32"] or rows(data) != checkpoint["rows"]
        found = check(path, repair=document is not None)
        tally["lost by the repair"] = rows(synced) - min(kept(path, synced), found.survey.rows)
        tally["faults after it"] = document is not None and found.faults != ()
        tally["closed, not clean"] = said["closed"] and not found.clean
        return tally


def rows(data: bytes) -> int:
    return max(0, data.count(b"\n") - 1)


def kept(path: Path, synced: bytes) -> int:
    """Return how many of the synced rows a file begins with."""
    data = path.read_bytes() if path.exists() else b""
    same = takewhile(lambda pair: pair[0] == pair[1], zip(data.splitlines(), synced.splitlines(), strict=False))
    return max(0, sum(1 for _ in same) - 1)


def look_without_promise(path: Path) -> None:
    """Check a file of which nothing was synced: a documented error, or a report."""
    try:
        check(path)
    except RecordingError:
        return


WRONG = (
    "lost by the cut",
    "lost by the repair",
    "wrong checkpoints",
    "faults after it",
    "without a sidecar",
    "closed, not clean",
)


def judge(recorded: Recorded, cuts: int, random: Random) -> bool:
    """Cut as often as asked for, print the counts; return whether they are right."""
    last = len(recorded.writes)
    tally, control = Counter[str](), Counter[str]()
    for number in range(cuts):
        tally += recorded.cut(random.randint(number * last // cuts, (number + 1) * last // cuts), random)
    for _ in range(max(1, cuts // 10)):
        control += recorded.control(random.randint(last // 2, last), random)
    flushes = sum(write.flush for write in recorded.writes)
    print(f"{recorded.system.name}: {last - flushes} writes, {flushes} flushes, {len(recorded.whole)} recordings")
    for name in ("cuts", "recordings", "synced rows", "checkpoints", *WRONG):
        print(f"  {tally[name]:9d} {name}")
    print(f"  control, a disk that ignores flushes: {control['lost by the cut']} of {control['synced rows']} rows lost")
    wrong = [name for name in WRONG if tally[name] and name not in recorded.system.may]
    return not wrong and bool(control["lost by the cut"])


def main() -> None:
    cuts = int(sys.argv[1]) if len(sys.argv) > 1 else 100
    seed = int(sys.argv[2]) if len(sys.argv) > 2 else int.from_bytes(os.urandom(4))
    print(f"{cuts} power cuts of each disk, seed {seed}", flush=True)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        record(folder, float(os.environ.get("RECORD_S", "60")))
        good = [judge(Recorded.of(folder, system), cuts, Random(seed)) for system in SYSTEMS]
    sys.exit(0 if all(good) else "power cuts: not as it has to be")


if __name__ == "__main__":
    main()
