"""Specimens in files: tables of moduli, names of recordings, and simulated sessions."""

import csv
import re
from collections.abc import Callable, Iterable, Mapping
from math import inf, nan
from pathlib import Path

from palpate.ad7746.registers import SATURATED_PF
from palpate.errors import CalibrationError
from palpate.files import read_bytes, write_file
from palpate.importers.units import to_number
from palpate.messages import quoted
from palpate.recording import sidecar
from palpate.recording.rows import HEADER, format_rows
from palpate.samples import Block

LARGEST = 100_000  # bytes of a table of moduli


def read_moduli(path: Path, note: Callable[[str], object] = str) -> dict[str, float]:
    """Return the moduli, MPa, by name; `note` gets what was assumed."""
    # A header row, which may name a unit; rows of name and modulus; comma, semicolon or tab.
    lines = _lines(path)
    delimiter = ","
    for mark in ";\t":
        if lines and mark in lines[0]:
            delimiter = mark
    moduli: dict[str, float] = {}
    power: int | None = None
    for number, line in enumerate(lines, 1):
        row = next(csv.reader([line], delimiter=delimiter), [])
        cells = list(map(str.strip, row))
        is_header = len(cells) < 2 or not _number(cells[1]) > 0
        if number == 1 and is_header:
            power = without_unit(" ".join(cells[1:2]), f"{path}, line 1: ")[1]
        elif any(cells):
            name, modulus = _row(f"{path}, line {number}", cells)
            if name_key(name) in map(name_key, moduli):
                raise CalibrationError(f"{path}, line {number}: {quoted(name)} appears twice")
            moduli[name] = modulus * 10.0 ** (power or 0)
    if not moduli:
        expected = "a header row, then rows of name and modulus in MPa"
        raise CalibrationError(f"{path}: no specimens found; expected {expected}")
    if power is None:
        note(f"{path}: no unit of the moduli is named in its first line, MPa is assumed")
    return moduli


def _lines(path: Path) -> list[str]:
    try:
        return read_bytes(path, LARGEST).decode("utf-8-sig").splitlines()
    except OSError as error:
        raise CalibrationError(f"{path}: cannot be read: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise CalibrationError(
            f"{path}: not a text table, allowed: names and moduli, saved as CSV: {error}"
        ) from error


def _number(text: str) -> float:
    """Return the number in a cell; nan: there is none."""
    try:
        return to_number(text)
    except ValueError:
        return nan


_UNIT = re.compile(r"(?<![a-z])([a-z]?pa|n ?/ ?mm.?2?|psi|ksi|bar)(?![a-z])", re.IGNORECASE)
_POWERS = {"pa": -6, "kpa": -3, "mpa": 0, "gpa": 3}


def without_unit(text: str, place: str = "") -> tuple[str, int | None]:
    """Return a text without its unit, and the power of ten of the unit in MPa; None: no unit.

    Raises
    ------
    CalibrationError
        Another unit, with the place where it stands before the sentence.

    Examples
    --------
    >>> without_unit("143 kPa"), without_unit("modulus")
    (('143', -3), ('modulus', None))
    """
    unit = _UNIT.search(text)
    if not unit:
        return text, None
    name = unit[1].lower()
    if name not in _POWERS:
        raise CalibrationError(f"{place}got the unit {quoted(name)}, allowed: Pa, kPa, MPa or GPa")
    return _UNIT.sub("", text, 1).strip(), _POWERS[name]


def _row(place: str, cells: list[str]) -> tuple[str, float]:
    if len(cells) < 2 or not cells[0]:
        raise CalibrationError(
            f"{place}: got {len(cells)} cells, allowed: name of the specimen and modulus in MPa"
        )
    modulus = _number(cells[1])
    if not 0 < modulus < inf:
        raise CalibrationError(
            f"{place}: got {quoted(cells[1])} as a modulus, allowed: a positive number, MPa"
        )
    return cells[0], modulus


def specimen_in(file: Path, names: Mapping[str, str]) -> str:
    """Return the specimen that a file name begins with, else the name without its number."""
    # The name of the file is the name of the specimen, or begins with it, followed by a space,
    # hyphen, underscore or dot: `30 OO.csv`, `30OO-2.csv` and `30oo_monday.csv` are of `30 OO`.
    stem = file.stem
    for end in range(len(stem), -1, -1):
        name = name_key(stem[:end])
        if name in names and (end == len(stem) or ord(stem[end]) in _SEPARATORS):
            return names[name]
    first = file.name.partition(".")[0]
    return re.sub(r"[-_ .]\d{1,3}$", "", first) or stem


_SEPARATORS = dict.fromkeys(map(ord, "-_ ."))


def name_key(name: str) -> str:
    """Return a name in lower case without blanks, dashes, underscores and dots, to compare it."""
    return name.translate(_SEPARATORS).casefold()


def session_files(folder: Path, names: Iterable[str]) -> list[Path]:
    """Return the files of `write_session`: the recordings, `moduli.csv`, and the sidecars."""
    paths = [folder / f"{name.replace(' ', '')}.csv" for name in names]
    return [*paths, folder / "moduli.csv", *map(sidecar.sidecar_path, paths)]


def write_session(
    folder: Path, recordings: Mapping[str, Block], moduli: Mapping[str, float]
) -> list[Path]:
    """Write, or replace, a recording for each specimen, and `moduli.csv`; return the paths."""
    *paths, table = session_files(folder, recordings)[: len(recordings) + 1]
    folder.mkdir(parents=True, exist_ok=True)
    for path, block in zip(paths, recordings.values(), strict=True):
        data = HEADER.encode() + format_rows(block)
        write_file(path, data)
        device = {"name": "simulated probe", "full_scale_pF": SATURATED_PF}
        document = sidecar.made(device, len(block), data)
        sidecar.save(sidecar.sidecar_path(path), document)
    rows = "".join(f"{name},{moduli[name]!r}\n" for name in recordings)
    write_file(table, f"specimen,modulus_MPa\n{rows}".encode())
    return [*paths, table]
