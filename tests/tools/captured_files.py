"""Files of terminal programs, instruments and languages with one known measurement, by what wrote them."""

import io
import zipfile
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from random import Random
from typing import Any

import openpyxl
from foreign_files import measurement  # tests/tools

BEGUN = datetime(2026, 3, 25, 14, 22, 10, 370_000, UTC)
T, HARD, SOFT = (values.tolist() for values in measurement())
Line = Callable[[float, float, float], str]


@dataclass(frozen=True)
class Captured:
    """A file, the options with which it is read, and a part of a note or message about it.

    With `asked`, a part of the error without options: what it advises is in the options.
    """

    data: bytes
    options: dict[str, Any] = field(default_factory=dict)
    note: str = ""
    asked: str = ""
    name: str = "capture.txt"


def lines(form: Line, head: str = "", end: str = "\n") -> bytes:
    """Return a file with a line for each pair."""
    rows = [form(*row) for row in zip(T, HARD, SOFT, strict=True)]
    return (head + end.join(rows) + end).encode()


def stamp(form: str, begun: datetime = BEGUN) -> Callable[[float], str]:
    """Return a function of a time, s, that gives its stamp; %L are milliseconds."""

    def stamped(t: float) -> str:
        when = begun + timedelta(seconds=t)
        return when.strftime(form.replace("%L", f"{when.microsecond // 1000:03}"))

    return stamped


def behind(form: str, between: str, begun: datetime = BEGUN) -> Line:
    """Return lines of two numbers behind a stamp."""
    stamped = stamp(form, begun)
    return lambda t, hard, soft: f"{stamped(t)}{between}{hard:.4f},{soft:.4f}"


def cells(delimiter: str, mark: str = ".", time: Callable[[float], str] = "{:.5f}".format) -> Line:
    """Return rows of a table: time and both channels."""
    return lambda t, hard, soft: delimiter.join(
        cell.replace(".", mark) if n else cell
        for n, cell in enumerate([time(t), f"{hard:.6f}", f"{soft:.6f}"])
    )


def _keysight(t: float, hard: float, soft: float) -> str:
    return f"{t:+.6E},{hard / 10:+.8E},{soft / 10:+.8E}"


_COUNTER = 2**32 - 10_000_000
_ISO = "%Y-%m-%d %H:%M:%S"
_FIRST = "hard is the first: columns=soft,hard if it is not"


def workbook(texts: bool) -> bytes:
    """Return a workbook of Excel, with numbers as texts if wanted."""
    book = openpyxl.Workbook()
    sheet: Any = book.active
    sheet.append(["t_s", "C1_pF", "C2_pF"])
    for t, hard, soft in zip(T, HARD, SOFT, strict=True):
        row = [round(t, 5), round(hard, 6), round(soft, 6)]
        sheet.append(list(map(str, row)) if texts else row)
    file = io.BytesIO()
    book.save(file)
    return file.getvalue()


def archive(**files: bytes) -> bytes:
    """Return a zip archive; __ in a name is a point."""
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as packed:
        for name, data in files.items():
            packed.writestr(name.replace("__", "."), data)
    return file.getvalue()


def _with_zero_bytes() -> bytes:
    rows = lines(cells(",", time=lambda t: f"{1e3 * t:.0f}"), "t_ms,C1_pF,C2_pF\n").splitlines()
    return (
        b"\n".join([*rows[:700], rows[700][:9] + bytes(512) + rows[712][6:], *rows[713:]]) + b"\n"
    )


def _with_boot_text(rows: Iterable[bytes]) -> bytes:
    middle = [b"Temp: 25.3 C", b"6.90"]
    all_rows = list(rows)
    return (
        b"\n".join(
            [b"ets Jul 29 2019 12:21:46", b"boot ok", *all_rows[:300], *middle, *all_rows[300:]]
        )
        + b"\n"
    )


_LVM = (
    "LabVIEW Measurement\t\nSeparator\tTab\nDecimal_Separator\t,\nMulti_Headings\tYes\n"
    "X_Columns\tOne\nDate\t2026/03/25\n***End_of_Header***\t\n\t\nChannels\t2\t\t\n"
    "Samples\t1\t1\t\nX0\t0,0E+0\t0,0E+0\t\n***End_of_Header***\t\t\t\n"
)

