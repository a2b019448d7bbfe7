"""Serial ports without a device: chunks of bytes, and what a source makes of lines."""

from typing import Any

from palpate import ProtocolError, Sample
from palpate.sources.options import checked
from palpate.sources.serial.opening import _OF_LINES, said
from palpate.sources.serial.port import Port
from palpate.sources.serial.source import SerialSource


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
        self.interrupt()


class Sent:
    """What comes of these lines.

    Attributes
    ----------
    samples : list of Sample
    said : list of str
        The messages.
    refused : str
        Why the last line that was not read was not, and the option that helps; empty: all were.
    failed : str
        The error with which it ended; empty: none.
    """

    def __init__(self, lines: list[str] | bytes, **options: Any) -> None:
        data = lines if isinstance(lines, bytes) else "".join(f"{line}\n" for line in lines).encode()
        given = said(checked("serial", options, _OF_LINES))
        self.source: SerialSource = SerialSource(ChunkedPort(b"\n" + data), given)
        self.said: list[str] = []
        self.source.notify = self.said.append
        self.samples: list[Sample] = []
        self.failed: str = ""
        try:
            self.samples.extend(self.source)
        except ProtocolError as error:
            self.failed = str(error)

    @property
    def refused(self) -> str:
        best = self.source._reader._strange._best
        return f"{best[1]} {best[1].option}".strip() if best else ""

    @property
    def pairs(self) -> list[tuple[float, float]]:
        """The values of the samples, pF."""
        return [(sample.hard, sample.soft) for sample in self.samples]
