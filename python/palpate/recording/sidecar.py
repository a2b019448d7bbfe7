"""The sidecar NAME.json of a recording: device, settings, notes, end; replaced atomically.

Its last entry is the CRC-32 of all bytes before that number, so a change of the sidecar itself is
noticed.
"""

import json
import math
import platform
import time
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

from palpate._core import __version__
from palpate.errors import RecordingError
from palpate.files import (
    Json,
    file_errors,
    read_bytes,
    require_file_name,
    unpacked_name,
    write_file,
)
from palpate.messages import quoted, shortened
from palpate.recording.earlier_settings import renamed
from palpate.recording.rows import codes_of
from palpate.recording.session import Plan, plan_of
from palpate.samples import Sample

BEGUN = "begun after "
"""First words of the note that a recording was started later than the measurement."""
SCHEMA = "palpate-recording-2"
SCHEMAS = ("palpate-recording-1", SCHEMA)
"""Schemas that can be read: the first one has no checkpoint and no checksum of its own."""
LARGEST = 4_000_000
"""Bytes of a sidecar, at most."""
LONGEST_PERIOD_S = 1e6
_SUM = '"sidecar_crc32": "'


def sidecar_path(path: Path) -> Path:
    """Return the path of the sidecar of a recording; ValueError: not a possible name *.csv."""
    if path.suffix.lower() != ".csv":
        raise ValueError(f"record: got {path.name!r}, allowed: a name that ends in .csv")
    try:
        require_file_name(path)
    except OSError as error:
        raise ValueError(f"record: got {path.name!r}: it {error.strerror}") from error
    return path.with_suffix(".json")


def fresh(device: Json, settings: Json, notes: list[str]) -> Json:
    """Return the sidecar of a new recording."""
    # Later it has checkpoint (rows, bytes, crc32 of the data on the disk), replaced by end; in
    # clock the time t = 0 (zero_utc_ns, zero_monotonic_ns, zero_utc_ns_at_end), if it is known;
    # session (session.Plan.as_dict); conditions.
    return {
        "schema": SCHEMA,
        "versions": {
            "palpate": __version__,
            "python": platform.python_version(),
            "system": platform.system(),
        },
        "started": datetime.now().astimezone().isoformat(timespec="seconds"),
        "clock": {"started_utc_ns": time.time_ns()},
        "device": device,
        "settings": settings,
        "notes": notes,
        "marks": [],
    }


def made(device: Json, rows: int, data: bytes) -> Json:
    """Return the sidecar of computed rows: the same rows give the same sidecar."""
    end = {"rows": rows, "dropped": 0, "clean": True, "bytes": len(data), "crc32": zlib.crc32(data)}
    parts: Json = {"device": device, "settings": {}, "notes": [], "marks": [], "end": end}
    return {"schema": SCHEMA, "versions": {"palpate": __version__}, **parts}


def save(path: Path, document: Json) -> None:
    """Write or replace a sidecar atomically: a reader sees the old text or the new one."""
    write_file(path, text_of(document).encode())


def text_of(document: Json) -> str:
    """Return a sidecar as JSON, with its checksum."""
    text = json.dumps(
        {**_plain(document), "sidecar_crc32": ""}, indent=2, allow_nan=False, default=str
    )
    body = text[: text.rindex(_SUM) + len(_SUM)]
    return f'{body}{zlib.crc32(body.encode()):08x}"\n}}\n'


def is_intact(text: str) -> bool | None:
    """Return whether a sidecar is as it was written; None for one that never had a checksum."""
    body, found, end = text.rpartition(_SUM)
    if not found:
        return None if f'"{SCHEMAS[0]}"' in text else False
    return end == f'{zlib.crc32((body + found).encode()):08x}"\n}}\n'


def load(path: Path) -> Json | None:
    """Return the sidecar of a recording as JSON, or None; RecordingError if it is invalid."""
    found = load_checked(path)
    return dict(found.entries) if found else None


