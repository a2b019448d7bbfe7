"""Files as other programs write them, each with two channels of one known measurement, and each common mistake."""

import gzip
import math
import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pandas
from click.testing import CliRunner
from numpy.typing import NDArray
from palpate.cli import main
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
    t, hard, soft = _measured()
    return t.copy(), hard.copy(), soft.copy()


@cache
def _measured() -> tuple[Array, Array, Array]:
    t = np.arange(ROWS) / RATE
    rng = np.random.default_rng(7)
    hard, soft = np.full(ROWS, 6.9), np.full(ROWS, 4.7)
    for begin, ratio in zip(_TOUCH_S, RATIOS, strict=True):
        force = np.clip((t - begin) / 0.4, 0, 1) * np.clip((begin + _HELD_S - t) / 0.4, 0, 1)
        press = 0.5 * force * (1 + 0.1 * np.sin(2 * np.pi * 1.3 * t))
        hard, soft = hard + ratio * press, soft + press
    return t, hard + rng.normal(0, 2e-4, ROWS), soft + rng.normal(0, 2e-4, ROWS)


@dataclass(frozen=True)
class Case:
    """A file and how it is to be read.

    Attributes
    ----------
    name : str
        What is special.
    make : callable
        Writes the files into a folder; returns the arguments of `palpate replay`.
    ends : str
        "right": both ratios are right. "told": they are not, and it says so. "asked": exit code 2. "refused": exit code 4.
    says : str
        A regular expression for standard error.
    """

    name: str
    make: Callable[[Path], list[str]]
    ends: str = "right"
    says: str = ""


@dataclass(frozen=True)
class Outcome:
    """What `palpate replay` did with a file."""

    code: int
    ratios: list[float]
    said: str

    @property
    def ends(self) -> str:
        """How it ended: "right", "told", "wrong", "asked", "refused"."""
        if self.code in (2, 4):
            return {2: "asked", 4: "refused"}[self.code]
        near = len(self.ratios) == len(RATIOS) and np.allclose(self.ratios, RATIOS, rtol=2e-3)
        return "right" if near else "told" if re.search("swapped|clipped", self.said) else "wrong"


def run(case: Case, folder: Path) -> Outcome:
    """Make the files of a case in a folder, and replay them there."""
    arguments = case.make(folder)
    piped = (folder / "piped").read_bytes() if arguments[0] == "-" else None
    result = CliRunner().invoke(main, ["replay", *arguments], input=piped)
    rows = re.findall(r"^ +\d+ +\S+ +\d+ +(\S+) ", result.stdout, re.MULTILINE)
    ratios = [math.nan if row == "-" else float(row) for row in rows]
    return Outcome(result.exit_code, ratios, result.stderr + result.stdout)


def _text(rows: Iterable[Iterable[object]], header: str = "", delimiter: str = ",", end: str = "\n") -> str:
    lines = [delimiter.join(str(cell) for cell in row) for row in rows]
    return "".join(line + end for line in ([header] if header else []) + lines)


def _rows(
    time: Callable[[float], object] = lambda t: f"{t:.4f}", scale: float = 1.0, digits: int = 6
) -> list[list[str]]:
    return [
        [str(time(t)), f"{h * scale:.{digits}f}", f"{s * scale:.{digits}f}"]
        for t, h, s in zip(*measurement(), strict=True)
    ]


def _csv(text: str | bytes, *options: str, name: str = "other.csv") -> Callable[[Path], list[str]]:
    def make(folder: Path) -> list[str]:
        path = folder / name
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return [str(path), *options]

    return make


def _iso(t: float) -> str:
    return (_BEGUN + timedelta(seconds=t)).isoformat(timespec="microseconds")


def _clock(t: float) -> str:
    return f"{_BEGUN + timedelta(seconds=t):%H:%M:%S.%f}"


def _minutes(t: float) -> str:
    return f"{int(t // 60):02}:{t % 60:06.3f}"


def _serial_days(t: float) -> str:
    return f"{46090.5 + t / 86400:.9f}"


def _comma(rows: list[list[str]]) -> list[list[str]]:
    return [[cell.replace(".", ",") for cell in row] for row in rows]


MAP = ("--map", "hard=2,soft=3")
_PLAIN = _rows()
_MS = _rows(lambda t: f"{1e3 * t:.1f}")


def _saved(name: str, save: Callable[[Any, Path], Any]) -> Callable[[Path], list[str]]:
    def make(folder: Path) -> list[str]:
        save(pandas.DataFrame(dict(zip(("time_s", "C1_pF", "C2_pF"), measurement(), strict=True))), folder / name)
        return [str(folder / name)]

    return make


def _excel_dates(frame: Any, path: Path) -> None:
    days = pandas.Timestamp(_BEGUN).tz_localize(None) + pandas.to_timedelta(frame.pop("time_s"), unit="s")
    frame.assign(Time=days).to_excel(path, index=False, startrow=1)


