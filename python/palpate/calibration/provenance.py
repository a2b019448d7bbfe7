"""Provenance of a calibration: when, by whom, and from which probe, chip and files it was made."""

import hashlib
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Self

from palpate.files import Json, open_regular
from palpate.messages import printable, quoted, shortened, unlike
from palpate.recording.sidecar import Sidecar

LONGEST_TEXT = 200
"""Most characters of probe, operator and site, and of the fingerprint of a chip."""
MANY_FILES = 10_000
_TIME = "%Y-%m-%d %H:%M:%S UTC"
_PART = 1 << 20  # bytes that are hashed at a time
_DIGITS = 64  # of a SHA-256
_FILE_NAMES = ("name", "bytes", "sha256")
_NAMES = {
    "date": "date",
    "measured": "date of the touches",
    "probe": "probe",
    "operator": "operator",
    "site": "site",
    "files": "files",
    "chips": "chip",
    "simulated": "whether the touches are simulated",
}
"""The fields, and their names in a sentence."""
OF_THE_COMMAND = ("probe", "operator", "site")
"""Fields that have an option of `palpate calibrate`."""


@dataclass(frozen=True)
class FileChecksum:
    """A file, and the SHA-256 of its first bytes.

    Attributes
    ----------
    name : str
        Without the folder.
    bytes : int
        How many bytes the checksum is of: the size of the file. A recording that goes on becomes
        longer, but its first bytes stay.
    sha256 : str
        64 hexadecimal digits.

    Raises
    ------
    ValueError
        A field is not of this kind.

    Examples
    --------
    >>> FileChecksum.of(Path("tests/data/four-specimens.csv")).bytes
    81118
    """

    name: str
    bytes: int
    sha256: str

    def __post_init__(self) -> None:
        """Check the fields."""
        _require_text("name", self.name)
        if type(self.bytes) is not int or self.bytes < 0:
            raise ValueError(f"bytes: got {quoted(self.bytes)}, allowed: a whole number, 0 or more")
        is_text = isinstance(self.sha256, str) and len(self.sha256) == _DIGITS
        if not is_text or not set(self.sha256) <= set("0123456789abcdef"):
            allowed = f"{_DIGITS} digits, 0 to 9 and a to f"
            raise ValueError(f"sha256: got {quoted(self.sha256)}, allowed: {allowed}")

    @classmethod
    def of(cls, path: Path, most: int | None = None) -> Self:
        """Return the checksum of a file as it is now, of its first `most` bytes; default: all.

        OSError: it cannot be read.
        """
        digest = hashlib.sha256()
        done = 0
        with open_regular(path) as file:
            size = os.fstat(file.fileno()).st_size
            if most is not None:
                size = min(size, most)
            while part := file.read(min(_PART, size - done)):
                digest.update(part)
                done += len(part)
        return cls(_text_of_name(path), done, digest.hexdigest())

    @classmethod
    def of_table(cls, table: object) -> Self:
        """Return the entry of a calibration file; ValueError: it is not one."""
        known = _known_keys("files", table, _FILE_NAMES)
        for name in _FILE_NAMES:
            if name not in known:
                raise ValueError(f"files: got no {name}, allowed: one in each")
        return cls(**known)

    def is_of(self, path: Path) -> bool:
        """Return whether a file begins with these bytes; OSError: it cannot be read."""
        found = FileChecksum.of(path, self.bytes)
        return (found.bytes, found.sha256) == (self.bytes, self.sha256)

    def as_dict(self) -> dict[str, str | int]:
        """Return the entry of a calibration file."""
        return {"name": self.name, "bytes": self.bytes, "sha256": self.sha256}


