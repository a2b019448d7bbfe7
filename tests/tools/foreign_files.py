"""Files as other programs write them, each with two channels of one known measurement, and each common mistake."""

import gzip
import math
import re
from collections.abc import Callable, Iterable, Sequence
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np
import pandas
from command_lines import run
from numpy.typing import NDArray
from xdf import Stream, written  # tests/tools

RATE = 38.4  # pairs a second
RATIOS = (2.0, 3.2)
ROWS = 880
_TOUCH_S = (4.0, 14.0)  # begin of each touch
_HELD_S = 7.3
_BEGUN = datetime(2026, 3, 9, 12, 0, 0, 260_000, UTC)

Array = NDArray[np.float64]


def measurement() -> tuple[Array, Array, Array]:
    """Return times, s, and both channels, pF: two touches in a trembling hand, with the ratios `RATIOS`."""
    t = np.arange(ROWS) / RATE
    rng = np.random.default_rng(7)
    hard, soft = np.full(ROWS, 6.9), np.full(ROWS, 4.7)
    for begin, ratio in zip(_TOUCH_S, RATIOS, strict=True):
        force = np.clip((t - begin) / 0.4, 0, 1) * np.clip((begin + _HELD_S - t) / 0.4, 0, 1)
        press = 0.5 * force * (1 + 0.1 * np.sin(2 * np.pi * 1.3 * t))
        hard, soft = hard + ratio * press, soft + press
    return t, hard + rng.normal(0, 2e-4, ROWS), soft + rng.normal(0, 2e-4, ROWS)


Make = Callable[[Path], list[str]]
"""Writes the files of a case into a folder; returns the arguments of `palpate replay`."""


def ending(make: Make, folder: Path) -> str:
    """Make the files of a case, and replay them; return "right", "told", "wrong", "asked" or "refused", and the ratios."""
    arguments = make(folder)
    done = run("replay", *arguments, "--json", text=_WHOLE if arguments == ["-"] else None)
    rows = re.findall(r'^ +"ratio": (\S+),$', done.stdout, re.MULTILINE)
    ratios = [math.nan if row == "null" else float(row) for row in rows]
    near = len(ratios) == len(RATIOS) and np.allclose(ratios, RATIOS, rtol=2e-3)
    said = "told" if re.search("swapped|clipped", done.stderr + done.stdout) else "wrong"
    ends = {2: "asked", 4: "refused"}.get(done.exit_code, "right" if near else said)
    return f"{ends}, {[round(ratio, 4) for ratio in ratios]}"


Row = Sequence[object]


def _text(header: str, rows: Iterable[Row], delimiter: str = ",", end: str = "\n") -> str:
    return "".join(
        line + end for line in [header, *(delimiter.join(map(str, row)) for row in rows)] if line
    )


def _file(data: str | bytes, *options: str, name: str = "other.csv") -> Make:
    def make(folder: Path) -> list[str]:
        (folder / name).write_bytes(data if isinstance(data, bytes) else data.encode())
        return [str(folder / name), *options]

    return make


def _table(
    header: str, rows: Iterable[Row], *options: str, delimiter: str = ",", end: str = "\n"
) -> Make:
    return _file(_text(header, rows, delimiter, end), *options)


def _rows(
    time: Callable[[float], object] = "{:.4f}".format, scale: float = 1.0, digits: str = ".6f"
) -> list[list[str]]:
    """Return the measurement with times in a notation."""
    return [
        [str(time(t)), f"{hard * scale:{digits}}", f"{soft * scale:{digits}}"]
        for t, hard, soft in zip(*measurement(), strict=True)
    ]


def _comma(rows: list[list[str]]) -> list[list[str]]:
    return [[cell.replace(".", ",") for cell in row] for row in rows]


def _date(form: str, begun: datetime = _BEGUN) -> Callable[[float], str]:
    return lambda t: (begun + timedelta(seconds=t)).strftime(form)


_PLAIN = _rows()
_MS = _rows(lambda t: f"{1e3 * t:.1f}")
_HEADER = "t (s),C1 (pF),C2 (pF)"
_WHOLE = _text(_HEADER, _PLAIN)


