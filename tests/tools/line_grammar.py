"""A strict grammar of serial lines, written from docs/serial.md by regular expressions, and lines near its edge.

It shares no code with `palpate.sources.serial`, and knows lines without options only.
"""

import json
import re
from functools import reduce
from math import isnan, nan
from random import Random

PF = {"aF": 1e-6, "fF": 1e-3, "pF": 1, "nF": 1e3, "uF": 1e6, "µF": 1e6, "μF": 1e6, "mF": 1e9, "F": 1e12}
ANY_CASE = {"af": 1e-6, "ff": 1e-3, "pf": 1, "nf": 1e3, "uf": 1e6}
TIME = ("s", "sec", "ms", "us", "µs", "μs", "ns")
DEGREES = ("C", "°C", "degC", "deg.C")
NAMES = {
    "hard": r"hard|c1|c_hard|chard",
    "soft": r"soft|c2|c_soft|csoft",
    "t": r"t|time|timestamp",
    "t_hard": r"t_hard|time_hard",
    "t_soft": r"t_soft|time_soft",
    "seq": r"seq|sequence|sample|index|count|n",
    "temperature": r"temperature|temp",
    "hard_raw": r"hard_raw|raw_hard",
    "soft_raw": r"soft_raw|raw_soft",
    "capdac_hard": r"capdac_hard",
    "capdac_soft": r"capdac_soft",
    "status": r"status",
    "t_uncertainty_us": r"t_uncertainty_us",
}
WHOLE = {"seq": (0, 2**32 - 1), "hard_raw": (-1, 2**24 - 1), "soft_raw": (-1, 2**24 - 1), "capdac_hard": (0, 255),
         "capdac_soft": (0, 255), "status": (0, 8), "t_uncertainty_us": (-1, 2**31 - 1)}  # fmt: skip
MARK = r"[+-]?(?:OL|OVL|OVLD|OVER|OVERLOAD|OVF|NAN|INF)"
FIXED = r"(?:[0-9]+(?:\.[0-9]*|,[0-9]+)?|\.[0-9]+)"
NUMBER = rf"[+-]?{FIXED}(?:[eE][+-]?[0-9]+)?"
CLOCK = r"[0-9]{1,4}(?:[-:/T][0-9]{1,4})+(?:\.[0-9]{1,9})?Z?"
UNITS = "|".join(re.escape(unit) for unit in (*PF, *ANY_CASE, *(u.upper() for u in ANY_CASE), *TIME, *DEGREES))
LABEL = r"[A-Za-z_][A-Za-z0-9_.]*(?:\s*[\(\[][A-Za-zµμ°.]{1,6}[\)\]])?"
CELL = re.compile(
    rf"(?:(?P<label>{LABEL})\s*[=:]\s*)?(?:(?P<number>{NUMBER})(?:\s*(?P<unit>{UNITS}))?|"
    rf"(?P<mark>(?i:{MARK}))(?:\s+(?P<of>{UNITS}))?)|(?P<clock>{CLOCK})"
)
GAPS = {"\t": r"[^\S\t]*\t[^\S\t]*", ";": r"\s*;\s*", "|": r"\s*\|\s*", ",": r"\s*,\s*", " ": r"\s+"}
_IN_BLANKS = [(r"\s*([=:])\s*", r"\1"), (r"\s+([\(\[])", r"\1"), (rf"(?<=\S)\s+({UNITS})(?=\s|$)", "\0\\1")]
Cells = list[tuple[str, str, str]]


def strict(line: bytes) -> tuple[float, float] | None:
    """Return the capacitances, pF, that a line sent twice gives; nan: lost; None: the line is none."""
    try:
        text = line.decode().strip()
    except UnicodeDecodeError:
        text = line.decode("latin-1").strip()
    if text.startswith("#") or "\0" in text:
        return None
    if summed := re.fullmatch(r"(.*)\*([0-9A-Fa-f]{2})", text, re.DOTALL):
        body = line.strip()[:-3]
        if reduce(lambda a, b: a ^ b, body, 0) != int(summed[2], 16):
            return None
        text = summed[1].strip()
    found = _json(text) if text.startswith("{") else _cells(text)
    return None if found is None else _pair(*found)


def _json(text: str) -> tuple[str, Cells] | None:
    try:
        pairs = json.loads(
            text, object_pairs_hook=lambda found: found, parse_float=repr, parse_int=repr, parse_constant=repr
        )
    except (ValueError, RecursionError):
        return None
    cells = []
    for label, value in pairs:
        if value is None:
            cells.append((label, "nan", ""))
        elif isinstance(value, str) and value[:1] == "'":
            cells.append((label, value.strip("'").replace("Infinity", "INF"), ""))
        else:
            return None
    return ("{", cells) if cells else None


