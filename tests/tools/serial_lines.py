"""Serial ports without a device: chunks of bytes, and what a source makes of lines."""

from collections.abc import Iterator
from typing import Any

from palpate import ProtocolError, Sample
from palpate.sources.lines import OF_LINES, Refused, grammar_of
from palpate.sources.options import checked
from palpate.sources.serial import Line, Port, SerialSource


class ChunkedPort(Port):
    r"""A serial port that sends these bytes and is then unplugged; \xff separates the bytes of one read."""

    def __init__(self, data: bytes) -> None:
        self._chunks = data.split(b"\xff")
        super().__init__("tty")

    @property
    def in_waiting(self) -> int:
        return len(self._chunks[0]) if self._chunks else 0

    def read(self, _: int) -> bytes:
        if self._chunks:
            return self._chunks.pop(0)
        raise OSError("gone")

    def close(self) -> None:
        """Do nothing."""

    def _open(self) -> Any:
        return self

    def _wait_for_replug(self, gone: Exception) -> None:
        self.stopped.set()


class TimedPort(ChunkedPort):
    """A serial port whose lines come at these times, s; a line that begins with + comes after an absence of 1 s."""

    def __init__(self, data: bytes, arrivals_s: list[float]) -> None:
        super().__init__(data)
        self._arrivals_s = iter(arrivals_s)

    def lines(self, source: Any) -> Iterator[Line]:
        """Yield the lines at their times."""
        for line in super().lines(source):
            if line.text:
                self.away_s += line.text.startswith(b"+")
                yield Line(line.text.lstrip(b"+"), round(next(self._arrivals_s) * 1e9))


class Sent:
    """What a source reads from these lines: its samples, messages, and the error with which it ended."""

    def __init__(self, lines: list[str] | bytes, arrivals_s: list[float] | None = None, **options: Any) -> None:
        data = lines if isinstance(lines, bytes) else "".join(f"{line}\n" for line in lines).encode()
        port = ChunkedPort(b"\n" + data) if arrivals_s is None else TimedPort(b"\n" + data, arrivals_s)
        self.refusals, self.said, self.samples, self.failed = list[str](), list[str](), list[Sample](), ""
        self.source = SerialSource(port, grammar_of(checked("serial", options, OF_LINES)))
        refuse = self.source._refuse

        def noted(line: Line, refused: Refused) -> None:
            self.refusals.append(str(refused))
            refuse(line, refused)

        self.source._refuse = noted  # type: ignore[method-assign]
        self.source.notify = lambda text: None if "was unplugged. Waiting" in text else self.said.append(text)
        try:
            self.samples.extend(self.source)
        except ProtocolError as error:
            self.failed = str(error)

    @property
    def pairs(self) -> list[tuple[float, float]]:
        """The values of the samples, pF."""
        return [(sample.hard, sample.soft) for sample in self.samples]
