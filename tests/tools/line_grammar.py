"""A strict grammar of a serial line without options, written from docs/serial.md, and lines near its edge.

It shares no code with `palpate.sources`.
"""

import json
import re
from functools import reduce
from math import isnan, nan
from random import Random

PF = {"af": 1e-6, "ff": 1e-3, "pf": 1, "nf": 1e3, "uf": 1e6, "f": 1e12}
NS = {"s": 1e9, "ms": 1e6, "us": 1e3, "ns": 1}
WHOLE = {"seq": (0, 2**32 - 1), "hard_raw": (-1, 2**24 - 1), "soft_raw": (-1, 2**24 - 1), "capdac_hard": (0, 255),
         "capdac_soft": (0, 255), "status": (0, 8), "t_uncertainty_us": (-1, 2**31 - 1)}  # fmt: skip
NUMBER = r"[+-]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?"
MARK = r"[+-]*(?:OL|OVL|OVLD|OVER|OVERLOAD|OVF|NAN|INF)|NULL"
UNITS = "|".join((*PF, *NS))
Cells = list[tuple[str, str]]


def strict(line: bytes) -> tuple[float, float] | None:
    """Return the capacitances, pF, that a first line gives; nan: lost; None: it is not read."""
    line = line.strip()
    if line.startswith(b"#"):
        return None
    if summed := re.fullmatch(rb"(.*)\*([0-9A-Fa-f]{2})", line, re.DOTALL):
        line = summed[1]
        if reduce(lambda a, b: a ^ b, line, 0) != int(summed[2], 16):
            return None
    text = line.decode(errors="replace").strip()
    if text.startswith("{"):
        try:
            cells = json.loads(
                text, object_pairs_hook=list, parse_int=str, parse_float=str, parse_constant=str
            )
        except (ValueError, RecursionError):
            return None
        return _pair([(label, "nan" if value is None else str(value)) for label, value in cells])
    text = text[1:-1] if text[:1] + text[-1:] == "()" else text.removeprefix(">")
    text = re.sub(r"([A-Za-z_]\w*) ?[(\[]([A-Za-z]+)[)\]](?=\s*[=:])", r"\1_\2", text)
    parts = re.split(r"\s*[,;|]\s*|\s+", re.sub(r"\s*([=:])\s*", r"\1", text.strip()))
    parts = parts[:-1] if parts[-1:] == [""] else parts
    named = [re.match(r"([A-Za-z_][A-Za-z0-9_]*)[=:]", part) for part in parts]
    labels = [match[1] if match else "" for match in named]
    if any(labels):
        return _pair(
            [(label, part[len(label) + 1 :]) for label, part in zip(labels, parts, strict=True)]
        )
    return (
        _pair([("hard", parts[0]), ("soft", parts[1])])
        if len(parts) == 2 and all("." in p for p in parts)
        else None
    )


def _pair(cells: Cells) -> tuple[float, float] | None:
    found: dict[str, float] = {}
    bare = []
    for label, text in cells:
        role, unit = _role(label)
        value = _value(role, unit, text)
        if role in found or value is None:
            return None
        found[role] = value
        bare += [abs(value)] if role in ("hard", "soft") and not unit and not isnan(value) else []
    channels = set(found) & {"hard", "soft", "hard_raw", "soft_raw"}
    if channels not in ({"hard", "soft"}, {"hard_raw", "soft_raw"}) or any(
        not 0.01 <= size <= 100 for size in bare
    ):
        return None
    if ("t_hard" in found) != ("t_soft" in found) or {"t", "t_hard"} <= set(found):
        return None
    if "t_hard" in found and abs(found["t_hard"] - found["t_soft"]) > 10e9:
        return None
    codes = {name: found[f"{name}_raw"] for name in ("hard", "soft") if name not in found}
    found |= {
        name: nan if code < 0 else (code - 2**23) * 8.192 / 2**24 for name, code in codes.items()
    }
    hard, soft = found["hard"], found["soft"]
    return (
        (hard, soft)
        if "status" not in found or (found["status"] == 8) == isnan(hard + soft)
        else None
    )


def _role(label: str) -> tuple[str, str]:
    """Return what a name means, "" if nothing, and its unit."""
    if label.strip() == "T":  # a temperature
        return "", ""
    plain = {"millis": "t_ms", "micros": "t_us"}.get(label.strip().lower(), label.strip().lower())
    if plain in WHOLE:
        return plain, ""
    match = re.fullmatch(rf"(hard|soft|c1|c2|time|t_hard|t_soft|t)(?:_({UNITS}))?", plain)
    if not match:
        match = re.fullmatch(
            rf"({TABLE_NAMES})(?:[ _]({UNITS}|sec)| ?[(\[]({UNITS}|sec)[)\]])?", plain
        )
        match = match and re.fullmatch(
            r"(\S+) (\S*)", f"{table_role(match[1])} {match[2] or match[3] or ''}"
        )
    if not match:
        return "", ""
    role, unit = {"c1": "hard", "c2": "soft", "time": "t"}.get(match[1], match[1]), match[2] or ""
    unit = unit.replace("sec", "s")
    return (role, unit) if unit in ("", *(PF if role in ("hard", "soft") else NS)) else ("", "")


