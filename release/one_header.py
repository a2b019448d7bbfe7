"""Print all public headers as one: `python -m release.one_header > palpate_one.hpp`.

Each header stands in it once, after those that it includes; the headers of the standard library stand at its top. The
text between is that of the headers.
"""

import re
import sys

from release.project import ROOT, version

HEADERS = ROOT / "cpp" / "include"
ALL = "palpate/palpate.hpp"
# Both in one file would define everything twice.
TWICE = """
#if defined(PALPATE_VERSION)
#error "palpate: include either palpate_one.hpp or the headers of the folder palpate, not both"
#endif
"""
_OWN = re.compile(r"^#include <(palpate/[\w/]+\.hpp)>\n", re.MULTILINE)
_STANDARD = re.compile(r"^#include <(\w+)>\n", re.MULTILINE)
_FIRST_LINES = re.compile(r"\A// SPDX-License-Identifier: MIT\n#pragma once\n+")


def in_order(header: str = ALL) -> list[str]:
    """Return the headers that this one includes, directly or not, and itself: each after those that it includes."""
    found: list[str] = []

    def visit(name: str) -> None:
        if name not in found:
            for inner in _OWN.findall((HEADERS / name).read_text(encoding="utf-8")):
                visit(inner)
            found.append(name)

    visit(header)
    return found


def one_header() -> str:
    """Return the text of the one header."""
    standard, bodies = set(), []
    for name in in_order():
        text, first = _FIRST_LINES.subn("", (HEADERS / name).read_text(encoding="utf-8"))
        if not first:
            raise SystemExit(f"{name} does not begin with its licence and #pragma once")
        standard |= set(_STANDARD.findall(text))
        body = _STANDARD.sub("", _OWN.sub("", text))
        if re.search(r"^[ \t]*#[ \t]*(include|pragma once)", body, re.MULTILINE):
            raise SystemExit(f"{name}: an #include or #pragma once in a form that is not known here")
        bodies.append(f"// {name}\n\n{re.sub(chr(10) + '{3,}', chr(10) * 2, body).strip()}\n")
    licence = "".join(f"// {line}".rstrip() + "\n" for line in (ROOT / "LICENSE").read_text("utf-8").splitlines())
    begin = f"// SPDX-License-Identifier: MIT\n// palpate {version()}: all headers in one file. Do not edit: it is made by a command.\n//\n"
    includes = "".join(f"#include <{name}>\n" for name in sorted(standard))
    return f"{begin}{licence}\n#pragma once\n{TWICE}\n{includes}\n" + "\n".join(bodies)


if __name__ == "__main__":
    sys.stdout.write(one_header())
