"""One known measurement, written as tables of random dialects: what palpate reads is right, or it asks, or refuses.

`python tests/tools/random_tables.py [COUNT]` prints how many ended in which way, and each wrong one.
"""

import gzip
import sys
import tempfile
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path
from random import Random

import numpy as np
from foreign_files import RATE, RATIOS, measurement  # tests/tools
from palpate import RecordingError, read, touches

_BEGUN = datetime(2026, 3, 9, 23, 59, 51, 260_000, UTC)
TIMES: dict[str, Callable[[float], str]] = {
    "s": lambda t: f"{t:.4f}",
    "s since boot": lambda t: f"{51234.5 + t:.4f}",
    "ms": lambda t: f"{1e3 * t:.1f}",
    "whole ms": lambda t: f"{1e3 * t:.0f}",
    "us": lambda t: f"{1e6 * t:.0f}",
    "ns": lambda t: f"{1e9 * t:.0f}",
    "epoch s": lambda t: f"{_BEGUN.timestamp() + t:.4f}",
    "epoch ms": lambda t: f"{1e3 * (_BEGUN.timestamp() + t):.0f}",
    "epoch us": lambda t: f"{1e6 * (_BEGUN.timestamp() + t):.0f}",
    "ISO": lambda t: (_BEGUN + timedelta(seconds=t)).isoformat(timespec="microseconds"),
    "ISO ms Z": lambda t: f"{(_BEGUN + timedelta(seconds=t)).replace(tzinfo=None).isoformat(timespec='milliseconds')}Z",
    "ISO blank": lambda t: f"{_BEGUN + timedelta(seconds=t):%Y-%m-%d %H:%M:%S.%f}",
    "German": lambda t: f"{_BEGUN + timedelta(seconds=t):%d.%m.%Y %H:%M:%S.%f}",
    "American": lambda t: f"{_BEGUN + timedelta(seconds=t):%m/%d/%Y %I:%M:%S.%f %p}",
    "clock": lambda t: f"{_BEGUN + timedelta(seconds=t):%H:%M:%S.%f}",
    "mm:ss": lambda t: f"{int(t // 60):02}:{t % 60:06.3f}",
    "days": lambda t: f"{46090.5 + t / 86400:.9f}",
    "whole seconds": lambda t: f"{_BEGUN + timedelta(seconds=t):%Y-%m-%d %H:%M:%S}",
    "row": lambda t: f"{t * RATE:.0f}",
    "none": lambda _t: "",
}
TIME_NAMES = ("time", "t", "Time", "timestamp", "Timestamp", "Zeit", "clock", "elapsed", "")
UNITS = {"": 1.0, "pF": 1.0, "fF": 1e3, "aF": 1e6, "nF": 1e-3, "F": 1e-12}


@dataclass(frozen=True)
class Dialect:
    """How a table is written."""

    delimiter: str
    comma: bool
    times: str
    time_name: str
    names: tuple[str, str]
    units: tuple[str, str]
    scale: float
    digits: int
    extra: tuple[str, ...]
    tail: str
    end: str
    encoding: str
    packed: bool
    asked: bool


def dialect(random: Random) -> Dialect:
    """Return a random way to write the measurement."""
    delimiter = random.choice([",", ";", "\t", "|", " "])
    unit = random.choice(list(UNITS))
    told = random.random() < 0.7
    return Dialect(
        delimiter=delimiter,
        comma=delimiter != "," and random.random() < 0.4,
        times=random.choice([name for name in TIMES if delimiter != " " or name not in _WITH_BLANKS]),
        time_name=random.choice(TIME_NAMES),
        names=random.choice([("C1", "C2"), ("hard", "soft"), ("CIN1", "CIN2"), ("A", "B"), ("Ch1", "Ch2")]),
        units=(unit if told else "", unit if told and random.random() < 0.8 else ""),
        scale=UNITS[unit],
        digits=random.choice([3, 4, 6]),
        extra=tuple(random.sample(["n", "T", "note", "blank"], random.randint(0, 2))),
        tail=random.choice(["", "", "", "Mean", "# end", "\n\n"]),
        end=random.choice(["\n", "\r\n"]),
        encoding=random.choice(["utf-8", "utf-8", "utf-8-sig", "utf-16", "latin-1"]),
        packed=random.random() < 0.1,
        asked=random.random() < 0.5,
    )


