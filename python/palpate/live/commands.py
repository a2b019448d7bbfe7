"""The commands of a page: one table of names, checks of values, and who obeys; and the workbench, whose parts obey."""

import json
from collections.abc import Callable
from contextlib import nullcontext, suppress
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple, NoReturn

from palpate.calibration import Calibration
from palpate.live.calibration_fit import GuidedCalibration
from palpate.live.compare import compared
from palpate.live.connection_state import ConnectionState
from palpate.live.device import Device
from palpate.live.events import Events
from palpate.live.feed import Document, RefusedCommand
from palpate.live.levels import ROWS
from palpate.live.measurement import LiveMeasurement, RecordedMeasurement
from palpate.live.plan import TouchPlan
from palpate.live.state_rules import file_state
from palpate.live.touch_rows import TouchTable
from palpate.sentences import advice
from palpate.several import TOUCH_SCATTER
from palpate.sources.options import Check, choice, number, yes_no

LONGEST = 32768  # bytes of a message
LONGEST_TEXT = 200  # characters of a mark, a name, a note
LONGEST_PLAN = 4000  # characters of a list of specimens
FEWEST_ROWS = 16  # of a view
LARGEST_S = 1e12


class Order(NamedTuple):
    """Who obeys a command, as part.method, and the check of each value; with a question mark: may be left out."""

    obeys: str
    values: dict[str, Check] = {}  # noqa: RUF012  never changed


def parse(message: str) -> tuple[str, Document]:
    """Return the command of a message and its checked values, or raise `RefusedCommand`.

    Examples
    --------
    >>> parse('{"do": "note", "text": "second specimen"}')
    ('note', {'text': 'second specimen'})
    >>> parse('{"do": "format the disk"}')  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    palpate.live.feed.RefusedCommand: do: got 'format the disk', allowed: tare, tare anyway, ...
    """
    try:
        given = json.loads(message)
    except (ValueError, RecursionError):
        _refuse("message", message, "JSON")
    if not isinstance(given, dict):
        _refuse("message", given, 'an object, for example {"do": "tare"}')
    do = given.pop("do", None)
    if not isinstance(do, str) or do not in COMMANDS:
        _refuse("do", do, ", ".join(COMMANDS))
    checked: Document = {}
    for name, check in COMMANDS[do].values.items():
        bare = name.rstrip("?")
        if bare in given or bare == name:
            try:
                checked[bare] = check(bare, given.pop(bare, None))
            except ValueError as error:
                raise RefusedCommand(str(error)) from error
    if given:
        _refuse("message", min(given), f"no further names for {do}")
    return do, checked


class Workbench:
    """What a page shows and may order; made before the measurement starts, which it does not close.

    `scatter`: relative scatter from touch to touch without a calibration, for whether touches agree, and for the uncertainty.
    """

    def __init__(
        self,
        measurement: LiveMeasurement | RecordedMeasurement,
        source: str,
        calibration: Calibration | None = None,
        scatter: float = TOUCH_SCATTER,
        calibration_file: Path | None = None,
    ) -> None:
        self.measurement: LiveMeasurement | RecordedMeasurement = measurement
        self._calibration_file = calibration_file
        self._head: Document = {}  # of reports
        plan = self._plan = TouchPlan(measurement, calibration)
        table = self._table = TouchTable(measurement, plan, scatter)
        events = Events(measurement)
        self.documents: dict[str, Callable[[], Document]] = {
            "hello": lambda: table.hello(source),
            "touches": table.document,
            "events": events.document,
            "session": lambda: plan.document,
        }
        self._parts: dict[str, object] = {"bench": self}
        if isinstance(measurement, RecordedMeasurement):
            self._shown: Callable[[], Document] = lambda: file_state(measurement.file)
            self.is_news: Callable[[], bool] = lambda: False
            self._parts["plan"] = plan
            return
        state = ConnectionState(measurement, plan, table.result, known=table.known)
        self._shown, self.is_news = state.document, state.is_news
        device = Device(measurement, state, source)
        guided = GuidedCalibration(
            plan.known,
            measurement.files,
            self._use,
            lambda: (measurement.newest_recorder, measurement.how),
            lambda: plan.progress.next,
            self._finish,
        )
        self.documents |= {"device": device.document, "calibration": guided.document}
        self._parts |= {"measurement": measurement, "state": state, "events": events, "plan": plan, "device": device}
        self._parts["calibration"] = guided

    def state(self) -> Document:
        """Return the values that change during a measurement."""
        return {**self._table.now(), **self.measurement.recording_state(), **self._shown()}

    def do(self, do: str, /, **given: Any) -> Document:
        """Obey a command of a page; return the answer. May wait for the disk.

        Raises `RefusedCommand` if it is not possible now, or not here; and what `Stream` raises.
        """
        part, _, name = COMMANDS[do].obeys.partition(".")
        if part not in self._parts:
            raise RefusedCommand(f"{do}: this is a recording, nothing is measured")
        # A report takes seconds, and changes nothing that another command needs.
        with nullcontext() if part == "bench" else self.measurement.commands:
            answer = getattr(self._parts[part], name)(**given)
        return answer if isinstance(answer, dict) else {"message": answer}

    def settle(self, **head: Any) -> str:
        """Take the settings of later reports: arguments of `palpate.report.write`."""
        self._head = head
        return ""

    def report(self) -> Document:
        """Write a report of the newest recording."""
        return self.measurement.files.report(self._calibration_file, self._head)

    def _finish(self) -> None:
        self.do("save calibration")
        with suppress(RefusedCommand):  # nothing is recorded
            self.report()

    def stop_report(self) -> str:
        """Stop the report that is written; return the message."""
        return self.measurement.files.stop_report()

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
        return "; ".join([f"A to B: {self._table.result(touch)}, {touch.samples} samples", *advice(touch)])

    def _use(self, calibration: Calibration, path: Path) -> None:
        self._plan.progress.calibration, self._calibration_file = calibration, path
        said = f"moduli are from {path.name} from here on"
        self._plan.note(said)
        if isinstance(self.measurement, LiveMeasurement):
            self.measurement.use(calibration.for_tracking(self.measurement.how), said)


