"""The sidecar NAME.json of a recording: device, settings, notes, checkpoint, end. It is replaced atomically.

Its last entry is the CRC-32 of all bytes before that number, so a change of the sidecar itself is noticed.
"""

import json
import math
import platform
import time
import zlib
from collections.abc import Mapping
from datetime import datetime
from pathlib import Path
from typing import Any

from palpate._core import __version__
from palpate.errors import RecordingError
from palpate.files import file_errors, read_bytes, require_file_name, unpacked_name, write_file
from palpate.messages import quoted, shortened
from palpate.recording.rows import codes_of
from palpate.recording.session import Plan, plan_of
from palpate.samples import Sample

BEGUN = "begun after "
"""First words of the note that a recording was started later than the measurement."""
SCHEMA = "palpate-recording-2"
SCHEMAS = ("palpate-recording-1", SCHEMA)
"""Those that can be read: the first one has no checkpoint and no checksum of its own."""
LARGEST = 4_000_000
"""Bytes of a sidecar, at most."""
LONGEST_PERIOD_S = 1e6
_SUM = '"sidecar_crc32": "'


def sidecar_path(path: Path) -> Path:
    """Return the path of the sidecar of a recording; ValueError if its name is not *.csv, or no file can have it."""
    if path.suffix.lower() != ".csv":
        raise ValueError(f"record: got {path.name!r}, allowed: a name that ends in .csv")
    try:
        require_file_name(path)
    except OSError as error:
        raise ValueError(f"record: got {path.name!r}: it {error.strerror}") from error
    return path.with_suffix(".json")


def fresh(device: dict[str, Any], settings: dict[str, Any], notes: list[str]) -> dict[str, Any]:
    """Return the sidecar of a new recording."""
    # Later there are checkpoint (rows, bytes, crc32 of what is on the disk), or in its place end; in clock the time t = 0
    # (zero_utc_ns, zero_monotonic_ns, zero_utc_ns_at_end), if it is known; session (session.Plan.as_dict); conditions.
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


def made(device: dict[str, Any], rows: int, data: bytes) -> dict[str, Any]:
    """Return the sidecar of a file whose rows were computed, not measured: the same rows give the same sidecar."""
    end = {"rows": rows, "dropped": 0, "clean": True, "bytes": len(data), "crc32": zlib.crc32(data)}
    parts: dict[str, Any] = {"device": device, "settings": {}, "notes": [], "marks": [], "end": end}
    return {"schema": SCHEMA, "versions": {"palpate": __version__}, **parts}


def save(path: Path, document: dict[str, Any]) -> None:
    """Write or replace a sidecar atomically: a reader sees the old text or the new one."""
    write_file(path, text_of(document).encode())


def text_of(document: dict[str, Any]) -> str:
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


def load(path: Path) -> dict[str, Any] | None:
    """Return the sidecar of a recording, by the path of the recording; None without one; RecordingError if it is none."""
    found = load_checked(path)
    return found[0] if found else None


def load_checked(path: Path) -> tuple[dict[str, Any], bool | None] | None:
    """Return the sidecar of a recording, and whether it is as it was written (None: it has no checksum); as `load`."""
    path = path.with_name(unpacked_name(path))
    if path.suffix.lower() != ".csv" or not (beside := sidecar_path(path)).exists():
        return None
    with file_errors(beside, "cannot be read"):
        return parsed(beside, read_bytes(beside, LARGEST))


def parsed(path: Path, data: bytes) -> tuple[dict[str, Any], bool | None]:
    """Return the sidecar in the contents of a file, or in the metadata of one, as `load_checked`; RecordingError if it is none."""
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
    return document, is_intact(text)


def _require_valid(document: dict[str, Any]) -> None:
    """Raise ValueError with the first invalid one of the parts that are used in computations."""
    for name, kind in _PARTS.items():
        part: Any = document.get(name, {} if name in _OPTIONAL else None)
        if not isinstance(part, kind):
            allowed = "a list" if kind is list else "names and values"
            raise ValueError(f"{name}: got {quoted(part)}, allowed: {allowed}")  # noqa: TRY004  of a file
    full_scale = document["device"].get("full_scale_pF", math.inf)
    number: Any = (
        _INFINITE.get(full_scale, full_scale) if isinstance(full_scale, str) else full_scale
    )
    if (
        type(number) not in (int, float)
        or not number > 0
        or (type(number) is int and number >= 2**63)
    ):
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
_PARTS: dict[str, Any] = {"device": dict, "settings": dict, "notes": list, "marks": list}
_PARTS |= dict.fromkeys(_OPTIONAL, dict)


