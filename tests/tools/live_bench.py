"""A live page without a browser: a measurement with its workbench, sources that do what no simulated board does, waiting."""

import math
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import msgspec
from palpate.live.app import PageApp
from palpate.live.commands import LiveWorkbench, Workbench
from palpate.live.connection import ConnectionState
from palpate.live.measurement import LiveMeasurement, opener
from palpate.live.opened_source import OpenedSource
from palpate.live.page_commands import BenchCommand
from palpate.live.plan import TouchPlan
from palpate.live.protocol import Answer, DoneMessage, StateMessage, StatusState
from palpate.live.run_files import RunFiles
from palpate.live.touch_rows import TouchTable
from palpate.samples import Sample
from palpate.sources import SampleSource, Source
from palpate.stream import Stream
from project import ROOT
from recording_bench import soon
from starlette.testclient import TestClient

HOST, PORT = "127.0.0.1", 8746
OWN = f"{HOST}:{PORT}"
ORIGIN = f"http://{OWN}"
SOURCE = "sim:four-specimens?seed=1"
OWN_FILE = ROOT / "tests" / "data" / "four-specimens.csv"


def answer_of(bench: Workbench, do: str, **given: object) -> Answer:
    """Return the answer to a command of a page."""
    command: BenchCommand = msgspec.convert({"do": do, **given}, BenchCommand)
    return bench.run(command)


def done(bench: Workbench, do: str, **given: object) -> DoneMessage:
    """Return the answer to a command that has a message."""
    answer = answer_of(bench, do, **given)
    assert isinstance(answer, DoneMessage)
    return answer


class Bench(LiveWorkbench):
    """A workbench of a live measurement that runs."""

    measurement: LiveMeasurement

    def obey(self, do: str, **given: object) -> str:
        """Let a page order this; return the message."""
        return done(self, do, **given).message

    def waited(self, what: str) -> StateMessage:
        """Return the first state with this word, or with a line of this kind."""
        states: list[StateMessage] = []

        def holds() -> bool:
            states.append(self.shown())
            return what in (states[-1].line.what, states[-1].now.word)

        soon(holds)
        return states[-1]

    def shown(self) -> StateMessage:
        """Look, and return the state."""
        self.look()
        return self.state()


def begun(
    source: str | Callable[..., Source],
    folder: Path,
    *,
    record: bool = True,
    lsl: str | None = None,
) -> Bench:
    """Measure in a folder, and record to run.csv; a simulation without `speed` runs in real time."""
    opened = opener(source, {}) if isinstance(source, str) else source
    files = RunFiles(folder / "run.csv" if record else None, folder)
    measurement = LiveMeasurement(opened, files, {"scene": "handheld"}, lsl=lsl)
    bench = Bench(measurement, source if isinstance(source, str) else "test:")
    measurement.start()
    return bench


def client(shown: Workbench | OpenedSource) -> TestClient:
    opened = OpenedSource(shown) if isinstance(shown, Workbench) else shown
    return TestClient(
        PageApp(opened).app(HOST, PORT),
        base_url=ORIGIN,
        headers={"host": OWN, "origin": ORIGIN},
    )


def noisy(number: int) -> tuple[float, float]:
    return 0.6 + 1e-5 * ((number * 7919) % 13), 0.4 + 1e-5 * ((number * 104729) % 11)


class Fed(SampleSource):
    """Pairs each `pause_s`; `made` gives number -> hard, soft, pF, or None: wait."""

    def __init__(
        self, made: Callable[[int], tuple[float, float] | None], pause_s: float = 0.01
    ) -> None:
        self._made, self._pause_s, self._stopped = made, pause_s, False

    def samples(self) -> Iterator[Sample]:
        """Yield the pairs."""
        begun_ns, seq = time.monotonic_ns(), 0
        while not self._stopped:
            time.sleep(self._pause_s)
            if (values := self._made(seq)) is not None:
                now = time.monotonic_ns() - begun_ns
                yield Sample(seq, now, now, -1, -1, *values)
                seq += 1

    def describe(self) -> dict[str, Any]:
        """Return name and period."""
        return {"name": "fed", "period_s": 0.01}

    def interrupt(self) -> None:
        """Stop the iteration."""
        self._stopped = True


class Played(LiveMeasurement):
    """A simulated measurement, sample by sample on its own clock, without threads: the same at each run.

    `told`: time, and each state that a page gets: five a second, and at once when word or line change.
    """

    def __init__(self, source: str, **settings: Any) -> None:
        super().__init__(lambda: None, RunFiles(), {})  # type: ignore[arg-type, return-value]
        self.stream = Stream(source, notify=lambda _: None, capacity=2, **settings)
        self.at_s = 0.0
        self.told: list[tuple[float, StatusState]] = []
        plan = TouchPlan(self)
        self.page_state = ConnectionState(
            self, plan, TouchTable(self, plan), clock=lambda: self.at_s
        )

    def play(self, until_s: float = math.inf, at: dict[float, Any] | None = None) -> "Played":
        """Play to a time or the end; `at`: what to do with the stream, by time."""
        waiting, due_s = sorted((at or {}).items()), 0.0
        for listener in self.listeners:
            self.stream.listen(listener)
        with self.stream as stream:
            for batch in stream._batches(1):
                if len(batch.samples):
                    self.at_s = float(batch.samples["t_hard_ns"][-1]) / 1e9
                if self.page_state.look() or self.at_s >= due_s:
                    self.told.append((self.at_s, self.page_state.document()))
                    due_s = self.at_s + 0.2
                while waiting and self.at_s >= waiting[0][0]:
                    waiting.pop(0)[1](stream)
                if self.at_s >= until_s:
                    return self
        self.tracker_state = replace(self.tracker_state, state="ended")
        self.page_state.look()
        self.told.append((self.at_s, self.page_state.document()))
        return self

    @property
    def course(self) -> list[tuple[str, str]]:
        """Word and line, each time that one of them changed."""
        return _changes([(document.now.word, document.line.what) for _, document in self.told])

    @property
    def announced(self) -> list[str]:
        """All announcements, in order."""
        return _changes([document.announce for _, document in self.told if document.announce])

    def first(self, what: str) -> tuple[float, StatusState]:
        """Return when a line was told first, and the state."""
        return next((at_s, document) for at_s, document in self.told if document.line.what == what)


def _changes(values: list[Any]) -> list[Any]:
    return [value for at, value in enumerate(values) if not at or value != values[at - 1]]
