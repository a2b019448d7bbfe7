"""Files of other programs are read right, asked about, or refused with the line: never wrong in silence."""

import gzip
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from pathlib import Path
from random import Random

import numpy as np
import pytest
from effort import draws
from foreign_files import RATE, RATIOS, measurement  # tests/tools
from palpate import read, touches
from palpate.errors import RecordingError

BEGUN = datetime(2026, 3, 9, 23, 59, 51, 260_000, UTC)
TIMES: dict[str, Callable[[float], str]] = {
    "s": lambda t: f"{t:.4f}",
    "s since boot": lambda t: f"{51234.5 + t:.4f}",
    "ms": lambda t: f"{1e3 * t:.1f}",
    "us": lambda t: f"{1e6 * t:.0f}",
    "epoch s": lambda t: f"{BEGUN.timestamp() + t:.4f}",
    "epoch ms": lambda t: f"{1e3 * (BEGUN.timestamp() + t):.0f}",
    "ISO": lambda t: (BEGUN + timedelta(seconds=t)).isoformat(timespec="microseconds"),
    "German": lambda t: f"{BEGUN + timedelta(seconds=t):%d.%m.%Y %H:%M:%S.%f}",
    "American": lambda t: f"{BEGUN + timedelta(seconds=t):%m/%d/%Y %I:%M:%S.%f %p}",
    "clock": lambda t: f"{BEGUN + timedelta(seconds=t):%H:%M:%S.%f}",
    "mm:ss": lambda t: f"{int(t // 60):02}:{t % 60:06.3f}",
    "days": lambda t: f"{46090.5 + t / 86400:.9f}",
    "whole seconds": lambda t: f"{BEGUN + timedelta(seconds=t):%Y-%m-%d %H:%M:%S}",
    "row": lambda t: f"{t * RATE:.0f}",
    "none": lambda _: "",
}
UNITS = {"": 1.0, "pF": 1.0, "fF": 1e3, "aF": 1e6, "nF": 1e-3, "F": 1e-12}


def random_table(random: Random) -> bytes:
    """Return the measurement as a table of a random dialect."""
    delimiter, unit, times = (
        random.choice(",;\t| "),
        random.choice(list(UNITS)),
        random.choice(list(TIMES)),
    )
    comma, digits = delimiter != "," and random.random() < 0.4, random.choice([3, 4, 6])
    form = f".{digits}e" if unit == "F" else f".{max(0, digits - round(np.log10(UNITS[unit])))}f"
    t, *channels = measurement()
    cells = [[TIMES[times](float(each)) for each in t]] if times != "none" else []
    cells += [[f"{float(value) * UNITS[unit]:{form}}" for value in channel] for channel in channels]
    names = [random.choice(["time", "t", "timestamp", "Zeit", "x"])] * (len(cells) - 2)
    for name in random.choice([("C1", "C2"), ("hard", "soft"), ("CIN1", "CIN2"), ("A", "B")]):
        names.append(f"{name} ({unit})" if unit and random.random() < 0.8 else name)
    for extra, cell in random.sample(
        [("n", "7"), ("T", "21.5"), ("note", "ok"), ("empty", "-")], random.randint(0, 2)
    ):
        names.append(extra)
        cells.append([cell] * len(t))
    rows = [delimiter.join(row) for row in zip(*cells, strict=True)]
    rows = [row.replace(".", ",") for row in rows] if comma else rows
    tail = random.choice(
        ["", "", "# end", "\n", delimiter.join(["Mean", *["5"] * (len(cells) - 1)])]
    )
    end = random.choice(["\n", "\r\n"])
    text = end.join(
        [
            delimiter.join(name.replace(" ", "_") if delimiter == " " else name for name in names),
            *rows,
            tail,
        ]
    )
    data = text.encode(random.choice(["utf-8", "utf-8-sig", "utf-16", "latin-1"]))
    return gzip.compress(data) if random.random() < 0.1 else data


def test_a_table_of_any_dialect_is_never_wrong(tmp_path: Path) -> None:
    count, right = draws(200, 2000, at_least=20), 0
    for seed in range(count):
        path, random = tmp_path / "table.dat", Random(seed)
        path.write_bytes(random_table(random))
        try:
            found = read(
                path, columns={"hard": 2, "soft": 3, "time": 1} if random.random() < 0.4 else None
            )
        except (RecordingError, ValueError):
            continue
        ratios, told = [touch.ratio for touch in touches(found)], (seed, found.understood)
        assert ratios == pytest.approx(RATIOS, rel=5e-3), told
        steps = np.diff(found.t_hard_s)
        assert "rate unknown" in found.understood or abs(float(steps.mean()) * RATE - 1) < 1e-2, (
            told
        )
        right += 1
    assert right > count / 8
