"""Make docs/static/formulas.woff: the part of a font with a MATH table that the formulas of docs/ need.

    python tests/tools/formula_font.py STIXTwoMath-Regular.ttf docs/static/formulas.woff

The font is STIX Two Math, version 2.11, under the SIL Open Font License (docs/static/formulas-font-licence.txt). Needs
fonttools and zopfli.
"""

import html
import re
import sys
import unicodedata
from collections.abc import Iterable

UNICODES = (
    "20-7E,A0,AF,B1,B7,D7,393,394,398,39B,3A3,3A6,3A8,3A9,3B1-3C9,2015,2016,2026,2032,2061,2190-2192,2202,2208,2211,"
    "2212,221A,221D,221E,222B,2248,2260,2264,2265,22C5,22EF,210E,1D434-1D467,1D6E4,1D6E5,1D6E9,1D6EC,1D6F4,1D6F7,1D6F9,1D6FA,"
    "1D6FC-1D71B"
)
"""Latin and Greek letters, upright and italic, and the usual operators."""

_ITALIC = {
    **{chr(code): chr(0x1D434 + code - ord("A")) for code in range(ord("A"), ord("Z") + 1)},
    **{chr(code): chr(0x1D44E + code - ord("a")) for code in range(ord("a"), ord("z") + 1)},
    "h": "\N{PLANCK CONSTANT}",
    **{chr(0x3B1 + step): chr(0x1D6FC + step) for step in range(25)},
}


def characters(pages: Iterable[str]) -> set[str]:
    """Return what a browser draws in the formulas of HTML pages: an identifier of one letter is italic."""
    found: set[str] = set()
    for page in pages:
        for formula in re.findall("<math.*?</math>", page, re.DOTALL):
            for tag, text in re.findall(r"<(\w+)[^>]*>([^<]*)", formula):
                written = html.unescape(text)
                found |= {_ITALIC.get(written, written)} if tag == "mi" and len(written) == 1 else set(written)
    return {each for each in found if unicodedata.category(each) not in ("Cc", "Cf")}


def main(font: str, made: str) -> None:
    """Write the part of a font."""
    from fontTools import subset

    subset.main(
        [
            font,
            f"--unicodes={UNICODES}",
            "--layout-features=",
            "--flavor=woff",
            "--no-hinting",
            f"--output-file={made}",
        ]
    )


if __name__ == "__main__":
    main(*sys.argv[1:])