def _cells(text: str) -> tuple[str, Cells] | None:
    for sep, gap in GAPS.items():
        if sep not in text:
            continue
        body = text
        for old, new in _IN_BLANKS if sep == " " else ():
            body = re.sub(old, new, body)
        cells = [CELL.fullmatch(part.replace("\0", " ") if sep == " " else part) for part in re.split(gap, body)]
        if len(cells) > 1 and all(cells):
            return sep, [_of(cell) for cell in cells if cell]
    return None


def _of(cell: re.Match[str]) -> tuple[str, str, str]:
    if cell["clock"]:
        return "", cell["clock"], "clock"
    return cell["label"] or "", cell["number"] or cell["mark"], cell["unit"] or cell["of"] or ""


def _pair(sep: str, cells: Cells) -> tuple[float, float] | None:
    labelled = any(label for label, _, _ in cells)
    if not labelled and (sep == "{" or len(cells) != 2):
        return None
    roles: dict[str, tuple[str, str]] = {}
    for (label, text, unit), role in zip(cells, ["hard", "soft"] * len(cells), strict=False):
        known = _role(label) if labelled else (role, "")
        if (
            known is None
            or known[0] in roles
            or unit == "clock"
            or (unit and known[1] and _scale(known[0], unit) != _scale(*known))
        ):
            return None
        roles[known[0]] = text, unit or known[1]
    numbers = [text for text, _ in roles.values()]
    commas = [text for text in numbers if "," in text]
    if commas and (
        sep == ","
        or any("." in text for text in numbers)
        or all(re.fullmatch(r"[+-]?[1-9][0-9]{0,2},[0-9]{3}", text) for text in commas)
    ):
        return None
    if not _valid(roles):
        return None
    pair = tuple(_channel(roles, name) for name in ("hard", "soft"))
    unsaid = "hard" in roles and not roles["hard"][1]
    if unsaid and not all(isnan(value) or 0.01 <= abs(value) <= 100 for value in pair):
        return None
    if not labelled and not _is_guess(list(roles.values()), pair):
        return None
    status = int(roles["status"][0]) if "status" in roles else None
    lost = isnan(pair[0] + pair[1])
    return None if status is not None and (status == 8) != lost else (pair[0], pair[1])


def _role(label: str) -> tuple[str, str] | None:
    """Return what a name means, and its unit."""
    plain = re.sub(r"\s+([\(\[])", r"\1", label).strip()
    if found := {"millis": "ms", "micros": "us"}.get(plain.casefold()):
        return "t", found
    for role, names in NAMES.items():
        if re.fullmatch(names, plain, re.IGNORECASE):
            return role, ""
        match = re.fullmatch(rf"(?:{names})(?:_|\(|\[)([^\)\]]+?)[\)\]]?", plain, re.IGNORECASE)
        if match and match[1] and _scale(role, match[1]) is not None and _closed(plain):
            return role, match[1]
    return None


def _closed(name: str) -> bool:
    return re.fullmatch(r"[^()\[\]]+(?:\([^()\[\]]+\)|\[[^()\[\]]+\])?", name) is not None


def _scale(role: str, unit: str) -> float | None:
    if role in ("hard", "soft"):
        return PF.get(unit, ANY_CASE.get(unit.lower()) if unit in (unit.lower(), unit.upper()) else None)
    if role in ("t", "t_hard", "t_soft"):
        return {"s": 1e9, "sec": 1e9, "ms": 1e6, "ns": 1}.get(unit, 1e3) if unit in TIME else None
    return 1 if role == "temperature" and unit in DEGREES else None


def _valid(roles: dict[str, tuple[str, str]]) -> bool:
    channels = set(roles) & {"hard", "soft", "hard_raw", "soft_raw"}
    if channels not in ({"hard", "soft"}, {"hard_raw", "soft_raw"}):
        return False
    if ("t_hard" in roles) != ("t_soft" in roles) or {"t", "t_hard"} <= set(roles):
        return False
    if channels == {"hard", "soft"} and bool(roles["hard"][1]) != bool(roles["soft"][1]):
        return False
    if not all(_is_valid(role, *said) for role, said in roles.items()):
        return False
    times = [
        _number(text) * (_scale(role, unit) or 0)
        for role, (text, unit) in roles.items()
        if role in ("t_hard", "t_soft")
    ]
    return not times or abs(times[0] - times[1]) <= 10e9