FILES: dict[str, Captured] = {
    # Lines that a terminal program captured.
    "Arduino IDE": Captured(lines(behind("%H:%M:%S.%L", " -> "), end="\r\n"), note=_FIRST),
    "Arduino IDE, names": Captured(
        lines(lambda t, h, s: f"{stamp('%H:%M:%S.%L')(t)} -> C1:{h:.4f} C2:{s:.4f}"),
        note="-> hard 6.9",
    ),
    "Arduino IDE, header": Captured(
        lines(
            lambda t, h, s: f"{stamp('%H:%M:%S.%L')(t)} -> {1e3 * t:.0f},{s:.4f},{h:.4f}",
            "14:22:10.300 -> t_ms,soft,hard\n",
        ),
    ),
    "Arduino IDE over midnight": Captured(
        lines(behind("%H:%M:%S.%L", " -> ", BEGUN.replace(hour=23, minute=59, second=50))),
        note="the time of day began again 1 time",
    ),
    "CoolTerm": Captured(lines(behind(f"{_ISO}.%L", "\t"))),
    "CoolTerm, colon before the milliseconds": Captured(lines(behind("%H:%M:%S:%L", " "))),
    "RealTerm, American": Captured(
        lines(behind("%m/%d/%Y %I:%M:%S.%L %p", ", ")),
        {"columns": {"time": 1, "hard": 2, "soft": 3}},
        asked="columns: got none",
    ),
    "PuTTY": Captured(
        lines(
            lambda t, h, s: f"{1e3 * t:.0f} {h:.4f} {s:.4f}",
            "=~=~=~=~= PuTTY log 2026.03.25 14:22:10 =~=~=~=~=\n",
        ),
        {"columns": "t_ms,hard,soft"},
        asked="columns: got none",
    ),
    "minicom": Captured(lines(behind(f"[{_ISO}.%L]", " "))),
    "Tera Term": Captured(lines(behind("[%a %b %d %H:%M:%S.%L %Y]", " "))),
    "YAT": Captured(lines(behind("(%H:%M:%S.%L)", " [RX] "))),
    "PlatformIO": Captured(lines(behind("%H:%M:%S.%L", " > "))),
    "ts of moreutils": Captured(
        lines(lambda t, h, s: f"{BEGUN.timestamp() + t:.6f} {h:.4f},{s:.4f}")
    ),
    "grabserial": Captured(lines(lambda t, h, s: f"[{t:.6f} 0.026041] {h:.4f},{s:.4f}")),
    "ESP-IDF": Captured(lines(lambda t, h, s: f"I ({300 + 1e3 * t:.0f}) probe: {h:.4f},{s:.4f}")),
    "Python logging": Captured(lines(behind(f"{_ISO},%L", " INFO "))),
    "Python logging, with a logger": Captured(lines(behind(f"{_ISO},%L", " - root - INFO - "))),
    "Python logging, default": Captured(
        lines(lambda t, h, s: f"INFO:root:t_ms={1e3 * t:.1f},hard={h:.4f},soft={s:.4f}")
    ),
    "journal of systemd": Captured(lines(behind("%b %d %H:%M:%S.%f", " host probe[12]: "))),
    "ISO 8601": Captured(lines(behind("%Y-%m-%dT%H:%M:%S.%f+00:00", " "))),
    "tabs everywhere": Captured(
        lines(lambda t, h, s: f"{stamp(f'{_ISO}.%f')(t)}\t{h:.4f}\t{s:.4f}")
    ),
    "JSON lines": Captured(
        lines(lambda t, h, s: f'{{"t_ms": {1e3 * t:.2f}, "hard": {h:.4f}, "soft": {s:.4f}}}')
    ),
    "JSON lines behind a stamp": Captured(
        lines(lambda t, h, s: f'{stamp("%H:%M:%S.%L")(t)} -> {{"soft": {s:.4f}, "hard": {h:.4f}}}')
    ),
    "palpate's own lines": Captured(
        lines(
            lambda t, h, s: (
                f"seq={T.index(t)},t_hard_us={1e6 * t:.0f},t_soft_us={1e6 * t:.0f},"
                f"hard_raw={round((h - 6) * 2**21 / 1.024) + 2**23},"
                f"soft_raw={round((s - 4) * 2**21 / 1.024) + 2**23},"
                "capdac_hard=42,capdac_soft=28,status=0"
            )
        )
    ),
    "CIN1, CIN2": Captured(
        lines(lambda t, h, s: f"CIN1={h:.4f};CIN2={s:.4f};time_ms={1e3 * t:.1f}")
    ),
    "Hard (fF)": Captured(
        lines(
            lambda t, h, s: (
                f"Time (ms): {1e3 * t:.1f}, Soft (fF): {1e3 * s:.1f}, Hard (fF): {1e3 * h:.1f}"
            )
        )
    ),
    "boot text, other text": Captured(
        _with_boot_text(
            lines(lambda t, h, s: f"t_ms={1e3 * t:.1f},hard={h:.4f},soft={s:.4f}").splitlines()
        ),
        note="2 lines were not read, the first: line 303 ('Temp: 25.3 C')",
    ),
    "columns behind a stamp": Captured(
        lines(lambda t, h, s: f"{stamp('%H:%M:%S.%L')(t)} -> {s:.4f},{h:.4f},25.1"),
        {"columns": "soft,hard,-"},
        asked="columns: got none",
    ),
    "columns with the stamp": Captured(
        lines(lambda t, h, s: f"{stamp('%H:%M:%S.%L')(t)} {s:.4f} {h:.4f} 25.1"),
        {"columns": "-,soft,hard,-"},
        asked="columns: got none",
    ),
    "a pattern": Captured(
        lines(lambda t, h, s: f"{stamp('%H:%M:%S.%L')(t)} -> A{h:.4f}pF B{s:.4f}pF"),
        {"pattern": "A(?P<hard>.*)pF B(?P<soft>.*)pF"},
        asked="'A6.8999pF' is not a number",
    ),
    "names in another order": Captured(
        lines(lambda t, h, s: f"{s:.4f},{h:.4f}", "weich,hart\n"),
        {"columns": "soft,hard", "rate": 38.4},
        asked="columns: got none",
    ),
    # Tables of instruments and languages.
    "LabVIEW": Captured(
        lines(
            cells("\t", ",", lambda t: f"{t:.5f}".replace(".", ",")),
            f"{_LVM}X_Value\tC1\tC2\tComment\n",
        ),
        note="no cell is below the name 'Comment'",
        name="capture.lvm",
    ),
    "LabVIEW, times of each": Captured(
        lines(
            lambda t, h, s: f"{t:.5f}\t{h:.6f}\t{t:.5f}\t{s:.6f}",
            f"{_LVM}X_Value\tC1\tX_Value\tC2\tComment\n",
        ),
        name="capture.lvm",
    ),
    "Rigol": Captured(
        lines(
            lambda t, h, s: f"{T.index(t)},{h / 10:.6e},{s / 10:.6e},,,",
            f"X,CH1,CH2,Start,Increment,\nSequence,Volt,Volt,-1.2e-02,{T[1]:.9e},\n",
        ),
        {"columns": {"hard": "CH1", "soft": "CH2"}, "unit": "V"},
        note="times by the header: -0.012 s + 0.0260417 s for each row",
        asked="2 (CH1 (Volt)), 3 (CH2 (Volt))",
    ),
    "Keysight": Captured(
        lines(_keysight, "x-axis,1,2\nsecond,Volt,Volt\n"),
        {"columns": {"hard": "1 (Volt)", "soft": "2 (Volt)", "time": "x-axis"}, "unit": "V"},
        asked="1 (x-axis (second)), 2 (1 (Volt)), 3 (2 (Volt))",
    ),
    "a row of units": Captured(lines(cells(";"), "Time;C1;C2\n(s);(pF);(pF)\n")),
    "R": Captured(
        lines(
            lambda t, h, s: f'"{T.index(t) + 1}" {1e3 * t:.1f} {h:.4f} {s:.4f}',
            '"t_ms" "C1_pF" "C2_pF"\n',
        ),
        note="one name fewer than columns: the first column has the names of the rows",
    ),
    "R without quotes": Captured(
        lines(
            lambda t, h, s: f"{T.index(t) + 1}\t{1e3 * t:.1f}\t{h:.4f}\t{s:.4f}",
            "t_ms\tC1_pF\tC2_pF\n",
        ),
        note="one name fewer than columns",
    ),
    "fewer names than cells": Captured(
        lines(lambda t, h, s: f"{t:.4f},{h:.6f},{s:.6f},256.4,256.3", "timestamp,CH0_pF\n"),
        {"columns": {"hard": 2, "soft": 3, "time": 1}},
        note="2 names (timestamp, CH0_pF) above 5 columns: not used",
        asked="2 names above 5 columns: timestamp, CH0_pF",
    ),
    "durations of MATLAB": Captured(
        lines(cells(",", time=lambda t: f"{t:.5g} sec"), "Time,C1_pF,C2_pF\n")
    ),
    "American dates": Captured(
        lines(cells(",", time=lambda t: stamp("%m/%d/%Y %I:%M:%S.%L %p")(t)), "Time,C1_pF,C2_pF\n")
    ),
    "dates with points": Captured(
        lines(cells(";", ",", stamp("%d.%m.%Y %H:%M:%S,%L")), "Zeit;C1 (pF);C2 (pF)\n")
    ),
    "an ambiguous date": Captured(
        lines(cells(",", time=stamp("%d/%m/%Y %H:%M:%S.%L", BEGUN.replace(day=5))), "time,C1,C2\n"),
        note="5/3/2026 is a day of May or of March: only the time of day is used",
    ),
    "units in lower case": Captured(
        lines(cells(",", time=lambda t: f"{1e3 * t:.1f}"), "t (MS),C1 (pf),C2 (PF)\n")
    ),
    "U+2212": Captured(
        lines(
            lambda t, h, s: f"{t:.4f},\u2212{10 - h:.4f},\u2212{10 - s:.4f}", "t_s,C1_pF,C2_pF\n"
        ),
        note="the minus sign U+2212 is read as a minus",
    ),
    "-1.#IND": Captured(
        lines(
            lambda t, h, s: (
                f"{t:.4f},{'-1.#IND' if round(1e4 * h) % 50 == 0 else format(h, '.4f')},{s:.4f}"
            ),
            "t_s,C1_pF,C2_pF\n",
        ),
        note="rows have no value in a channel: left out",
    ),
    "-nan(ind)": Captured(
        lines(
            lambda t, h, s: (
                f"{t:.4f},{h:.4f},{'-nan(ind)' if round(1e4 * h) % 50 == 0 else format(s, '.4f')}"
            ),
            "t_s,C1_pF,C2_pF\n",
        ),
        note="rows have no value in a channel: left out",
    ),
    "a block of zero bytes": Captured(
        _with_zero_bytes(), note="line 701 with 512 zero bytes, as of a card that lost its power"
    ),
    "micros() that wraps": Captured(
        lines(
            cells(",", time=lambda t: str((_COUNTER + round(1e6 * t)) % 2**32)),
            "micros,C1_pF,C2_pF\n",
        ),
        note="a counter of 32 bits in us began again 1 time: the times go on",
    ),
    "micros() / 1000 that wraps": Captured(
        lines(
            cells(",", time=lambda t: f"{(_COUNTER + round(1e6 * t)) % 2**32 / 1e3:.3f}"),
            "t_ms,C1_pF,C2_pF\n",
        ),
        note="a counter of 32 bits in us began again 1 time: the times go on",
    ),
    "D exponents": Captured(
        lines(
            lambda t, h, s: f" {t:.5f}D+00  {h / 10:.7f}D+01  {s / 10:.7f}D+01", "t_s C1_pF C2_pF\n"
        )
    ),
    "UTF-16 without its mark": Captured(
        lines(cells("\t"), "t_s\tC1_pF\tC2_pF\n").decode().encode("utf-16-le")
    ),
    "a workbook with another suffix": Captured(
        workbook(texts=False),
        note="a workbook of Excel, though its name ends with .csv",
        name="capture.csv",
    ),
    "a workbook of texts": Captured(
        workbook(texts=True), note="the cells of the workbook are text", name="capture.xlsx"
    ),
    "text named .xlsx": Captured(
        lines(cells(","), "t_s,C1_pF,C2_pF\n"),
        note="text, though its name ends with .xlsx",
        name="capture.xlsx",
    ),
}
"""Each is read right: without options, or with those that its error advises."""

