"""What the page in a browser takes over from palpate: sentences and rules as functions, names, units, limits and settings."""

import json
from math import isinf
from typing import Any, Literal

from javascript import GIVEN
from palpate import Tracker, __version__, sentences, several
from palpate.ad7746.datasheet import CODES_PER_PF, LAST_CODE, SATURATED_CODES, SATURATED_PF, ZERO_CODE
from palpate.live.desk import states, touching
from palpate.recording import codes, integrity, lines, rows, sidecar
from palpate.sources.serial import cells, formats, names, numbering, pace
from palpate.tables.cell.numbers import OVERLOAD
from palpate.tables.units import PICOFARADS
from translated import translated

FUNCTIONS = [
    (sentences, "advice"),
    (several, "objections"),
    *((touching, name) for name in ("calm", "gap", "retaken", "swapped", "left_out")),
]
HELPERS = ("has", "common", "largest", "fixed", "general")


def tables() -> str:
    """Return the module `tables.js`."""
    given = sorted({name for name in GIVEN.values() if "." not in name and name != "Boolean"} | {*HELPERS})
    names_of = ", ".join(name for _, name in FUNCTIONS)
    return (
        f'import {{ {", ".join(given)} }} from "./given.js";\n{translated(FUNCTIONS)}\n'
        f"export {{ {names_of} }};\nexport const TABLES = {json.dumps(_values(), ensure_ascii=False)};\n"
    )


def _values() -> dict[str, Any]:
    return {
        "version": __version__,
        "urgent": [rule.__name__ for rule in states.URGENT if (touching, rule.__name__) in FUNCTIONS],
        "damaged": states.DAMAGED,
        "scenes": {"handheld": _settings("handheld"), "sliding": _settings("sliding")},
        "columns": rows.COLUMNS,
        "earlier": rows.EARLIER,
        "longest_row": lines.LONGEST_ROW,
        "codes": {"zero": ZERO_CODE, "per_pF": CODES_PER_PF, "largest": LAST_CODE},
        "most_code": codes.MOST,
        "saturated": [SATURATED_CODES, LAST_CODE - SATURATED_CODES],
        "full_scale_pF": SATURATED_PF,
        "schemas": sidecar.SCHEMAS,
        "largest_sidecar": sidecar.LARGEST,
        "most_marks": sidecar.MOST_MARKS,
        "source_failed": integrity.SOURCE_FAILED,
        "rescued": sidecar.RESCUED,
        "serial": {
            "marks": sorted(cells.MARKS),
            "separators": cells.SEPARATORS,
            "names": names._NAMES,
            "with_unit": names._WITH_UNIT,
            "small": names._SMALL,
            "pF": PICOFARADS,
            "ns": names.NANOSECONDS,
            "ranges": formats._RANGES,
            "times": formats.TIMES,
            "longest_ns": str(formats._LONGEST_NS),
            "overload": OVERLOAD,
            "ahead_s": numbering._AHEAD_NS / 1e9,
            "apart_s": numbering._APART_NS / 1e9,
            "restarts": numbering._RESTARTS,
            "wrong": pace._FACTOR,
            "wrong_pairs": pace._PAIRS,
            "wrong_s": pace._SPAN_NS / 1e9,
        },
    }


def _settings(scene: Literal["handheld", "sliding"]) -> dict[str, Any]:
    tracker = Tracker("handheld") if scene == "handheld" else Tracker("sliding")
    return {
        name: str(value) if isinstance(value, float) and isinf(value) else value
        for name, value in tracker.settings.items()
    }