TABLE_NAMES = (
    r"c?[ _]?(?:hard|soft)(?:[ _]?bump)?|(?:c|cin|cap|capacitance)[ _]?[12]"
    r"|t|time|time[ _]?stamp|elapsed(?:[ _]?time)?|(?:t|time)[ _]?(?:hard|soft)"
)


def table_role(name: str) -> str:
    """Return the role of a name of a table."""
    if name[0] in "te":
        side = re.search("hard|soft", name)
        return f"t_{side[0]}" if side else "t"
    return "hard" if "hard" in name or name.endswith("1") else "soft"


def _value(role: str, unit: str, text: str) -> float | None:
    """Return pF, ns or a whole number; None: it is none."""
    if role in WHOLE:
        low, high = WHOLE[role]
        return (
            int(text) if re.fullmatch(r"-?[0-9]{1,20}", text) and low <= int(text) <= high else None
        )
    if not role or not re.fullmatch(f"{NUMBER}|{MARK}", text, re.IGNORECASE):
        return None
    value = float(text) if re.fullmatch(NUMBER, text) and abs(float(text)) < 1e30 else nan
    if role in ("hard", "soft"):
        return value * PF[unit or "pf"]
    return value * NS[unit] if unit and 0 <= value * NS[unit] < 2**62 else None


_PIECES = ["hard", "soft", "Hard", "C1", "C2", "hard_raw", "soft_raw", "t", "t_ms", "t_hard_us", "t_soft_us", "seq", "status", "capdac_hard",
           "millis", "hard_fF", "soft_pF", "humidity", "CIN1", "CIN2", "Hard (pF)", "timestamp", "cap_1", "=", ":", " = ", ",", ", ", ";", "|", "\t", " ", "6.92", "4.69",
           "-0.5", ".5", "7", "7.", "0", "8388608", "16777215", "-1", "1e-3", "6,92", "1234", "9.9E+37", "1e31", "1_0", "0x1B", "OL", "-OL", "nan",
           "inf", "pF", "{", "}", '"', '"hard":6.92', '"soft":4.69', '"t_ms":5', "null", "1e400", "Infinity",
           "NaN", "true", "12:21:46", "Jul", "*00", "#", "+", "-", ".", "e", "\xa0", "\x00", "é",
           "(", ")", ">", ",)"]  # fmt: skip
_GOOD = ["hard:6.92,soft:4.69", "C1=6.92 C2=4.69", '{"hard":6.92,"soft":4.69}', '{"seq":3,"t_ms":5,"C1":1e1,"C2":0.5}', "6.92,4.69",
         "hard=6,92;soft=4,69", "hard_fF=6920|soft_pF=4.69", "-0.5 +0.25", "hard=1,soft=2*3E",
         "seq=1,t_hard_us=5,t_soft_us=6,hard_raw=8388608,soft_raw=1,capdac_hard=4,capdac_soft=5,status=0", "hard=OL,soft=1",
         "hard_raw=-1,soft_raw=5,status=8", "1234,6.92,4.69", "12:21:46 6.92 4.69", "(6.92, 4.69)", ">hard:6.92,soft:4.69",
         "6.92,4.69,", "CIN1=6.92,CIN2=4.69", "Hard (fF): 6920; Soft (pF): 4.69"]  # fmt: skip


def line_of(rng: Random) -> bytes:
    """Return a line: one of good ones with some changes, or pieces in any order; with a checksum at times."""
    if rng.random() < 0.3:
        text = "".join(rng.choices(_PIECES, k=rng.randint(1, 9)))
    else:
        text = rng.choice(_GOOD)
        for _ in range(rng.choice((0, 1, 1, 2, 3))):
            at = rng.randint(0, len(text))
            text = (
                text[:at]
                + rng.choice(("", rng.choice(_PIECES)))
                + text[at + rng.choice((0, 0, 1, 2)) :]
            )
    line = (
        text.encode("utf-8" if rng.random() < 0.9 else "latin-1", "replace")
        .replace(b"\n", b"")
        .replace(b"\r", b"")
    )
    if rng.random() < 0.1:
        line = line.strip()
        line += b"*%02X" % (reduce(lambda a, b: a ^ b, line, 0) ^ (rng.random() < 0.2))
    return line
