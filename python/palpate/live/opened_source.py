"""The source that the page shows; a page can open another one in its place."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from pathlib import Path
from threading import Lock
from typing import NamedTuple

from palpate.live.commands import Workbench
from palpate.live.protocol import ListedRecording, RecordingsMessage, RefusedCommand
from palpate.messages import quoted
from palpate.recording.sidecar import sidecar_path

MEASURE = "measure"
DEMO = "demo"
MOST_LISTED = 8  # recordings that a page can open


class StartedSource(NamedTuple):
    """The workbench of a source that was started, and a remark for the page; "": none."""

    bench: Workbench
    remark: str


class SourceOpener(ABC):
    """Opens another source for the page.

    Attributes
    ----------
    folder : Path
        The folder whose recordings a page can open.
    """

    folder: Path = Path()

    @abstractmethod
    def source_to_measure(self, shown: str) -> str:
        """Return the source to measure, the shown one if it measures; RefusedCommand: there is none."""

    @abstractmethod
    def source_of_demo(self) -> str:
        """Return the name of the demo."""

    @abstractmethod
    def start(self, source: str, number: int) -> StartedSource:
        """Start a source; its measurement is counted from after `number`. Raises what opening it raises."""


class OpenedSource:
    """The source that the page shows, and what else the page can open.

    Attributes
    ----------
    bench : Workbench
        Of the source that is shown.
    on_changed : callable
        Called from any thread when another source is shown.
    """

    def __init__(self, bench: Workbench, opener: SourceOpener | None = None) -> None:
        self.bench = bench
        self.on_changed: Callable[[], None] = _nothing
        self._opener = opener
        self._listed: dict[str, Path] = {}
        self._opening = Lock()
        self._has_failed = False

    @property
    def failed(self) -> bool:
        """Whether a recording failed, of this source or of one before."""
        return self._has_failed or self.bench.measurement.failed

    def recordings(self) -> RecordingsMessage:
        """Return the newest recordings of the folder, the newest one first: a page can open them."""
        found: list[tuple[Path, float]] = []
        if self._opener:
            found = _newest(self._opener.folder)
        self._listed = {path.name: path for path, _ in found}
        return RecordingsMessage([ListedRecording(path.name, time) for path, time in found])

    def open(self, what: str) -> str:
        """Show another source, and close the one before; return the message.

        `what`: "measure", "demo", or the name of a listed recording. RefusedCommand if it is not
        possible; what the source raises if it cannot be opened: then the one before goes on.
        """
        with self._opening:
            before = self.bench
            remark = self._replace(what)
            if before is self.bench:
                return f"{_name_of(before)} is open already."
            self.on_changed()
            before.measurement.close()
            self._has_failed |= before.measurement.failed
        message = f"{_name_of(self.bench)} is open now."
        if remark:
            message += f" {remark}"
        return message

    def _replace(self, what: str) -> str:
        """Start another source in place of this one, unless it is the same; return a remark."""
        opener = self._opener
        if opener is None:
            raise RefusedCommand(f"open: got {quoted(what)}, allowed: nothing, only one source")
        measurement = self.bench.measurement
        source = self._source_of(what, opener)
        if source == self.bench.source:
            return ""
        # until the other one has started, nothing else may begin here
        with measurement.commands:
            if measurement.recorder:
                raise RefusedCommand("open: a recording is running; end the recording first")
            started = opener.start(source, measurement.number)
            self.bench = started.bench
        return started.remark

    def _source_of(self, what: str, opener: SourceOpener) -> str:
        if what == MEASURE:
            return opener.source_to_measure(self.bench.source)
        if what == DEMO:
            return opener.source_of_demo()
        path = self._listed.get(what)
        if path is None:
            allowed = ", ".join([MEASURE, DEMO, *self._listed])
            raise RefusedCommand(f"open: got {quoted(what)}, allowed: {allowed}")
        return str(path)

    def close(self) -> None:
        """Close the source that is shown."""
        with self._opening:
            self.bench.measurement.close()


def _name_of(bench: Workbench) -> str:
    """Return the name of a source for the page: of a recording without its folder."""
    file = bench.measurement.file
    if file:
        return file.name
    return bench.source


def _newest(folder: Path) -> list[tuple[Path, float]]:
    """Return the newest recordings of a folder with the times of their last change, s since 1970."""
    found: list[tuple[Path, float]] = []
    try:
        for path in folder.glob("*.csv"):
            if sidecar_path(path).is_file():
                found.append((path, path.stat().st_mtime))
    except OSError:  # removed meanwhile: what is found so far
        pass
    found.sort(key=_time_of, reverse=True)
    return found[:MOST_LISTED]


def _time_of(one: tuple[Path, float]) -> float:
    return one[1]


def _nothing() -> None:
    """Do nothing."""