def load_checked(path: Path) -> "Sidecar | None":
    """Return the sidecar of a recording with its checksum compared; as `load`."""
    path = path.with_name(unpacked_name(path))
    if path.suffix.lower() != ".csv" or not (beside := sidecar_path(path)).exists():
        return None
    with file_errors(beside, "cannot be read"):
        return parsed(beside, read_bytes(beside, LARGEST))


def parsed(path: Path, data: bytes) -> "Sidecar":
    """Return the sidecar in the bytes of a file; RecordingError if they are not valid."""
    try:
        text = data.decode()
        document = json.loads(text)
        _plain(document)  # nested too deeply to be written again: refused, too
    except (ValueError, RecursionError) as error:
        raise RecordingError(path, f"not JSON: {error}") from error
    if not isinstance(document, dict) or document.get("schema") not in SCHEMAS:
        raise RecordingError(
            path, f"not the sidecar of a recording: no schema {' or '.join(SCHEMAS)} in it"
        )
    try:
        _require_valid(document)
    except ValueError as error:
        raise RecordingError(path, f"not the sidecar of a recording: {error}") from error
    document.pop("sidecar_crc32", None)
    return Sidecar(document, is_intact(text))


def _require_valid(document: Json) -> None:
    """Raise ValueError with the first invalid one of the parts that are used in computations."""
    for name, kind in _PARTS.items():
        part: Any = document.get(name, {} if name in _OPTIONAL else None)
        if not isinstance(part, kind):
            allowed = "a list" if kind is list else "names and values"
            raise ValueError(f"{name}: got {quoted(part)}, allowed: {allowed}")  # noqa: TRY004  of a file
    full_scale = document["device"].get("full_scale_pF", math.inf)
    number: Any = full_scale
    if isinstance(full_scale, str):
        number = _INFINITE.get(full_scale, full_scale)
    is_number = type(number) is float or (type(number) is int and number < 2**63)
    if not is_number or not number > 0:
        raise ValueError(
            f"full_scale_pF: got {quoted(full_scale)}, allowed: above 0, a number of 64 bits or inf"
        )
    for part, name in (("settings", "period"), ("device", "period_s")):
        period = document[part].get(name, 0)
        if type(period) not in (int, float) or not 0 <= period <= LONGEST_PERIOD_S:
            raise ValueError(f"{name}: got {quoted(period)}, allowed: 0 to {LONGEST_PERIOD_S:g}, s")
    codes_of(document["device"])
    plan_of(document)


_OPTIONAL = ("clock", "session", "checkpoint", "end")
_PARTS: Json = {"device": dict, "settings": dict, "notes": list, "marks": list}
_PARTS |= dict.fromkeys(_OPTIONAL, dict)


def is_simulated(device: Mapping[str, Any]) -> bool:
    """Return whether the description of a device is of a simulator: no probe was used."""
    return "simulated" in device or str(device.get("name", "")).startswith("simulated")


def amend(path: Path, plan: Plan, known: Plan) -> None:
    """Replace the session in the sidecar of a recording that has ended.

    Parameters
    ----------
    path : pathlib.Path
        The recording.
    plan, known : Plan
        The new session; the session that the caller expects in the file.

    Raises
    ------
    RecordingError
        The sidecar is missing, was changed by another program, would be too large, or cannot be
        written.
    """
    found = load_checked(path)
    beside = sidecar_path(path)
    if found is None:
        raise RecordingError(beside, "is gone: the change of the session is in no file")
    if found.intact is False:  # a new checksum would hide it
        raise RecordingError(
            beside, "was changed after it was written: nothing is added; take it from a copy"
        )
    if found.session != known:
        raise RecordingError(
            beside, "was changed by another program: nothing is added; open the recording again"
        )
    document = {**found.entries, "session": plan.as_dict()}
    size = len(text_of(document).encode())
    if size > LARGEST:
        raise RecordingError(
            beside, f"would have {size:,} bytes, allowed: {LARGEST:,}: the change is in no file"
        )
    with file_errors(path, "cannot be written"):
        save(beside, document)


