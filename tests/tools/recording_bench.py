"""Samples and recordings for tests of writing and reading: also those that were killed, and what can happen to files."""

import math
import time
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from random import Random
from typing import Any, Self

import numpy as np
from palpate import Sample, Source, Status, Stream
from palpate.ad7746 import registers
from palpate.recording import sidecar
from palpate.recording.recorder import Recorder
from palpate.recording.rows import HEADER, format_rows
from palpate.samples import block_of, samples_of
from palpate.simulation import scenarios
from palpate.source_events import Gap, GapCause
from palpate.sources import SampleSource


def sample(seq: int, *, status: int = Status.OK) -> Sample:
    """Return a sample with all fields computed from its number."""
    t_ns = seq * 26_000_000 + seq % 7
    if status == Status.LOST:
        return Sample(seq, t_ns, t_ns + 13_000_000, -1, -1, math.nan, math.nan, status)
    hard = registers.ZERO_CODE + seq % 100_000
    soft = registers.ZERO_CODE - seq % 50_000
    values = registers.capacitance_pF(hard), registers.capacitance_pF(soft)
    return Sample(seq, t_ns, t_ns + 13_000_000, hard, soft, *values, status)


class Scripted(SampleSource):
    """A source with a script of samples, events and errors."""

    def __init__(self, script: list[Any], *, live: bool = False, **described: Any) -> None:
        self.live = live
        self.script = script
        self.closed = self.interrupted = 0
        self.before: Callable[[Sample], object] = lambda _: None
        self._described = {"name": "script", **described}

    def samples(self) -> Iterator[Any]:
        """Yield the items of the script; raise its errors."""
        for item in self.script:
            if isinstance(item, Exception):
                raise item
            self.before(item)
            yield item

    def describe(self) -> dict[str, Any]:
        return self._described

    def interrupt(self) -> None:
        self.interrupted += 1

    def close(self) -> None:
        self.closed += 1


def with_gaps(samples: list[Any], texts: dict[int, str]) -> list[Any]:
    """Return a script with a gap before the first sample that has a number, or a larger one."""
    script: list[Any] = []
    left = sorted(texts.items())
    for each in samples:
        while left and left[0][0] <= each.seq:
            script.append(Gap(GapCause.OTHER, left.pop(0)[1]))
        script.append(each)
    return script


class Liar(Scripted):
    """A source that fails: errors of its script are raised, functions called; `lies`: in place of methods of these names."""

    def __init__(
        self, script: list[Any], *, live: bool = False, lies: dict[str, Any] | None = None
    ) -> None:
        super().__init__(script, live=live)
        self.lies = lies or {}

    def _lie(self, name: str, otherwise: Any = None) -> Any:
        lie = self.lies.get(name, otherwise)
        if isinstance(lie, BaseException):
            raise lie
        return lie

    def __enter__(self) -> Self:
        """Begin, or lie."""
        self._lie("enter")
        return self

    def samples(self) -> Iterator[Any]:
        """Yield the items of the script."""
        for item in self.script:
            if isinstance(item, BaseException):
                raise item
            if callable(item):
                item()
            else:
                yield item

    def describe(self) -> Any:
        return self._lie("describe", {"name": "liar"})

    def interrupt(self) -> None:
        self._lie("interrupt")

    def close(self) -> None:
        super().close()
        self._lie("close")


class Blocks(Scripted):
    """A script of blocks, events and errors."""

    def __iter__(self) -> Iterator[Any]:
        """Yield the items of the script; raise its errors."""
        return self.samples()


def record(path: Path, samples: list[Sample], **device: Any) -> Path:
    """Write a recording."""
    recorder = Recorder(path, device, {}, [])
    for each in samples:
        while recorder.is_behind:
            time.sleep(0.001)
        assert recorder.push(each)
    recorder.close()
    return path