def is_simulated(device: Mapping[str, Any]) -> bool:
    """Return whether no probe was used, by what a sidecar or a source says of its device."""
    return "simulated" in device or str(device.get("name", "")).startswith("simulated")


def marked(text: str, sample: Sample | None, **more: Any) -> dict[str, Any]:
    """Return a mark at a sample, as it is in the sidecar."""
    where = {} if sample is None else {"seq": sample.seq, "t_s": sample.t_hard_ns / 1e9}
    return {**where, "text": text, **more}


def amend(path: Path, plan: Plan, known: Plan) -> None:
    """Replace what was touched in the sidecar of a recording that has ended; RecordingError if that is not possible.

    `known`: what the caller knows to be there; if it is not, another program has written it, and it stays.
    """
    found, beside = load_checked(path), sidecar_path(path)
    if found is None:
        raise RecordingError(beside, "is gone: the change of the session is in no file")
    document, intact = found
    if intact is False:  # a new checksum would hide it
        raise RecordingError(
            beside, "was changed after it was written: nothing is added; take it from a copy"
        )
    if plan_of(document) != known:
        raise RecordingError(
            beside, "was changed by another program: nothing is added; open the recording again"
        )
    document = {**document, "session": plan.as_dict()}
    if (size := len(text_of(document).encode())) > LARGEST:
        raise RecordingError(
            beside, f"would have {size:,} bytes, allowed: {LARGEST:,}: the change is in no file"
        )
    with file_errors(path, "cannot be written"):
        save(beside, document)


def zero_of(document: dict[str, Any]) -> tuple[int | None, int | None]:
    """Return UTC of t = 0, ns since 1970, as the wall clock showed it at the begin and at the end; None: unknown."""
    found = (document.get("clock", {}).get(name) for name in ("zero_utc_ns", "zero_utc_ns_at_end"))
    begin, end = (at if type(at) is int and 0 <= at < 2**63 else None for at in found)
    return begin, end


def tares_of(document: dict[str, Any]) -> list[tuple[int, str, bool]]:
    """Return the samples after which the baseline was measured again: number, what happened, whether it is before a gap."""
    tares = [mark for mark in _marks(document) if mark.get("tare") is True]
    known = [mark for mark in tares if type(mark.get("seq")) is int and 0 <= mark["seq"] < 2**63]
    return [(mark["seq"], _text_of(mark), mark.get("gap") is True) for mark in known]


def marks_of(document: dict[str, Any]) -> list[tuple[float, str]]:
    """Return all marks: time of their sample, s (nan: unknown), and text."""
    return [(_time_of(mark), _text_of(mark)) for mark in _marks(document)]


def _marks(document: dict[str, Any]) -> list[dict[str, Any]]:
    return [mark for mark in document.get("marks", []) if isinstance(mark, dict)]


def _text_of(mark: dict[str, Any]) -> str:
    return shortened(str(mark.get("text", "")), 500)


def _time_of(mark: dict[str, Any]) -> float:
    time_s: Any = mark.get("t_s")
    return float(time_s) if type(time_s) in (int, float) and abs(time_s) < 2**63 / 1e9 else math.nan


def settings_of(document: dict[str, Any]) -> dict[str, Any]:
    """Return the settings of the tracker and its scene, with inf and -inf as numbers."""
    return {
        name: _INFINITE.get(str(value), value)
        for name, value in document.get("settings", {}).items()
    }


_INFINITE = {"inf": math.inf, "-inf": -math.inf}


def _plain(value: Any) -> Any:
    """Return a value as JSON can store it: infinity becomes text, "inf" or "-inf"."""
    if isinstance(value, dict):
        return {str(name): _plain(inner) for name, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(inner) for inner in value]
    return str(value) if isinstance(value, float) and not math.isfinite(value) else value