def _saved(name: str, save: Callable[[Any, Path], Any]) -> Make:
    def make(folder: Path) -> list[str]:
        save(
            pandas.DataFrame(dict(zip(("time_s", "C1_pF", "C2_pF"), measurement(), strict=True))),
            folder / name,
        )
        return [str(folder / name)]

    return make


def _excel_dates(frame: Any, path: Path) -> None:
    days = pandas.Timestamp(_BEGUN).tz_localize(None) + pandas.to_timedelta(
        frame.pop("time_s"), unit="s"
    )
    frame.assign(Time=days).to_excel(path, index=False, startrow=1)


def _own_parquet(folder: Path) -> list[str]:
    (folder / "table.csv").write_text(_WHOLE)
    for source, target in (("table.csv", "own.csv"), ("own.csv", "own.parquet")):
        assert run("convert", folder / source, "-o", folder / target).exit_code == 0
    return [str(folder / "own.parquet")]


def _two_files(folder: Path) -> list[str]:
    t, hard, soft = measurement()
    for name, values, shift in (("one", hard, 0.0), ("two", soft, 0.002)):
        rows = [
            [f"{each + shift:.4f}", f"{value:.6f}"] for each, value in zip(t, values, strict=True)
        ]
        (folder / f"{name}.csv").write_text(
            _text("t (s),C (pF)", rows[3:] if name == "two" else rows)
        )
    return [str(folder / "one.csv"), "--soft", str(folder / "two.csv")]


def _xdf(_: Any, path: Path) -> None:
    t, hard, soft = measurement()
    path.write_bytes(
        written(Stream("Probe", t.tolist(), np.column_stack([hard, soft]), ["C1", "C2"]))
    )


def _edited(line: int, text: str) -> Make:
    lines = _WHOLE.splitlines()
    return _file("\n".join([*lines[:line], text, *lines[line:]]) + "\n")


_LONG = [
    [t, name, value] for t, *both in _PLAIN for name, value in zip(("C1", "C2"), both, strict=True)
]
_TWO_TIMES = [[n, t, hard, t, soft] for n, (t, hard, soft) in enumerate(_PLAIN)]
_TWO_COLUMNS = [[*row[0].split(), *row[1:]] for row in _rows(_date("%Y-%m-%d %H:%M:%S.%f"))]
_MIDNIGHT = _rows(_date("%H:%M:%S.%f", datetime(2026, 3, 9, 23, 59, 52)))
_MIXED = [
    [cells[0], *points[1:]]
    for cells, points in zip(_comma(_PLAIN), _rows(digits=".3f"), strict=True)
]