REFUSED: dict[str, tuple[bytes, str]] = {
    ".ods": (
        archive(mimetype=b"application/vnd.oasis.opendocument.spreadsheet", content__xml=b"<x/>"),
        "a spreadsheet of LibreOffice (.ods): save it as .xlsx or .csv",
    ),
    ".zip": (
        archive(run__csv=lines(cells(","))),
        "a zip archive of run.csv: unpack it, and open one of its files",
    ),
    ".docx": (
        archive(**{"word/document__xml": b"<x/>"}),
        "a text document: save its table as .csv",
    ),
    ".xls": (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(600), "(.xls): save it as .xlsx or .csv"),
    ".h5": (b"\x89HDF\r\n\x1a\n" + bytes(600), "an HDF5 file (.h5, or .mat of MATLAB 7.3)"),
    ".mat": (b"MATLAB 5.0 MAT-file" + bytes(600), "a file of MATLAB (.mat)"),
    ".npy": (b"\x93NUMPY\1\0" + bytes(600), "an array of numpy (.npy)"),
    ".html": (b"<html><table><tr><td>1</td></tr></table></html>", "a page of HTML"),
    "bytes": (bytes(range(256)) * 20, "not a table that palpate reads"),
    "soft is not hard": (
        lines(lambda t, h, s: f"{s:.4f},{h:.4f}", "C2 (pF),C1 (pF)\n")[:-40]
        + b"x.4,4.9\n6.9,4.7\n",
        "is neither a number",
    ),
    "two dates": (
        lines(
            lambda t, h, s: (
                f"{'2/3/2026' if t < 9 else '2/9/2026'} {stamp('%H:%M:%S.%f')(t)},{h:.4f},{s:.4f}"
            ),
            "time,C1,C2\n",
        ),
        "is no time; write it as 2026-11-21",
    ),
    "a line of one channel": (
        lines(lambda t, h, s: f">hard:{h:.4f}\n>soft:{s:.4f}"),
        "no row of numbers",
    ),
}
"""Each is refused in words."""