def _text(most: int, least: int = 1, *, lines: bool = False) -> Check:
    def check(name: str, text: Any) -> str:
        parts = text.replace("\t", " ").splitlines() if lines and isinstance(text, str) else [text]
        known = isinstance(text, str) and least <= len(text.strip()) <= most
        if not known or not all(part.isprintable() for part in parts):
            _refuse(name, text, f"{least} to {most} {'characters in lines' if lines else 'printable characters'}")
        return str(text) if lines else str(text).strip()

    return check


def _refuse(name: str, value: Any, allowed: str) -> NoReturn:
    raise RefusedCommand(f"{name}: got {value!a:.60}, allowed: {allowed}")


def _ids(name: str, value: Any) -> list[int]:
    if not isinstance(value, list) or not all(type(one) is int for one in value):
        _refuse(name, value, "a list of numbers")
    return value


_whole = partial(number, whole=True)
_ID, _SECONDS = _whole(0, 2**32 - 1), number(-LARGEST_S, LARGEST_S)
_NAME, _MAYBE = _text(LONGEST_TEXT), _text(LONGEST_TEXT, 0)
_LIST = _text(LONGEST_PLAN, 0, lines=True)
_UNIT = choice("MPa", "kPa")
_PLAN = {"text": _LIST, "wanted": _whole(1, 99), "unit?": _UNIT, "title?": _MAYBE, "operator?": _MAYBE}
_HEAD = {"unit?": _UNIT, "shore?": yes_no, "probe?": _MAYBE, "site?": _MAYBE, "operator?": _MAYBE}
_VIEW = {"id": _ID, "from_s": _SECONDS, "to_s": _SECONDS, "rows": _whole(FEWEST_ROWS, ROWS)}

COMMANDS: dict[str, Order] = {
    "tare": Order("events.tare"),
    "tare anyway": Order("events.tare_anyway"),
    "record": Order("measurement.record", {"name?": _NAME}),
    "stop": Order("measurement.stop"),
    "again": Order("measurement.again"),
    "understood": Order("state.understood"),
    "mark": Order("events.mark"),
    "mark text": Order("events.mark_text", {"id": _ID, "text": _MAYBE}),
    "note": Order("plan.note", {"text": _NAME}),
    "centre": Order("device.centre"),
    "device": Order("device.set", {"capf?": _whole(0, 7), "excitation?": _NAME}),
    "plan": Order("plan.set_list", _PLAN),
    "read list": Order("plan.read", {"text": _LIST, "unit?": _UNIT}),
    "specimen": Order("plan.choose", {"name": _MAYBE}),
    "assign": Order("plan.assign", {"touch": _ID, "name": _MAYBE}),
    "discard": Order("plan.discard", {"touch": _ID}),
    "keep": Order("plan.keep", {"touch": _ID}),
    "name": Order("plan.name", {"touches": _ids, "text": _MAYBE}),
    "more": Order("plan.more"),
    "calibrating": Order("calibration.switch", {"on": yes_no}),
    "save calibration": Order("calibration.save", {"name?": _NAME}),
    "report": Order("bench.report"),
    "stop report": Order("bench.stop_report"),
    "compare": Order("bench.compare"),
    "settings": Order("bench.settle", _HEAD),
    "cut": Order("bench.cut", {"from_s": _SECONDS, "to_s": _SECONDS}),
    "noise": Order("page.noise"),
    "view": Order("page.look", _VIEW),
}
"""`page`: the page that sends the command; the other ones are parts of the workbench."""