_WITH_BLANKS = {"ISO blank", "German", "American", "whole seconds", "none"}


def written(way: Dialect) -> bytes:
    """Return the measurement as such a table."""
    t, hard, soft = measurement()
    cells = [[TIMES[way.times](float(each)) for each in t]] if way.times != "none" else []
    cells += [[_number(float(value) * way.scale, way) for value in channel] for channel in (hard, soft)]
    if way.comma:
        cells = [[cell.replace(".", ",") for cell in column] for column in cells]
    names = [name for name in ([_time_name(way)] if way.times != "none" else [])]
    names += [f"{name} ({unit})" if unit else name for name, unit in zip(way.names, way.units, strict=True)]
    if way.delimiter == " ":
        names = [name.replace(" ", "_") for name in names]
    for extra in way.extra:
        cells.append(_extra(extra, len(t), way))
        names.append(extra if extra != "blank" or way.delimiter == " " else "")
    rows = [way.delimiter.join(row) for row in zip(*cells, strict=True)]
    tail = (
        [way.tail + way.delimiter + way.delimiter.join(["5"] * (len(cells) - 1))] if way.tail == "Mean" else [way.tail]
    )
    text = way.end.join([way.delimiter.join(names), *rows, *(tail if way.tail else []), ""])
    data = text.encode(way.encoding)
    return gzip.compress(data) if way.packed else data


def _number(value: float, way: Dialect) -> str:
    return (
        f"{value:.{way.digits}e}"
        if way.scale < 1e-6
        else f"{value:.{max(0, way.digits - round(np.log10(way.scale)))}f}"
    )


def _time_name(way: Dialect) -> str:
    return way.time_name or ("x" if way.delimiter == " " else "")


def _extra(kind: str, rows: int, way: Dialect) -> list[str]:
    if kind == "n":
        return [str(row) for row in range(rows)]
    if kind == "T":
        return [("21,5" if way.comma else "21.5")] * rows
    return ["ok" if kind == "note" else "-" if way.delimiter == " " else ""] * rows


def outcome(way: Dialect, folder: Path) -> tuple[str, str]:
    """Return "right", "right without times", "asked", "refused" or "wrong", and what was said."""
    path = folder / "table.dat"
    path.write_bytes(written(way))
    first = 2 if way.times != "none" else 1
    columns = {"hard": first, "soft": first + 1} if way.asked else None
    try:
        recording = read(path, columns=columns)
    except RecordingError as error:
        return "refused", str(error)
    except ValueError as error:
        return "asked", str(error)
    ratios = [touch.ratio for touch in touches(recording)]
    said = f"{ratios}; {recording.understood}; {recording.notes}"
    if len(ratios) != len(RATIOS) or not np.allclose(ratios, RATIOS, rtol=5e-3):
        return "wrong", said
    if np.isnan(recording.t_hard_s).any():
        return (
            "right without times" if any("no column of times" in note for note in recording.notes) else "wrong"
        ), said
    steps = np.diff(recording.t_hard_s)
    return ("right" if abs(float(steps.mean()) * RATE - 1) < 1e-2 else "wrong"), said


def main(count: int) -> None:
    """Print how many tables ended in which way."""
    found: Counter[str] = Counter()
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(count):
            way = dialect(Random(seed))
            ends, said = outcome(way, Path(folder))
            found[ends] += 1
            if ends == "wrong":
                sys.stdout.write(f"{seed}: {way}\n    {said}\n")
    sys.stdout.write(f"{dict(found)}\n")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 200)