@dataclass(frozen=True)
class Provenance:
    """Where a calibration comes from; what is not known is empty or None.

    Attributes
    ----------
    date : datetime.datetime or None
        When it was made, UTC.
    measured : datetime.datetime or None
        When the first of its touches was recorded, UTC, as far as the recordings state it.
    probe, operator, site : str
        Up to 200 characters.
    files : tuple of FileChecksum
        The recordings, their sidecars, and the table of moduli.
    chips : tuple of str
        Fingerprints of the chips that measured: their gains from the factory.
    simulated : bool or None
        Whether a simulator made the touches.

    Raises
    ------
    ValueError
        A field is not of this kind.

    Examples
    --------
    >>> made = Provenance(date=datetime(2026, 11, 29, tzinfo=UTC), probe="B2", simulated=False)
    >>> for line in made.lines():
    ...     print(line)
    calibrated: 2026-11-29 00:00:00 UTC, from 0 files
    probe: B2; touches: measured with a probe; not stated: date of the touches, operator, site, files, chip
    >>> Provenance.of_table(made.as_dict()) == made
    True
    """

    date: datetime | None = None
    measured: datetime | None = None
    probe: str = ""
    operator: str = ""
    site: str = ""
    files: tuple[FileChecksum, ...] = ()
    chips: tuple[str, ...] = ()
    simulated: bool | None = None

    def __post_init__(self) -> None:
        """Check the fields."""
        for name, at in {"date": self.date, "measured": self.measured}.items():
            _require_utc(name, at)
        for name, text in self._texts().items():
            _require_text(name, text)
        for chip in self.chips:
            _require_text("chips", chip)
        if len(self.files) > MANY_FILES:
            raise ValueError(f"files: got {len(self.files)}, allowed: up to {MANY_FILES}")
        if self.simulated is not None and not isinstance(self.simulated, bool):
            raise ValueError(f"simulated: got {quoted(self.simulated)}, allowed: true or false")

    @classmethod
    def of_table(cls, table: object) -> Self:
        """Return the provenance from the table of a calibration file.

        Raises
        ------
        ValueError
            The table has another name, or a value that is not of its kind.
        """
        known = _known_keys("provenance", table, list(_NAMES))
        for name in ("date", "measured"):
            if name in known:
                known[name] = _parsed_time(name, known[name])
        for name, parse in _PARTS.items():
            if name in known:
                known[name] = _parsed_list(name, known[name], parse)
        try:
            return cls(**known)
        except ValueError as error:
            raise ValueError(f"provenance: {error}") from error

    def as_dict(self) -> Json:
        """Return the table of a calibration file: what is not known is not in it."""
        table: Json = {}
        for name, at in {"date": self.date, "measured": self.measured}.items():
            if at is not None:
                table[name] = at.isoformat()
        for name, text in self._texts().items():
            if text:
                table[name] = text
        if self.files:
            table["files"] = list(map(FileChecksum.as_dict, self.files))
        if self.chips:
            table["chips"] = list(self.chips)
        if self.simulated is not None:
            table["simulated"] = self.simulated
        return table

    @property
    def made(self) -> datetime | None:
        """When the touches were measured, or else when the calibration was made; None: unknown."""
        return self.measured or self.date

    def missing(self) -> list[str]:
        """Return the fields that are not known; of simulated touches none is needed."""
        if self.simulated:
            return []
        known = self.as_dict()
        return [name for name in _NAMES if name not in known]

    def lines(self) -> list[str]:
        """Return the provenance in two lines."""
        when = "calibrated: date not stated"
        if self.date:
            when = f"calibrated: {self.date:{_TIME}}"
        files = "1 file" if len(self.files) == 1 else f"{len(self.files)} files"
        when += f", from {files}"
        if self.measured:
            when += f"; measured: {self.measured:{_TIME}}"
        texts = {**self._texts(), "chip": " and ".join(self.chips), "touches": self._kind()}
        parts = []
        for name, text in texts.items():
            if text:
                parts.append(f"{name}: {text}")
        missing = self.missing()
        if missing:
            parts.append(f"not stated: {field_names(missing)}")
        return [when, "; ".join(parts)]

    def _kind(self) -> str:
        """Return what made the touches; "": unknown."""
        if self.simulated is None:
            return ""
        return "simulated, no probe was used" if self.simulated else "measured with a probe"

    def _texts(self) -> dict[str, str]:
        return {"probe": self.probe, "operator": self.operator, "site": self.site}


