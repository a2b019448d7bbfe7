"""XDF files of LabRecorder and other programs of the Lab Streaming Layer, by pyxdf."""

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.errors import RecordingError, listed, shortened
from palpate.extras import need
from palpate.tables.asked import Asked
from palpate.tables.choice import the_one
from palpate.tables.readers.xdf_chunks import checked
from palpate.tables.table import Column, Table

_MOST_TOLD = 3
_USUAL = "Segments and clock-segments differ"  # logged of every stream whose times are not smoothed
_LONG_UNITS = {
    "picofarad": "pF",
    "picofarads": "pF",
    "farad": "F",
    "farads": "F",
    "femtofarads": "fF",
    "microvolts": "uV",
}


def parse(path: Path, data: bytes, asked: Asked) -> Table:
    """Return the stream with the two channels; or, if no stream has two, all channels one below the other.

    Times are those of the senders, moved to the clock of the recording computer by the measured offsets. They are not
    smoothed: that would hide a lost sample. Marker streams are left out.

    Raises
    ------
    RecordingError
        Damaged, or no stream of numbers.
    ValueError
        Several streams can be meant.
    MissingExtra
        pyxdf is not installed.
    """
    pyxdf = need("pyxdf", "tables")
    whole = checked(path, data)
    if not whole.numbers:
        raise RecordingError(path, "an XDF file without a stream of numbers")
    with _logged() as log:
        try:
            streams, _ = pyxdf.load_xdf(
                BytesIO(whole.data), whole.numbers, dejitter_timestamps=False, synchronize_clocks=True
            )
        except Exception as error:  # anyone may have made the file
            raise RecordingError(
                path, f"an XDF file that is damaged: {type(error).__name__}: {error!s:.200}"
            ) from error
    if errors := [record.getMessage() for record in log if record.levelno >= logging.ERROR]:
        raise RecordingError(path, f"an XDF file that is damaged: {errors[0]:.200}")
    tables = {
        name: _table(path, name, stream) for name, stream in _named(streams).items() if len(stream["time_stamps"])
    }
    if not tables:
        raise RecordingError(path, "an XDF file without a sample of numbers")
    table = _long(path, tables) if _is_apart(tables, asked) else the_one(tables, asked, "stream")
    if not all(stream["clock_times"] for stream in streams):
        whole.notes.append("a stream without clock offsets: its times are on the clock of its sender")
    told = [record.getMessage() for record in log if not record.getMessage().endswith(_USUAL)]
    table.notes.extend([*whole.notes, *told[:_MOST_TOLD]])
    return table


def _named(streams: list[dict[str, Any]]) -> dict[str, dict[str, Any]]:
    """Return the streams by name; of several with one name, by name and number."""
    found: dict[str, dict[str, Any]] = {}
    for number, stream in enumerate(streams, 1):
        name = shortened(_text(stream["info"], "name") or "stream")
        found[f"{name} {number}" if name in found else name] = stream
    return found


def _table(path: Path, name: str, stream: dict[str, Any]) -> Table:
    times = np.asarray(stream["time_stamps"], float)
    values = np.asarray(stream["time_series"])
    columns = [Column(("time",), times, "s")]
    for index, (label, unit) in enumerate(_channels(stream["info"], values.shape[1])):
        columns.append(Column((f"{name}/{label}", label), values[:, index], unit))
    return Table(path, columns, range(1, len(times) + 1))


def _channels(info: Any, count: int) -> Iterator[tuple[str, str]]:
    """Yield label and unit of each channel, as far as the description has them."""
    described = _first(_first(info, "desc"), "channels")
    each = described.get("channel", []) if isinstance(described, dict) else []
    for index in range(count):
        one = each[index] if index < len(each) else None
        unit = _text(one, "unit")
        yield _text(one, "label") or f"channel {index + 1}", _LONG_UNITS.get(unit.lower(), unit)


def _first(tree: Any, name: str) -> Any:
    """Return the first element of this name in what pyxdf makes of XML: dicts of lists, and text."""
    found = tree.get(name) if isinstance(tree, dict) else None
    return found[0] if found else None


def _text(tree: Any, name: str) -> str:
    found = _first(tree, name)
    return found.strip() if isinstance(found, str) else ""


def _is_apart(tables: dict[str, Table], asked: Asked) -> bool:
    """Return whether the two channels are in two streams: no stream has two, or they are asked for from two."""
    if asked.part is not None or len(tables) == 1:
        return False
    if all(table.width == 2 for table in tables.values()):
        return True
    wanted = {str((asked.columns or {}).get(key, "")).strip() for key in ("hard", "soft")}
    homes = [name for name, table in tables.items() if wanted & _labels(table)]
    return len(homes) == 2 and wanted <= {label for table in tables.values() for label in _labels(table)}


def _labels(table: Table) -> set[str]:
    return {name for column in range(1, table.width) for name in table.names(column)}


def _long(path: Path, tables: dict[str, Table]) -> Table:
    """Return a table with a column of times, one of names, and one of values: channels of several streams."""
    channels = [(table, column) for table in tables.values() for column in range(1, table.width)]
    labels = [table.names(column)[-1] for table, column in channels]
    names = [
        label if labels.count(label) == 1 else table.names(column)[0]
        for (table, column), label in zip(channels, labels, strict=True)
    ]
    units = [table.columns[column].unit for table, column in channels]
    same = units[0] if len(set(units)) == 1 else ""
    if not same and any(units):
        raise ValueError(
            f"part: got streams in {listed(units)}, allowed: one unit; give the name of one stream (--part)"
        )
    values: list[NDArray[np.float64]] = [np.asarray(table.columns[column].cells) for table, column in channels]
    times = [np.asarray(table.columns[0].cells) for table, _ in channels]
    cells = [name for name, each in zip(names, values, strict=True) for _ in range(len(each))]
    columns = [
        Column(("time",), np.concatenate(times), "s"),
        Column(("channel",), cells),
        Column(("value",), np.concatenate(values), same),
    ]
    return Table(path, columns, range(1, len(cells) + 1))


@contextmanager
def _logged() -> Iterator[list[logging.LogRecord]]:
    """Collect what pyxdf logs, in place of printing it."""
    handler = _Collector(logging.WARNING)
    logger = logging.getLogger("pyxdf.pyxdf")
    before, logger.propagate = logger.propagate, False
    logger.addHandler(handler)
    try:
        yield handler.records
    finally:
        logger.removeHandler(handler)
        logger.propagate = before


class _Collector(logging.Handler):
    def __init__(self, level: int) -> None:
        super().__init__(level)
        self.records: list[logging.LogRecord] = []

    def emit(self, record: logging.LogRecord) -> None:
        self.records.append(record)