def _own_parquet(folder: Path) -> list[str]:
    source = folder / "own.csv"
    (folder / "table.csv").write_text(_text(_PLAIN, "t (s),hard (pF),soft (pF)"))
    for target in (source, folder / "own.parquet"):
        read = folder / "table.csv" if target is source else source
        result = CliRunner().invoke(main, ["convert", str(read), "-o", str(target)])
        assert result.exit_code == 0, result.stderr
    return [str(folder / "own.parquet")]


def _two_files(folder: Path) -> list[str]:
    t, hard, soft = measurement()
    for name, values, shift in (("one", hard, 0.0), ("two", soft, 0.002)):
        rows = [[f"{each + shift:.4f}", f"{value:.6f}"] for each, value in zip(t, values, strict=True)]
        (folder / f"{name}.csv").write_text(_text(rows[3:] if name == "two" else rows, "t (s),C (pF)"))
    return [str(folder / "one.csv"), "--soft", str(folder / "two.csv")]


def _piped(folder: Path) -> list[str]:
    (folder / "piped").write_text(_text(_PLAIN, "t (s),C1 (pF),C2 (pF)"))
    return ["-"]


def _xdf(folder: Path) -> list[str]:
    t, hard, soft = measurement()
    stream = Stream("Probe", t.tolist(), np.column_stack([hard, soft]), ["C1", "C2"])
    (folder / "other.xdf").write_bytes(written(stream))
    return [str(folder / "other.xdf")]


def _edited(line: int, text: str) -> str:
    lines = _text(_PLAIN, "t (s),C1 (pF),C2 (pF)").splitlines()
    lines.insert(line, text)
    return "\n".join(lines) + "\n"


def _wrong_cell() -> str:
    lines = _text(_PLAIN, "t (s),C1 (pF),C2 (pF)").splitlines(keepends=True)
    lines[400] = lines[400].replace(_PLAIN[399][1], f"{_PLAIN[399][1]}x3")
    return "".join(lines)


def _clipped() -> str:
    rows = [[t, h, f"{min(float(s), 5.1):.6f}"] for t, h, s in _PLAIN]
    return _text(rows, "t (s),C1 (pF),C2 (pF)")