@dataclass(frozen=True)
class Seal:
    """Size and checksum of a recording's first rows, by its sidecar; None: not in it."""

    rows: int | None = None
    bytes: int | None = None
    crc32: int | None = None


@dataclass(frozen=True)
class RecordingEnd:
    """The end of a recording, which its sidecar has after the recorder closed it, or after a repair.

    Attributes
    ----------
    rows, dropped : object
        Rows written, and samples that are in no file; numbers, if nothing else has changed the
        sidecar.
    clean : bool
        Whether the recorder wrote all samples.
    error : str or None
        Error that ended the source or the recorder.
    repaired : str or None
        What a repair has removed; None: no repair.
    verified : int or None
        Rows whose checksum was right before a repair or a conversion; None: all.
    doubts : tuple of str
        Doubts from before a repair or a conversion.
    """

    rows: object
    dropped: object
    clean: bool
    error: str | None
    repaired: str | None
    verified: int | None
    doubts: tuple[str, ...]


MarkKind = Literal["mark", "tare", "gap"]


@dataclass(frozen=True)
class SidecarMark:
    """A mark of a recording: a text at a sample, or at a time.

    Attributes
    ----------
    seq : int
        Number of the sample; -1: unknown.
    t_s : float
        Its time, s; nan: unknown.
    text : str
    kind : str
        "mark", "tare" (the baseline was measured again), or "gap" (it became invalid).
    """

    seq: int
    t_s: float
    text: str
    kind: MarkKind = "mark"

    @classmethod
    def at(cls, sample: Sample | None, text: str, kind: MarkKind = "mark") -> "SidecarMark":
        """Return a mark at a sample; None: before the first one."""
        if sample is None:
            return cls(-1, math.nan, text, kind)
        return cls(sample.seq, sample.t_hard_ns / 1e9, text, kind)

    def as_dict(self) -> Json:
        """Return the entry of the sidecar."""
        entry: Json = {}
        if self.seq >= 0:
            entry["seq"] = self.seq
        if not math.isnan(self.t_s):
            entry["t_s"] = self.t_s
        entry["text"] = self.text
        if self.kind != "mark":
            entry["tare"] = True
        if self.kind == "gap":
            entry["gap"] = True
        return entry