def _is_valid(role: str, text: str, unit: str) -> bool:
    if role in WHOLE:
        low, high = WHOLE[role]
        return not unit and re.fullmatch(r"-?[0-9]{1,20}", text) is not None and low <= int(text) <= high
    is_number = re.fullmatch(NUMBER, text) is not None
    if role.startswith("t") and role != "temperature":
        scale = _scale(role, unit)
        return bool(is_number and scale) and 0 <= _number(text) * (scale or 0) < 2**62 and _number(text) < 1e30
    return (not unit or _scale(role, unit) is not None) and (
        is_number or re.fullmatch(MARK, text, re.IGNORECASE) is not None
    )


def _number(text: str) -> float:
    return float(text.replace(",", ".")) if re.fullmatch(NUMBER, text) else nan


def _channel(roles: dict[str, tuple[str, str]], name: str) -> float:
    if name not in roles:
        code = int(roles[f"{name}_raw"][0])
        return nan if code < 0 else (code - 2**23) * 8.192 / 2**24
    text, unit = roles[name]
    value = _number(text)
    return value * (_scale(name, unit or "pF") or nan) if abs(value) < 1e30 else nan


def _is_guess(said: list[tuple[str, str]], pair: tuple[float, ...]) -> bool:
    """Return whether two numbers without names may be capacitances."""
    if any(re.fullmatch(MARK, text, re.IGNORECASE) for text, _ in said):
        return False
    if all(unit for _, unit in said):
        return True
    return not any(map(isnan, pair)) and all(re.search("[.,eE]", text) for text, _ in said)


_PIECES = ["hard", "soft", "Hard", "C1", "C2", "c_hard", "hard_raw", "soft_raw", "t", "t_ms", "t_hard_us", "t_soft_us", "seq", "n", "temp",
           "status", "capdac_hard", "millis", "hard_fF", "soft_pF", "C1 (pF)", "C2 [fF]", "humidity", "=", ":", ": ", " = ", ",", ", ", ";", "|",
           "\t", " ", "  ", "6.92", "4.69", "-0.5", ".5", "7", "7.", "0", "8388608", "16777215", "-1", "1e-3", "6,92", "4,690", "1,234", "0,5",
           "1234", "9.9E+37", "1e31", "1_0", "0x1B", "OL", "-OL", "nan", "inf", "pF", " pF", " fF", "nF", "F", "pf", " C", "degC", "°C", "V", "%",
           "ms", " us", "{", "}", '"', '"hard":6.92', '"soft":4.69', '"t_ms":5', "null", "NaN", "true", "12:21:46", "2026-11-22", "Jul", "*00",
           "#", "(", ")", "[", "]", "->", "+", "-", ".", "e", "\xa0", "\x00", "é"]  # fmt: skip
_GOOD = ["hard:6.92,soft:4.69", "C1=6.92 C2=4.69", '{"hard":6.92,"soft":4.69}', '{"seq":3,"t_ms":5,"C1":1e3,"C2":.5}'.replace(".5}", "0.5}"),
         "6.92,4.69", "6.92 pF, 4.69 pF", "6.92fF\t4.69fF", "hard=6,92;soft=4,69", "hard_fF=6920|soft_pF=4.69", "-0.5 +0.25",
         "seq=1,t_hard_us=5,t_soft_us=6,hard_raw=8388608,soft_raw=1,capdac_hard=4,capdac_soft=5,status=0",
         "C1 (pF): 6.92, C2 (pF): 4.69", "t=12 ms hard=6.92 pF soft=4.69 pF", "hard=OL,soft=1", "hard=1,soft=2*0A", "temp:20.5 C;hard:1.5;soft:2",
         "hard_raw=-1,soft_raw=5,status=8", "1,5 2,5", "1234,6.92,4.69", "12:21:46 6.92 4.69", "ets Jul 29 2019"]  # fmt: skip


def line_of(rng: Random) -> bytes:
    """Return a line: one of good ones with some changes, or pieces in any order; with a checksum at times."""
    if rng.random() < 0.3:
        text = "".join(rng.choices(_PIECES, k=rng.randint(1, 9)))
    else:
        text = rng.choice(_GOOD)
        for _ in range(rng.choice((0, 1, 1, 2, 3))):
            at = rng.randint(0, len(text))
            text = text[:at] + rng.choice(("", rng.choice(_PIECES))) + text[at + rng.choice((0, 0, 1, 2)) :]
    line = text.encode("utf-8" if rng.random() < 0.9 else "latin-1", "replace").replace(b"\n", b"").replace(b"\r", b"")
    if rng.random() < 0.1:
        line = line.strip()
        line += b"*%02X" % (reduce(lambda a, b: a ^ b, line, 0) ^ (rng.random() < 0.2))
    return line
