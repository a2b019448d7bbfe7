"""Serial ports without a device: chunks of bytes, and what a source makes of lines."""

from collections.abc import Iterator
from typing import Any

from palpate import Sample
from palpate.errors import ProtocolError
from palpate.line_protocol import Refused
from palpate.sources.serial import SerialOptions, SerialSource
from recording_bench import SampleReader


class Chunks(SerialSource):
    r"""The source of a port that sends these bytes and is then unplugged; \xff separates the bytes of one read.

    With `arrivals_s` its lines come at these times; a line that begins with + comes after an absence of 1 s.
    """

    def __init__(
        self, data: bytes, options: SerialOptions, arrivals_s: list[float] | None = None
    ) -> None:
        self._chunks = data.split(b"\xff")
        self._arrivals_s = None if arrivals_s is None else iter(arrivals_s)
        self.refusals, self.said = list[str](), list[str]()
        super().__init__("tty", options)
        self.notify = lambda text: (
            None if "was unplugged. Waiting" in text else self.said.append(text)
        )

    @property
    def in_waiting(self) -> int:
        return len(self._chunks[0]) if self._chunks else 0

    def read(self, _: int) -> bytes:
        if self._chunks:
            return self._chunks.pop(0)
        raise OSError("gone")

    def _open(self) -> Any:
        return self

    def _wait_for_replug(self, *_: object) -> None:
        self.interrupt()

    def _read_lines(self) -> Iterator[tuple[bytes, int]]:
        for line, arrived_ns in super()._read_lines():
            if line and self._arrivals_s:
                self._away_s += line.startswith(b"+")
                yield line.lstrip(b"+"), round(next(self._arrivals_s) * 1e9)
            elif not self._arrivals_s:
                yield line, arrived_ns

    def _refuse(self, line: bytes, arrived_ns: int, refused: Refused) -> None:
        self.refusals.append(str(refused))
        super()._refuse(line, arrived_ns, refused)


class Sent:
    """What a source reads from these lines: its samples, messages, and the error with which it ended."""

    def __init__(
        self, lines: list[str] | bytes, arrivals_s: list[float] | None = None, **options: Any
    ) -> None:
        data = (
            lines if isinstance(lines, bytes) else "".join(f"{line}\n" for line in lines).encode()
        )
        self.source = Chunks(b"\n" + data, SerialOptions.parse("serial", options), arrivals_s)
        self.refusals, self.said, self.samples, self.failed = (
            self.source.refusals,
            self.source.said,
            list[Sample](),
            "",
        )
        reader = SampleReader(self.source)
        self.gaps, self.causes = reader.gaps, reader.causes
        try:
            self.samples.extend(reader)
        except ProtocolError as error:
            self.failed = str(error)

    @property
    def pairs(self) -> list[tuple[float, float]]:
        """The values of the samples, pF."""
        return [(sample.hard, sample.soft) for sample in self.samples]
