"""Other programs on Lab Streaming Layer: one that sends, and one that receives."""

import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import pylsl

PERIOD_S = 0.01


class Sender:
    """A stream as another program makes it; `more`: its kind, rate, form and manufacturer."""

    def __init__(
        self, name: str, labels: Sequence[str], units: Sequence[str] = (), **more: Any
    ) -> None:
        self.name = name
        kind = more.get("kind", "Capacitance")
        rate = more.get("rate", 0.0)
        form = more.get("form", pylsl.cf_double64)
        info = pylsl.StreamInfo(name, kind, len(labels), rate, form)
        info.desc().append_child_value("manufacturer", more.get("manufacturer", "another"))
        info.set_channel_labels(list(labels))
        info.set_channel_units(list(units or [""] * len(labels)))
        self._outlet = pylsl.StreamOutlet(info)

    def send(self, *values: float, at_s: float | None = None) -> None:
        """Send a sample, now or with a stamp."""
        self._outlet.push_sample(list(values), pylsl.local_clock() if at_s is None else at_s)

    def wait(self) -> None:
        """Wait until someone receives."""
        assert self._outlet.wait_for_consumers(30)

    def close(self) -> None:
        """End the stream."""
        del self._outlet

    @contextmanager
    def going_on(self, *values: float, after_s: float = 0.0) -> Iterator[None]:
        """Send samples, again and again, after a time."""
        stopped = threading.Event()

        def run() -> None:
            stopped.wait(after_s)
            while not stopped.wait(PERIOD_S):
                self.send(*values)

        thread = threading.Thread(target=run)
        thread.start()
        try:
            yield
        finally:
            stopped.set()
            thread.join()


class Listener:
    """Receives everything of a stream, as any program does."""

    def __init__(self, name: str, *, recover: bool = False) -> None:
        found = pylsl.resolve_byprop("name", name, 1, 30.0)
        assert len(found) == 1
        self.inlet = pylsl.StreamInlet(found[0], recover=recover)
        self.info = self.inlet.info(30.0)
        self.inlet.open_stream(30.0)
        self.rows: list[Any] = []
        self.stamps: list[float] = []

    def take(self) -> None:
        """Take what has come."""
        rows, stamps = self.inlet.pull_chunk(timeout=0.0, max_samples=10_000)
        self.rows += rows
        self.stamps += stamps


def take_all(*listeners: Listener) -> None:
    """Take until nothing has come in 12 looks: a process that stands still loses one of them."""
    quiet = 0
    while quiet < 12:
        time.sleep(0.05)
        before = sum(len(each.rows) for each in listeners)
        for each in listeners:
            each.take()
        quiet = quiet + 1 if sum(len(each.rows) for each in listeners) == before else 0