CASES: dict[str, Make] = {
    "comma, header with units": _file(_WHOLE),
    "semicolons, decimal commas, CRLF": _table(
        "Zeit (s);C1 (pF);C2 (pF)", _comma(_PLAIN), delimiter=";", end="\r\n"
    ),
    "UTF-16 with tabs, as Excel saves text": _file(
        _text("t (s)\tCIN1 (pF)\tCIN2 (pF)", _PLAIN, "\t").encode("utf-16")
    ),
    "sep=; in the first line": _table("sep=;\nt (s);C1 (pF);C2 (pF)", _PLAIN, delimiter=";"),
    "millis": _table("millis,C1,C2", _MS),
    "milliseconds, by size only": _table("time,C1,C2", _MS),
    "microseconds, by size only": _table("timestamp,C1,C2", _rows(lambda t: round(1e6 * t))),
    "nanoseconds of the epoch": _table(
        "time,C1,C2", _rows(lambda t: 1_772_000_000_000_000_000 + round(1e9 * t))
    ),
    "ISO dates with zone": _table(
        "time,C1 (pF),C2 (pF)", _rows(_date("%Y-%m-%dT%H:%M:%S.%f+00:00"))
    ),
    "date and time in two columns": _table("Date,Time,C1 (pF),C2 (pF)", _TWO_COLUMNS),
    "times of day over midnight": _table("Time,C1 (pF),C2 (pF)", _MIDNIGHT),
    "mm:ss.fff": _table(
        "Elapsed,C1 (pF),C2 (pF)", _rows(lambda t: f"{int(t // 60):02}:{t % 60:06.3f}")
    ),
    "serial days of Excel": _table(
        "Time,C1 (pF),C2 (pF)", _rows(lambda t: f"{46090.5 + t / 86400:.9f}")
    ),
    "lsl_timestamp": _table("lsl_timestamp,C1,C2", _rows(lambda t: f"{51234.5 + t:.6f}")),
    "timeA, timeB": _table(",timeA,hard,timeB,soft", _TWO_TIMES),
    "farads": _table("t_s,C1,C2", _rows(scale=1e-12, digits=".9e")),
    "a unit in one header of two": _table("t_s,C1 (fF),C2", _rows(scale=1e3, digits=".3f")),
    "no header, columns asked": _table("", _PLAIN, "--map", "time=1,hard=2,soft=3"),
    "other names": _table("t (s),A,B", _PLAIN, "--map", "hard=A,soft=B"),
    "one file a channel, joined by time": _two_files,
    "long format: time, channel, value": _table("time_s,channel,value_pF", _LONG),
    "gz": _file(gzip.compress(_WHOLE.encode()), name="other.csv.gz"),
    "standard input": lambda _: ["-"],
    "Excel, seconds": _saved(
        "other.xlsx", lambda frame, path: frame.to_excel(path, index=False, startrow=1)
    ),
    "Excel, dates": _saved("other.xlsx", _excel_dates),
    "Parquet of another program": _saved("other.parquet", pandas.DataFrame.to_parquet),
    "Arrow file": _saved("other.arrow", pandas.DataFrame.to_feather),
    "palpate's own Parquet": _own_parquet,
    "XDF": _saved("other.xdf", _xdf),
    "summary rows at the end": _file(f"{_WHOLE}\nMean,7.1,4.8\nStd,0.4,0.2\n"),
    "comments in between": _edited(300, "# pump on"),
    "a header again in the middle": _edited(300, _HEADER),
    "thousands separators": _table(
        "t (s);C1 (fF);C2 (fF)", _rows(scale=1e3, digits=",.3f"), delimiter=";"
    ),
    "swapped channels": _table("t (s),C2 (pF),C1 (pF)", _PLAIN),
    "a clipped column": _table(
        _HEADER, [[t, hard, f"{min(float(soft), 5.1):.6f}"] for t, hard, soft in _PLAIN]
    ),
    "no times": _table("C1 (pF),C2 (pF)", [row[1:] for row in _PLAIN]),
    "no times, rate given": _table(
        "C1 (pF),C2 (pF)", [row[1:] for row in _PLAIN], "--rate", str(RATE)
    ),
    "6.123 beside decimal commas": _table("t (s);C1 (pF);C2 (pF)", _MIXED, delimiter=";"),
    "steps of 1: seconds or milliseconds?": _table(
        "time,C1,C2", [[n, *row[1:]] for n, row in enumerate(_PLAIN)]
    ),
    "whole-second stamps": _table("time,C1 (pF),C2 (pF)", _rows(_date("%Y-%m-%dT%H:%M:%S"))),
    "t_ms with seconds": _table("t_ms,C1,C2", _PLAIN),
    "names that leave it open": _table("t (s),A (pF),B (pF)", _PLAIN),
    "four capacitances": _table(
        "t (s),C1 (pF),C2 (pF),C3 (pF),C4 (pF)", [[*row, *row[1:]] for row in _PLAIN]
    ),
    "no unit, values of thousands": _table("t (s),C1,C2", _rows(scale=1e3)),
    "per cent": _table("t (s),C1 (%),C2 (%)", _PLAIN),
    "a wrong cell": _file(_WHOLE.replace(_PLAIN[399][1], f"{_PLAIN[399][1]}x3")),
    "a row cut in the middle": _edited(300, "7.8,6.9"),
    "text that is no table": _file("dear reader,\nthis is no table\n" * 50),
    "an old Excel file": _file(b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(600), name="old.xls"),
}
"""At least one of each kind of file and each common mistake."""
