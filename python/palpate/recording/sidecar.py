"""The sidecar NAME.json of a recording: device, settings, notes, end. It is replaced atomically."""

import json
import math
import os
import platform
from collections.abc import Iterator
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from palpate._core import __version__
from palpate.errors import RecordingError

BEGUN = "begun after "
"""First words of the note that a recording was started later than the measurement."""
SCHEMA = "palpate-recording-1"


def sidecar_path(path: Path) -> Path:
    """Return the path of the sidecar of a recording.

    Raises
    ------
    ValueError
        The recording's name does not end in ".csv".

    Examples
    --------
    >>> sidecar_path(Path("run.csv")).name
    'run.json'
    """
    if path.suffix.lower() != ".csv":
        raise ValueError(f"record: got {path.name!r}, allowed: a name that ends in .csv")
    return path.with_suffix(".json")


def fresh(device: dict[str, Any], settings: dict[str, Any], notes: list[str]) -> dict[str, Any]:
    """Return the sidecar of a new recording."""
    return {
        "schema": SCHEMA,
        "versions": {"palpate": __version__, "python": platform.python_version(), "system": platform.system()},
        "started": datetime.now(UTC).isoformat(timespec="seconds"),
        "device": device,
        "settings": settings,
        "notes": notes,
        "marks": [],
    }


def save(path: Path, document: dict[str, Any]) -> None:
    """Write or replace a sidecar atomically: a reader sees the old text or the new one."""
    text = text_of(document) + "\n"
    beside = path.with_name(path.name + ".new")
    try:
        with beside.open("w", encoding="utf-8") as file:
            file.write(text)
            file.flush()
            os.fsync(file.fileno())
        beside.replace(path)
    except OSError:
        beside.unlink(missing_ok=True)
        raise
    _sync_folder(path.parent)


def text_of(document: dict[str, Any]) -> str:
    """Return a sidecar as JSON."""
    return json.dumps(_plain(document), indent=2, allow_nan=False, default=str)


def _sync_folder(folder: Path) -> None:
    """Sync the names in a folder to the disk, if the system can."""
    with suppress(OSError):
        opened = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(opened)
        finally:
            os.close(opened)


def load(path: Path) -> dict[str, Any] | None:
    """Return the sidecar of a recording; None without one.

    Parameters
    ----------
    path : pathlib.Path
        Path of the recording.

    Raises
    ------
    RecordingError
        The file exists, but is not a sidecar.
    """
    if path.suffix.lower() != ".csv" or not (beside := sidecar_path(path)).is_file():
        return None
    try:
        document = json.loads(beside.read_text(encoding="utf-8"))
    except (ValueError, RecursionError) as error:
        raise RecordingError(beside, f"not JSON: {error}") from error
    except OSError as error:
        raise RecordingError(beside, f"cannot be read: {error.strerror}") from error
    if not isinstance(document, dict) or document.get("schema") != SCHEMA:
        raise RecordingError(beside, f"not the sidecar of a recording: no schema {SCHEMA!r} in it")
    if wrong := next(_wrong(document), None):
        raise RecordingError(beside, f"not the sidecar of a recording: {wrong}")
    return document


def _wrong(document: dict[str, Any]) -> Iterator[str]:
    """Yield the first invalid one of the parts that are used in computations."""
    missing: dict[str, Any] = {"end": {}}
    for name, kind in {"device": dict, "settings": dict, "notes": list, "marks": list, "end": dict}.items():
        if not isinstance(document.get(name, missing.get(name)), kind):
            yield f"{name}: got {document.get(name)!r:.40}, allowed: {'a list' if kind is list else 'names and values'}"
            return
    full_scale = document["device"].get("full_scale_pF", math.inf)
    full_scale = _INFINITE.get(full_scale, full_scale) if isinstance(full_scale, str) else full_scale
    if isinstance(full_scale, bool) or not isinstance(full_scale, int | float) or not full_scale > 0:
        yield f"full_scale_pF: got {full_scale!r:.40}, allowed: above 0"


def tares_of(document: dict[str, Any]) -> frozenset[int]:
    """Return the numbers of the samples after which the baseline was measured again."""
    marks = [mark for mark in document.get("marks", []) if isinstance(mark, dict) and mark.get("tare") is True]
    return frozenset(mark["seq"] for mark in marks if isinstance(mark.get("seq"), int))


def settings_of(document: dict[str, Any]) -> dict[str, Any]:
    """Return the settings of the tracker and its scene, with inf and -inf as numbers."""
    return {name: _INFINITE.get(str(value), value) for name, value in document.get("settings", {}).items()}


_INFINITE = {"inf": math.inf, "-inf": -math.inf}


def _plain(value: Any) -> Any:
    """Return a value as JSON can store it: infinity becomes text, "inf" or "-inf"."""
    if isinstance(value, dict):
        return {str(name): _plain(inner) for name, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(inner) for inner in value]
    return str(value) if isinstance(value, float) and not math.isfinite(value) else value