_STAMPS: list[Callable[[float], str]] = [
    lambda _: "",
    *map(
        stamp,
        [
            "%H:%M:%S.%L",
            f"{_ISO}.%L",
            f"{_ISO},%L",
            "%Y-%m-%dT%H:%M:%S.%fZ",
            f"[{_ISO}.%f]",
            "%m/%d/%Y %I:%M:%S.%L %p",
            "%d.%m.%Y %H:%M:%S.%L",
            "%b %d %H:%M:%S.%f",
            "%H:%M:%S",
        ],
    ),
    lambda t: f"{BEGUN.timestamp() + t:.3f}",
    lambda t: f"[{t:12.6f}]",
]
_BETWEEN = [" -> ", " ", "\t", ", ", ";", " INFO ", " - probe - DEBUG - ", " [RX] ", ": ", " > "]
_UNITS = {"": 1.0, "_pF": 1.0, "_fF": 1e3, " (pF)": 1.0, " (FF)": 1e3, "_nF": 1e-3}


def random_capture(random: Random) -> bytes:
    """Return the measurement as a program may have captured it, at times with a fault."""
    stamped = random.choice(_STAMPS)
    between = random.choice(_BETWEEN)
    unit = random.choice(list(_UNITS))
    digits = random.choice([4, 5]) + (3 if unit == "_nF" else 0)
    mark = random.choice(".......,")
    delimiter = random.choice([",", ", ", ";", "\t", " ", " | "])
    hard_name, soft_name = random.choice(
        [
            ("hard", "soft"),
            ("C1", "C2"),
            ("CIN1", "CIN2"),
            ("cap1", "cap2"),
            ("A", "B"),
            ("", ""),
            ("", ""),
        ]
    )
    time_name = random.choice(["", "", "t_ms", "t_s", "time", "micros", "seq"])
    sign = random.choice("=:")
    swapped = bool(hard_name) and random.random() < 0.3
    extra = random.choice([*[""] * 9, "T=25.1", "25.1", "ok"])
    times = {
        "t_ms": lambda t: f"{1e3 * t:.1f}",
        "t_s": lambda t: f"{t:.4f}",
        "time": lambda t: f"{t:.4f}",
        "micros": lambda t: f"{1e6 * t + 2**32 - 9e6:.0f}",
        "seq": lambda t: f"{T.index(t)}",
    }

    def line(t: float, hard: float, soft: float) -> str:
        parts = []
        if time_name:
            value = times[time_name](t)
            if time_name == "micros":
                value = str(int(value) % 2**32)
            parts.append(f"{time_name}{sign}{value}" if hard_name else value)
        both = [(hard_name, hard), (soft_name, soft)]
        for name, pF in both[:: -1 if swapped else 1]:
            text = f"{pF * _UNITS[unit]:.{digits}f}".replace(".", mark)
            parts.append(f"{name}{unit}{sign}{text}" if name else text)
        if extra:
            parts.append(extra)
        begin = stamped(t)
        return f"{begin}{between}{delimiter.join(parts)}" if begin else delimiter.join(parts)

    rows = [line(*row) for row in zip(T, HARD, SOFT, strict=True)]
    for text in random.choice([[], [], ["boot ok"], ["Temp 25.1", rows[300][:-3]], [""]]):
        rows.insert(random.choice([0, 1, 300]), text)
    end = random.choice(["\n", "\r\n"])
    data = (end.join(rows) + end).encode(random.choice(["utf-8", "utf-8-sig", "utf-16"]))
    return data[:-4] if random.random() < 0.2 else data
