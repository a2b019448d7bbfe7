"""The commands of a page: one table of names, and who obeys; and the workbench, whose parts obey."""

import json
from collections.abc import Callable, Collection
from contextlib import nullcontext
from pathlib import Path
from typing import Any

from palpate.calibration import Calibration
from palpate.flags import advice
from palpate.live.calibration_fit import GuidedCalibration
from palpate.live.compare import compared
from palpate.live.connection_state import ConnectionState
from palpate.live.device import Device
from palpate.live.events import Events
from palpate.live.feed import Document, RefusedCommand
from palpate.live.measurement import AnyMeasurement, RecordedMeasurement
from palpate.live.plan import TouchPlan
from palpate.live.source_watch import SourceWatch
from palpate.live.specimen_check import SpecimenCheck
from palpate.live.state_rules import file_state
from palpate.live.touch_rows import TouchTable
from palpate.messages import quoted
from palpate.uncertainty import TOUCH_SCATTER

LONGEST = 32768  # bytes of a message
LONGEST_TEXT = 4000  # characters of a text: a list of specimens; a note and a name have less


def parse(message: str) -> tuple[str, Document]:
    """Return the command of a message and its values, or raise `RefusedCommand`: what does not fit goes to no file.

    Examples
    --------
    >>> parse('{"do": "note", "text": "second specimen"}')
    ('note', {'text': 'second specimen'})
    >>> parse('{"do": "format the disk"}')  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    palpate.live.feed.RefusedCommand: do: got 'format the disk', allowed: tare, tare anyway, ...
    """
    given = json.loads(message)
    do = given.pop("do", None)
    if do not in COMMANDS:
        raise RefusedCommand(f"do: got {quoted(do)}, allowed: {', '.join(COMMANDS)}")
    for name, text in given.items():
        if isinstance(text, str):
            lines = text.replace("\t", " ").splitlines()
            if len(text) > LONGEST_TEXT or not all(line.isprintable() for line in lines):
                allowed = f"up to {LONGEST_TEXT} characters that can be shown"
                raise RefusedCommand(f"{name}: got {quoted(text)}, allowed: {allowed}")
    return do, given


class Workbench:
    """What a page shows and may order; made before the measurement starts, which it does not close.

    `scatter`: relative scatter from touch to touch without a calibration, for whether touches agree, and for the uncertainty.
    `accept`: what is accepted of the calibration, of `palpate.calibration.origin.AcceptedOrigin`.
    """

    def __init__(
        self,
        measurement: AnyMeasurement,
        source: str,
        calibration: Calibration | None = None,
        scatter: float = TOUCH_SCATTER,
        calibration_file: Path | None = None,
        accept: Collection[str] = (),
    ) -> None:
        self.measurement: AnyMeasurement = measurement
        measurement.files.calibration = calibration_file
        measurement.files.accept = tuple(accept)
        plan = TouchPlan(measurement, calibration)
        table = self._table = TouchTable(measurement, plan, scatter)
        self.documents: dict[str, Callable[[], Document]] = {
            "hello": lambda: table.hello(source),
            "touches": table.document,
            "events": Events(measurement).document,
            "session": lambda: plan.document,
        }
        self._parts: dict[str, object] = {"bench": self, "files": measurement.files, "plan": plan}
        if isinstance(measurement, RecordedMeasurement):
            self._shown: Callable[[], Document] = lambda: file_state(measurement.file)
            self.is_news: Callable[[], bool] = lambda: False
            return
        watch = SourceWatch(measurement, plan, accept)
        state = ConnectionState(measurement, plan, table, watch=watch)
        self._shown, self.is_news = state.document, state.is_news
        device = Device(measurement, state, source)
        guided = GuidedCalibration(measurement, plan, watch)
        check = SpecimenCheck(measurement, plan, watch)
        self.documents |= {
            "device": device.document,
            "calibration": guided.document,
            "verification": check.document,
        }
        self._parts |= {
            "measurement": measurement,
            "state": state,
            "device": device,
            "calibration": guided,
            "check": check,
        }

    def state(self) -> Document:
        """Return the values that change during a measurement."""
        return {**self._table.now(), **self.measurement.recording_state(), **self._shown()}

    def do(self, do: str, /, **given: Any) -> Document:
        """Obey a command of a page; return the answer. May wait for the disk.

        Raises `RefusedCommand` if it is not possible now, or not here; and what `Stream` raises.
        """
        part = COMMANDS[do]
        if part not in self._parts:
            raise RefusedCommand(f"{do}: this is a recording, nothing is measured")
        # What takes seconds, and changes nothing that another command needs, is not waited for.
        with nullcontext() if part in ("bench", "files") else self.measurement.commands:
            answer = getattr(self._parts[part], do.replace(" ", "_"))(**given)
        return answer if isinstance(answer, dict) else {"message": answer}

    def compare(self) -> Document:
        """Return the recordings to compare, beside each other."""
        return compared(self.measurement.files.compared(), self._table.calibration)

    def cut(self, from_s: float, to_s: float) -> str:
        """Estimate the part of a recording between two times as a touch; return the result, or why there is none."""
        if not isinstance(self.measurement, RecordedMeasurement):
            raise RefusedCommand("cut: got it in a measurement, allowed: in a recording")
        try:
            touch = self.measurement.cut(from_s, to_s)
        except ValueError as error:
            return str(error)
        return "; ".join(
            [
                f"A to B: {self._table.result(touch)}, {touch.samples} samples",
                *map(str, advice(touch)),
            ]
        )


_PARTS = {
    "measurement": ("tare", "tare anyway", "record", "stop", "again", "mark", "mark text"),
    "state": ("understood",),
    "device": ("centre", "device"),
    "plan": ("plan", "read list", "specimen", "assign", "name", "discard", "keep", "more", "note"),
    "calibration": ("calibrating", "save calibration"),
    "check": ("verify",),
    "bench": ("compare", "cut"),
    "files": ("report", "stop report", "settings"),
    "page": ("noise", "view"),
}
COMMANDS = {do: part for part, every in _PARTS.items() for do in every}
"""Who obeys a command, with a method of its name. `page`: the page that sends it; the other parts are those of the workbench."""
