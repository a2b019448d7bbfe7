"""Samples and recordings for tests of writing and reading."""

import math
import time
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Self

from palpate import Sample, Source, Status, Stream
from palpate.ad7746 import datasheet
from palpate.recording import sidecar
from palpate.recording.recorder import Recorder
from palpate.samples import block_of, samples_of
from palpate.simulation import scenarios
from palpate.sources.base import Gap


def sample(seq: int, *, status: int = Status.OK) -> Sample:
    """Return a sample with all fields computed from its number."""
    t_ns = seq * 26_000_000 + seq % 7
    if status == Status.LOST:
        return Sample(seq, t_ns, t_ns + 13_000_000, -1, -1, math.nan, math.nan, status)
    hard, soft = datasheet.ZERO_CODE + seq % 100_000, datasheet.ZERO_CODE - seq % 50_000
    values = datasheet.capacitance_pF(hard), datasheet.capacitance_pF(soft)
    return Sample(seq, t_ns, t_ns + 13_000_000, hard, soft, *values, status)


class Scripted(Source):
    """A source with a script of samples and errors; and gaps."""

    def __init__(
        self, script: list[Any], *, live: bool = False, gaps: list[Gap] | None = None, **described: Any
    ) -> None:
        self.live, self.all_gaps = live, gaps or []
        self.script = script
        self.closed = self.interrupted = 0
        self.before: Callable[[Sample], object] = lambda _: None
        self._described = {"name": "script", **described}

    def __iter__(self) -> Iterator[Sample]:
        """Return the samples of the script; raise its errors."""
        for item in self.script:
            if isinstance(item, Exception):
                raise item
            self.before(item)
            yield item

    def describe(self) -> dict[str, Any]:
        return self._described

    @property
    def gaps(self) -> list[Gap]:
        return self.all_gaps

    def interrupt(self) -> None:
        self.interrupted += 1

    def close(self) -> None:
        self.closed += 1


class Liar(Scripted):
    """A source that fails: errors of its script are raised, functions called; `lies`: in place of methods of these names."""

    def __init__(self, script: list[Any], *, live: bool = False, lies: dict[str, Any] | None = None) -> None:
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

    def __iter__(self) -> Iterator[Any]:
        """Return the items of the script."""
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
    """A script of blocks and errors."""

    def __init__(self, script: list[Any], **described: Any) -> None:
        super().__init__([], **described)
        self.given: Iterator[Any] = iter(script)

    def read_block(self) -> Any:
        item = next(self.given, block_of([]))
        if isinstance(item, Exception):
            raise item
        return item


def record(path: Path, samples: list[Sample], *, end: bool = True, **device: Any) -> Path:
    """Write a recording; without `end`, as after a kill of the process: its last row is not in the last checkpoint."""
    recorder = Recorder(path, device, {}, [])
    for each in samples:
        while recorder.is_behind:
            time.sleep(0.001)
        assert recorder.push(each)
    recorder.close()
    if not end:
        document = sidecar.load(path) or {}
        written = document.pop("end")
        if rows := written["rows"]:
            synced = b"".join(path.read_bytes().splitlines(keepends=True)[:rows])
            document["checkpoint"] = {"rows": rows - 1, "bytes": len(synced), "crc32": zlib.crc32(synced)}
        sidecar.save(sidecar.sidecar_path(path), document)
    return path


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


def tear(path: Path, count: int) -> None:
    """Remove the last bytes of a file."""
    path.write_bytes(path.read_bytes()[:-count])


def four(seed: int = 1) -> list[Any]:
    """Return a scenario's samples, as a source would give them, with some that have no value."""
    flags = {17: Status.EXCITATION, 31: Status.HARD_SATURATED}
    samples = samples_of(scenarios.run("four-specimens", seed).block())
    return [s._replace(status=flags.get(s.seq % 101, Status.OK)) for s in samples if s.seq % 97 != 5]