@dataclass(frozen=True)
class Sidecar:
    """The sidecar of a recording: its JSON entries, which stay as they are, and typed views of them.

    Attributes
    ----------
    entries : mapping
        The JSON object; empty without a valid sidecar.
    intact : bool or None
        Whether it is as it was written; None: it has no checksum.

    Examples
    --------
    >>> Sidecar().session == Plan(), Sidecar().marks, bool(Sidecar().entries)
    (True, (), False)
    """

    entries: Mapping[str, Any] = field(default_factory=dict)
    intact: bool | None = None

    @property
    def device(self) -> Mapping[str, Any]:
        """Description of the instrument, from `Source.describe`."""
        return self._part("device")

    @property
    def is_simulated(self) -> bool:
        """Whether no probe was used."""
        return is_simulated(self.device)

    @property
    def settings(self) -> Json:
        """Scene and settings of the tracker by today's names, with inf and -inf as numbers."""
        settings = self._part("settings")
        numbers = {name: _INFINITE.get(str(value), value) for name, value in settings.items()}
        return renamed(numbers)

    @property
    def versions(self) -> Mapping[str, Any]:
        """Versions of the programs that recorded."""
        return self._part("versions")

    @property
    def started(self) -> str:
        """Begin of the program that recorded, ISO 8601; or any other text."""
        return str(self.entries.get("started"))

    @property
    def conditions(self) -> Sequence[Any]:
        """Conditions that the source measured, one object each."""
        conditions: Sequence[Any] = self.entries.get("conditions", [])
        return conditions

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes, as texts."""
        return tuple(map(str, self.entries.get("notes", [])))

    @cached_property
    def marks(self) -> tuple[SidecarMark, ...]:
        """All marks, in the order in which they were made."""
        found = self.entries.get("marks", [])
        return tuple(_mark(mark) for mark in found if isinstance(mark, dict))

    @property
    def tares(self) -> tuple[SidecarMark, ...]:
        """The tares and gaps whose sample is known."""
        return tuple(mark for mark in self.marks if mark.kind != "mark" and mark.seq >= 0)

    @cached_property
    def session(self) -> Plan:
        """The session: specimens, and which touch is on which of them; empty without one."""
        return plan_of(self.entries)

    @property
    def zero_utc_ns(self) -> int | None:
        """UTC of t = 0, ns since 1970, by the wall clock at the beginning; None: unknown."""
        return _stamp(self._part("clock").get("zero_utc_ns"))

    @property
    def zero_utc_ns_at_end(self) -> int | None:
        """UTC of t = 0, ns since 1970, by the wall clock at the end; None: unknown."""
        return _stamp(self._part("clock").get("zero_utc_ns_at_end"))

    @cached_property
    def end(self) -> RecordingEnd | None:
        """The end of the recording; None without one."""
        end = self._part("end")
        if not end:
            return None
        doubts = end.get("doubts", [])
        return RecordingEnd(
            rows=end.get("rows"),
            dropped=end.get("dropped"),
            clean=bool(end.get("clean")),
            error=str(end["error"]) if end.get("error") else None,
            repaired=str(end["repaired"]) if "repaired" in end else None,
            verified=_count(end.get("verified")),
            doubts=tuple(map(str, doubts if isinstance(doubts, list) else [doubts])),
        )

    @property
    def has_checkpoint(self) -> bool:
        """Whether it has a checkpoint of a recording that has not ended."""
        return bool(self._part("checkpoint"))

    @property
    def seal(self) -> Seal:
        """Rows, bytes and checksum of the end, or else of the last checkpoint."""
        part = self._part("end") or self._part("checkpoint")
        return Seal(*(_count(part.get(name)) for name in ("rows", "bytes", "crc32")))

    @property
    def is_of_this_version(self) -> bool:
        """Whether it has the newest schema, whose end always has a checksum."""
        return bool(self.entries["schema"] == SCHEMA)

    def _part(self, name: str) -> Mapping[str, Any]:
        part: Mapping[str, Any] = self.entries.get(name, {})
        return part


def _count(value: object) -> int | None:
    return value if type(value) is int and value >= 0 else None


def _stamp(value: object) -> int | None:
    """Return a number of 64 bits, 0 or more, or None."""
    number = _count(value)
    return number if number is not None and number < 2**63 else None


def _mark(mark: Json) -> SidecarMark:
    """Return a mark; unknown is what another program may have changed."""
    time_s = mark.get("t_s", math.nan)
    if type(time_s) not in (int, float) or not abs(time_s) < 2**63 / 1e9:
        time_s = math.nan
    kind: MarkKind = "mark"
    if mark.get("tare") is True:
        kind = "gap" if mark.get("gap") is True else "tare"
    seq = _stamp(mark.get("seq"))
    text = shortened(str(mark.get("text", "")), 500)
    return SidecarMark(-1 if seq is None else seq, float(time_s), text, kind)


_INFINITE = {"inf": math.inf, "-inf": -math.inf}


def _plain(value: Any) -> Any:
    """Return a value as JSON can store it: infinity becomes text, "inf" or "-inf"."""
    if isinstance(value, dict):
        return {str(name): _plain(inner) for name, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(inner) for inner in value]
    return str(value) if isinstance(value, float) and not math.isfinite(value) else value
