"""Specimens in files: tables of moduli, names of recordings, and simulated sessions."""

import csv
import re
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from math import isnan
from pathlib import Path

from palpate.ad7746.registers import SATURATED_PF
from palpate.calibration.modulus_text import (
    ModulusScale,
    has_uncertainty,
    modulus_in,
    number_in,
    scale_of,
    uncertainty_column,
    with_uncertainty,
)
from palpate.errors import CalibrationError
from palpate.files import read_bytes, write_file
from palpate.materials import KnownModulus
from palpate.messages import quoted
from palpate.recording import sidecar
from palpate.recording.rows import HEADER, format_rows
from palpate.samples import Block

LARGEST = 100_000  # bytes of a table of moduli


@dataclass(frozen=True)
class _Columns:
    """The units that a header row names; None: it names none."""

    modulus: ModulusScale | None = None
    uncertainty: ModulusScale | None = None
    third: str = ""

    @classmethod
    def of_header(cls, cells: list[str], place: str) -> "_Columns":
        """Return the columns of a header row."""
        _, modulus = scale_of(" ".join(cells[1:2]), place)
        third = " ".join(cells[2:3])
        return cls(modulus, uncertainty_column(third, place), third)


def read_moduli(path: Path, note: Callable[[str], object] = str) -> dict[str, KnownModulus]:
    """Return the moduli by name; `note` gets what was assumed."""
    # A header row, which may name the units; rows of name, modulus and, at will, its standard
    # uncertainty; comma, semicolon or tab.
    lines = _lines(path)
    delimiter = ","
    for mark in ";\t":
        if lines and mark in lines[0]:
            delimiter = mark
    moduli: dict[str, KnownModulus] = {}
    columns = _Columns()
    for number, line in enumerate(lines, 1):
        row = next(csv.reader([line], delimiter=delimiter), [])
        cells = list(map(str.strip, row))
        place = f"{path}, line {number}: "
        if number == 1 and _is_header(cells):
            columns = _Columns.of_header(cells, place)
        elif any(cells):
            name, known = _row(place, cells, columns)
            if name_key(name) in map(name_key, moduli):
                raise CalibrationError(f"{place}{quoted(name)} appears twice")
            moduli[name] = known
    if not moduli:
        expected = "a header row, then rows of name and modulus in MPa"
        raise CalibrationError(f"{path}: no specimens found; expected {expected}")
    if columns.modulus is None and any(known.hardness is None for known in moduli.values()):
        note(f"{path}: no unit of the moduli is named in its first line, MPa is assumed")
    if columns.third and columns.uncertainty is None:
        note(f"{path}: the column {quoted(columns.third)} is not used")
    return moduli


def _is_header(cells: list[str]) -> bool:
    """Return whether a row has no modulus in its second cell."""
    if len(cells) < 2:
        return True
    bare = cells[1]
    with suppress(CalibrationError):
        bare, _ = scale_of(bare)
    return not number_in(bare) > 0


def _lines(path: Path) -> list[str]:
    try:
        return read_bytes(path, LARGEST).decode("utf-8-sig").splitlines()
    except OSError as error:
        raise CalibrationError(f"{path}: cannot be read: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise CalibrationError(
            f"{path}: not a text table, allowed: names and moduli, saved as CSV: {error}"
        ) from error


def _row(place: str, cells: list[str], columns: _Columns) -> tuple[str, KnownModulus]:
    """Return the name and the modulus of a row."""
    if len(cells) < 2 or not cells[0]:
        raise CalibrationError(
            f"{place}got {len(cells)} cells, allowed: name of the specimen and modulus in MPa"
        )
    bare, own = scale_of(cells[1], place)
    known = modulus_in(bare, own or columns.modulus or ModulusScale(), place)
    if known is None:
        raise CalibrationError(
            f"{place}got {quoted(cells[1])} as a modulus, allowed: a positive number, MPa"
        )
    third = " ".join(cells[2:3])
    if not third:
        return cells[0], known
    if columns.uncertainty or has_uncertainty(third):
        return cells[0], with_uncertainty(known, third, columns.uncertainty, place)
    if not isnan(number_in(third)):
        raise CalibrationError(
            f"{place}got {quoted(third)} in a third column of unknown meaning, allowed: the "
            "standard uncertainty of the modulus (k = 1), with a header that names it and its "
            "unit, as 'uncertainty, %' or 'u, MPa'; or texts, which are not used"
        )
    return cells[0], known


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