CASES = [
    Case("comma, header with units", _csv(_text(_PLAIN, "t (s),C1 (pF),C2 (pF)")), says="38.4 pairs a second; 880 rows"),
    Case("semicolons, decimal commas, CRLF", _csv(_text(_comma(_PLAIN), "Zeit (s);C1 (pF);C2 (pF)", ";", "\r\n"))),
    Case("UTF-16 with tabs, as Excel saves text",
         _csv(_text(_PLAIN, "t (s)\tCIN1 (pF)\tCIN2 (pF)", "\t").encode("utf-16"))),
    Case("sep=; in the first line", _csv("sep=;\n" + _text(_PLAIN, "t (s);C1 (pF);C2 (pF)", ";"))),
    Case("millis", _csv(_text(_MS, "millis,C1,C2")), says="millis, ms; hard = C1, pF; .*38.4 pairs a second"),
    Case("milliseconds, by size only", _csv(_text(_MS, "time,C1,C2")), says="time, ms"),
    Case("microseconds, by size only", _csv(_text(_rows(lambda t: round(1e6 * t)), "timestamp,C1,C2")), says="us"),
    Case("nanoseconds of the epoch",
         _csv(_text(_rows(lambda t: 1_772_000_000_000_000_000 + round(1e9 * t)), "time,C1,C2")), says="ns"),
    Case("ISO dates with zone", _csv(_text(_rows(_iso), "time,C1 (pF),C2 (pF)"))),
    Case("date and time in two columns",
         _csv(_text([[_iso(t)[:10], _clock(t), h, s] for t, (_, h, s) in zip(measurement()[0], _PLAIN, strict=True)],
                    "Date,Time,C1 (pF),C2 (pF)"))),
    Case("times of day over midnight",
         _csv(_text(_rows(lambda t: f"{datetime(2026, 3, 9, 23, 59, 52) + timedelta(seconds=t):%H:%M:%S.%f}"),
                    "Time,C1 (pF),C2 (pF)")), "refused", "goes back by 8.64e"),
    Case("mm:ss.fff", _csv(_text(_rows(_minutes), "Elapsed,C1 (pF),C2 (pF)"))),
    Case("serial days of Excel", _csv(_text(_rows(_serial_days), "Time,C1 (pF),C2 (pF)")), "asked", "time_unit"),
    Case("lsl_timestamp", _csv(_text(_rows(lambda t: f"{51234.5 + t:.6f}"), "lsl_timestamp,C1,C2"))),
    Case("timeA, timeB",
         _csv(_text([[n, t, h, t, s] for n, (t, h, s) in enumerate(_PLAIN)], ",timeA,hard,timeB,soft"))),
    Case("farads", _csv(_text([[t, f"{float(h) * 1e-12:.9e}", f"{float(s) * 1e-12:.9e}"] for t, h, s in _PLAIN], "t_s,C1,C2"))),
    Case("a unit in one header of two", _csv(_text(_rows(scale=1e3, digits=3), "t_s,C1 (fF),C2")), says="no unit in .*C2.*fF"),
    Case("no header, columns asked", _csv(_text(_PLAIN), "--map", "time=1,hard=2,soft=3")),
    Case("other names", _csv(_text(_PLAIN, "t (s),A,B"), "--map", "hard=A,soft=B")),
    Case("one file a channel, joined by time", _two_files, says="no reading of the other channel"),
    Case("long format: time, channel, value",
         _csv(_text([[t, name, value] for t, *both in _PLAIN for name, value in zip(("C1", "C2"), both, strict=True)],
                    "time_s,channel,value_pF")), "asked", "columns: got none"),
    Case("gz", _csv(gzip.compress(_text(_PLAIN, "t (s),C1 (pF),C2 (pF)").encode()), name="other.csv.gz")),
    Case("standard input", _piped),
    Case("Excel, seconds", _saved("other.xlsx", lambda frame, path: frame.to_excel(path, index=False, startrow=1))),
    Case("Excel, dates", _saved("other.xlsx", _excel_dates)),
    Case("Parquet of another program", _saved("other.parquet", pandas.DataFrame.to_parquet)),
    Case("Arrow file", _saved("other.arrow", pandas.DataFrame.to_feather)),
    Case("palpate's own Parquet", _own_parquet),
    Case("XDF", _xdf),
    Case("summary rows at the end",
         _csv(_text(_PLAIN, "t (s),C1 (pF),C2 (pF)") + "\nMean,7.1,4.8\nStd,0.4,0.2\n"), ends="refused", says="line 883: 'Mean'"),
    Case("comments in between", _csv(_edited(300, "# pump on")), says=""),
    Case("a header again in the middle", _csv(_edited(300, "t (s),C1 (pF),C2 (pF)")), says="line 301 is no row .*left out"),
    Case("thousands separators", _csv(_text([[t, f"{float(h) * 1e3:,.3f}", f"{float(s) * 1e3:,.3f}"] for t, h, s in _PLAIN],
                                           "t (s);C1 (fF);C2 (fF)", ";")),
         "refused", "line 2: '6,900.000' .* is neither a number with a decimal point"),
    Case("swapped channels", _csv(_text(_PLAIN, "t (s),C2 (pF),C1 (pF)")), "told", "swapped"),
    Case("a clipped column", _csv(_clipped()), "told", "clipped"),
    Case("no times", _csv(_text([row[1:] for row in _PLAIN], "C1 (pF),C2 (pF)")), says="rate unknown"),
    Case("no times, rate given", _csv(_text([row[1:] for row in _PLAIN], "C1 (pF),C2 (pF)"), "--rate", str(RATE)),
         says="38.4 pairs a second"),
    Case("6.123 beside decimal commas",
         _csv(_text([[t.replace(".", ","), f"{float(h):.3f}", f"{float(s):.3f}"] for t, h, s in _PLAIN],
                    "t (s);C1 (pF);C2 (pF)", ";")), "refused", "with a decimal comma"),
    Case("steps of 1: seconds or milliseconds?", _csv(_text([[n, *row[1:]] for n, row in enumerate(_PLAIN)], "time,C1,C2")),
         "asked", "time_unit"),
    Case("whole-second stamps", _csv(_text(_rows(lambda t: _iso(t)[:19]), "time,C1 (pF),C2 (pF)")), "asked", "rate"),
    Case("t_ms with seconds", _csv(_text(_PLAIN, "t_ms,C1,C2")), "asked", "ms"),
    Case("names that leave it open", _csv(_text(_PLAIN, "t (s),A (pF),B (pF)")), "asked", "columns: got none"),
    Case("four capacitances", _csv(_text([[*row, *row[1:]] for row in _PLAIN], "t (s),C1 (pF),C2 (pF),C3 (pF),C4 (pF)")),
         "asked", "columns: got none"),
    Case("no unit, values of thousands", _csv(_text(_rows(scale=1e3), "t (s),C1,C2")), "asked", "unit: got none"),
    Case("per cent", _csv(_text(_PLAIN, "t (s),C1 (%),C2 (%)")), "asked", "in %"),
    Case("a wrong cell", _csv(_wrong_cell()), "refused", "line 401: .*x3' in column 2"),
    Case("a row cut in the middle", _csv(_edited(300, "7.8,6.9")), "refused", "line 301"),
    Case("text that is no table", _csv("dear reader,\nthis is no table\n" * 50), "refused", "no row of numbers"),
    Case("an old Excel file", _csv(b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(600), name="old.xls"), "refused", "xls"),
]  # fmt: skip
"""At least one of each kind of file and each common mistake."""