def field_names(names: Iterable[str]) -> str:
    """Return fields of a provenance as they are named in a sentence."""
    return ", ".join(map(_NAMES.__getitem__, names))


def present_time() -> datetime:
    """Return the present time, UTC, in whole seconds."""
    return datetime.now(UTC).replace(microsecond=0)


def recorded_at(sidecar: Sidecar) -> datetime | None:
    """Return when a recording began, UTC, in whole seconds; None: its sidecar does not state it.

    Examples
    --------
    >>> print(recorded_at(Sidecar({"clock": {"zero_utc_ns": 1_764_000_000_000_000_000}})))
    2025-11-24 16:00:00+00:00
    >>> recorded_at(Sidecar()) is None
    True
    """
    if sidecar.zero_utc_ns is not None:
        return datetime.fromtimestamp(sidecar.zero_utc_ns // 1_000_000_000, UTC)
    try:
        started = datetime.fromisoformat(sidecar.started)
        in_utc = started.astimezone(UTC).replace(microsecond=0)
    except (ValueError, OverflowError):
        return None
    return in_utc if started.tzinfo else None


def joined_texts(texts: Iterable[str]) -> str:
    """Return texts in one line, each once, without empty ones, as a field of a provenance.

    Examples
    --------
    >>> joined_texts(["A. Bee", "", "C. Dee", "A. Bee"])
    'A. Bee, C. Dee'
    """
    return shortened(", ".join(dict.fromkeys(filter(None, texts))), LONGEST_TEXT - 30)


def _text_of_name(path: Path) -> str:
    """Return the name of a file as a text that can be stored; a name may be no text."""
    return shortened(path.name, LONGEST_TEXT - 30)


def _require_text(name: str, text: object) -> None:
    if not isinstance(text, str) or len(text) > LONGEST_TEXT or printable(text) != text:
        allowed = f"a text of up to {LONGEST_TEXT} characters that can be shown"
        raise ValueError(f"{name}: got {quoted(text)}, allowed: {allowed}")


def _require_utc(name: str, at: object) -> None:
    if at is None:
        return
    if not isinstance(at, datetime) or at.tzinfo != UTC or at.microsecond:
        raise ValueError(f"{name}: got {quoted(at)}, allowed: a date and time, UTC, whole seconds")


def _known_keys(place: str, table: object, names: Sequence[str]) -> Json:
    """Return a table of a file as names and values; ValueError: it has another name."""
    if not isinstance(table, Mapping):
        raise ValueError(f"{place}: got {quoted(table)}, allowed: a table")  # noqa: TRY004  of a file
    for name in table:
        if name not in names:
            raise ValueError(f"{place}: {unlike(name, names)}")
    return dict(table)


def _parsed_time(name: str, text: object) -> datetime:
    allowed = "a date and time, UTC, as 2026-11-29T19:20:49+00:00"
    if isinstance(text, str):
        try:
            at = datetime.fromisoformat(text)
        except ValueError:
            at = None
        if at is not None and at.tzinfo == UTC and at.isoformat() == text:
            return at
    raise ValueError(f"provenance: {name}: got {quoted(text)}, allowed: {allowed}")


def _parsed_list(name: str, values: object, parse: Callable[[Any], Any]) -> tuple[Any, ...]:
    if not isinstance(values, list):
        raise ValueError(f"provenance: {name}: got {quoted(values)}, allowed: a list")  # noqa: TRY004  of a file
    return tuple(map(parse, values))


def _unchanged(value: object) -> object:
    """Return the value: it is checked later."""
    return value


_PARTS: dict[str, Callable[[Any], Any]] = {"files": FileChecksum.of_table, "chips": _unchanged}

UNKNOWN = Provenance()
"""Nothing is known, as in a file of an earlier version."""