class SampleReader(Iterator[Sample]):
    """The samples of a source one by one; `gaps`: for each gap the number of the sample after it, and its text."""

    def __init__(self, source: Source) -> None:
        self.gaps: list[tuple[int, str]] = []
        self.causes: list[GapCause] = []
        self._samples = self._read(source)

    def __next__(self) -> Sample:
        """Return the next sample."""
        return next(self._samples)

    def _read(self, source: Source) -> Iterator[Sample]:
        waiting: list[Gap] = []
        for item in source:
            if isinstance(item, Gap):
                waiting.append(item)
            if not isinstance(item, np.ndarray):
                continue
            for each in samples_of(item):
                self.gaps += [(each.seq, gap.text) for gap in waiting]
                self.causes += [gap.cause for gap in waiting]
                waiting = []
                yield each


def measured(source: Source | str, **how: Any) -> Stream:
    """Measure to the end; return the stream."""
    with Stream(source, **how) as stream:
        list(stream.batches())
    return stream


def document(path: Path) -> dict[str, Any]:
    """Return the sidecar of a recording."""
    return sidecar.load(path) or {}


def soon(is_so: Callable[[], object]) -> None:
    """Wait until something is so."""
    until = time.monotonic() + 60
    while not is_so():
        assert time.monotonic() < until
        time.sleep(0.002)


def four(seed: int = 1) -> list[Any]:
    """Return a scenario's samples, as a source would give them, with some that have no value."""
    flags = {17: Status.EXCITATION, 31: Status.HARD_SATURATED}
    samples = samples_of(scenarios.run("four-specimens", seed).block())
    return [
        s._replace(status=flags.get(s.seq % 101, Status.OK)) for s in samples if s.seq % 97 != 5
    ]


def rows_of(count: int, first: int = 0) -> list[bytes]:
    """Return the lines of some samples."""
    return format_rows(block_of([sample(i) for i in range(first, first + count)])).splitlines(
        keepends=True
    )


def killed(path: Path, rows: int, synced: int, torn: int = 0) -> Path:
    """Write a recording that was killed: rows, the number of them in its checkpoint, and bytes of one more row."""
    lines = [HEADER.encode(), *rows_of(rows)]
    path.write_bytes(b"".join(lines) + rows_of(1, rows)[0][:torn])
    on_disk = b"".join(lines[: synced + 1])
    checkpoint = {"rows": synced, "bytes": len(on_disk), "crc32": zlib.crc32(on_disk)}
    sidecar.save(
        sidecar.sidecar_path(path),
        sidecar.fresh({"name": "a board"}, {}, []) | {"checkpoint": checkpoint},
    )
    return path


DAMAGES = (
    "zeros",
    "noise",
    "cut out",
    "inserted",
    "lines merged",
    "end cut off",
    "one byte changed",
)


def damaged(kind: str, data: bytes, random: Random) -> bytes:
    """Return a file after one of `DAMAGES` at a random place."""
    at = random.randrange(len(data))
    size = random.choice((1, 16, 60, 512, 4096))
    before = data[:at]
    hit = data[at : at + size]
    after = data[at + size :]
    odd = (b"\n", b"\n\n\n", b"\r", b",", b"\0" * 8, "Grüße\n".encode(), random.randbytes(300))
    begin, _, rest = data[at:].partition(b"\n")
    return {
        "zeros": before + bytes(len(hit)) + after,
        "noise": before + random.randbytes(len(hit)) + after,
        "cut out": before + after,
        "inserted": before + random.choice(odd) + hit + after,
        "lines merged": before + begin + rest,
        "end cut off": before + bytes(random.choice((0, 0, 1, 512, 9000))),
        "one byte changed": before + bytes([data[at] ^ random.randrange(1, 256)]) + data[at + 1 :],
    }[kind]


def survivors(data: bytes, rows: list[bytes]) -> list[bytes]:
    """Return the rows that are still there as they were written: whole lines of the file."""
    known = set(rows)
    return [line + b"\n" for line in data.split(b"\n")[:-1] if line + b"\n" in known]
