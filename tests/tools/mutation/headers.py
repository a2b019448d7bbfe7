"""The mutants of the C++ headers: clang finds operators and constants; each becomes a call that can change it."""

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from clang import cindex

HERE = Path(__file__).parent
FLIPPED = {
    "+": "-",
    "-": "+",
    "*": "/",
    "/": "*",
    "<": ">=",
    ">": "<=",
    "<=": ">",
    ">=": "<",
    "==": "!=",
    "!=": "==",
}
FLIPPED |= {"+=": "-=", "-=": "+=", "&&": "||", "||": "&&", "?": "? swapped"}
NAMES = [
    "plus",
    "minus",
    "times",
    "over",
    "less",
    "greater",
    "less_equal",
    "greater_equal",
    "equal",
    "unequal",
]
ON = "::mutants::on(%d)"
# What stands before, between and after the operands. a || b is !(!a && !b): the right one is executed only where it counts.
WRITTEN: dict[str, tuple[str, ...]] = {
    operator: (f"::mutants::{name}(%d, ", ", ", ")")
    for operator, name in zip(FLIPPED, NAMES, strict=False)
}
WRITTEN |= {"+=": ("::mutants::add(%d, ", ", ", ")"), "-=": ("::mutants::subtract(%d, ", ", ", ")")}
WRITTEN |= {
    o: ("(((bool(", f") != {ON}) {o} (bool(", f") != {ON})) != {ON})") for o in ("&&", "||")
}
WRITTEN |= {"?": ("((", f") != {ON} ? ", " : ", ")"), "": ("::mutants::nudged(%d, ", ")")}
OPERATORS = {"BINARY_OPERATOR", "COMPOUND_ASSIGNMENT_OPERATOR", "CONDITIONAL_OPERATOR"}
LITERALS = {"INTEGER_LITERAL", "FLOATING_LITERAL"}
NATIVE = ("stages", "square_root", "design", "ring")


@dataclass
class Site:
    """An operator or a constant: its place and its operands."""

    text: str
    line: int
    start: int
    end: int
    operands: list[tuple[int, int]]

    def edits(self, number: int) -> Iterator[tuple[tuple[int, int, int], int, bytes]]:
        """Yield what replaces the text around the operands: (place, order of those at one place), end, new text."""
        written = [
            part.replace("%d", str(number)).encode()
            for part in WRITTEN[self.text if len(self.operands) > 1 else ""]
        ]
        # at one place the outer one is before the inner one
        yield ((self.start, 2, -self.end), self.start, written[0])
        for (_, left), (right, _), part in zip(
            self.operands, self.operands[1:], written[1:], strict=False
        ):
            yield (left, 1, 0), right, part
        yield (self.operands[-1][1], 0, -self.start), self.end, written[-1]


def rewrite(include: Path) -> list[tuple[Path, int, str]]:
    """Rewrite all headers of a folder; return file, line and change of each mutant."""
    headers = sorted(include.rglob("*.hpp"))
    found = {header: _sites(header, include) for header in headers}
    mutants: list[tuple[Path, int, str]] = []
    for header, sites in found.items():
        text = header.read_bytes()
        made = b""
        at = 0
        edits: list[tuple[tuple[int, int, int], int, bytes]] = []
        for site in sites:
            edits += site.edits(len(mutants))
            mutants.append(
                (header, site.line, f"{site.text} -> {FLIPPED.get(site.text, 'nudged')}")
            )
        for (start, *_), end, new in sorted(edits):
            made = made + text[at:start] + new
            at = end
        made += text[at:]
        mark = b"#pragma once\n"
        header.write_bytes(
            made.replace(mark, mark + b"#pragma GCC system_header\n#include <mutants.hpp>\n", 1)
        )
    (include / "mutants.hpp").write_bytes((HERE / "mutants.hpp").read_bytes())
    return mutants


def _sites(header: Path, include: Path) -> list[Site]:
    # The package libclang has no stddef.h of its own: the compiler's.
    own = subprocess.run(
        ["g++", "-print-file-name=include"], check=True, capture_output=True, text=True
    ).stdout.strip()
    unit = cindex.Index.create().parse(
        str(header), args=["-x", "c++", "-std=c++17", f"-I{include}", "-isystem", own]
    )
    text = header.read_bytes()
    top = (
        c
        for c in unit.cursor.get_children()
        if c.location.file and Path(c.location.file.name) == header
    )
    found = {(site.start, site.end): site for child in top for site in _walk(child, text)}
    return sorted(found.values(), key=lambda s: (s.start, -s.end))


def _walk(node: Any, text: bytes) -> Iterator[Site]:
    if node.kind.name == "STATIC_ASSERT":
        return
    start = node.extent.start.offset
    end = node.extent.end.offset
    if node.kind.name in LITERALS and text[start : start + 1].isdigit():
        yield Site(text[start:end].decode(), node.location.line, start, end, [(start, end)])
    parts = [(c.extent.start.offset, c.extent.end.offset) for c in node.get_children()]
    if node.kind.name in OPERATORS and len(parts) > 1 and parts[0][0] == start:
        between = text[parts[0][1] : parts[1][0]].decode()
        operator = between.strip(" \n()")
        # not the brackets of a template
        written = f" {operator}" in between or f"\n{operator}" in between
        if (
            written
            and operator in FLIPPED
            and (operator == "?") == (node.kind.name == "CONDITIONAL_OPERATOR")
        ):
            yield Site(operator, node.location.line, start, end, parts)
    for child in node.get_children():
        yield from _walk(child, text)


def build(copy: Path, compiled: int = -1) -> bool:
    """Compile the extension of a copy of the project; return whether it compiles."""
    target = copy / "build" / f"installed{compiled}"
    flags = f"-O1 -w -fpermissive -DPALPATE_MUTANT={compiled}"
    defined = {"FLAGS": flags, "FLAGS_RELEASE": ""}
    options = [f"-Ccmake.define.CMAKE_CXX_{name}={value}" for name, value in defined.items()]
    command = [
        sys.executable,
        "-m",
        "pip",
        "install",
        "-q",
        "--no-deps",
        "--target",
        str(target),
        *options,
        str(copy),
    ]
    if not target.exists():
        subprocess.run(command, check=False, env=os.environ | {"CMAKE_BUILD_PARALLEL_LEVEL": "1"})
    made = list(target.glob("palpate/_core*.so"))
    for extension in made:
        shutil.copy(extension, copy / "python" / "palpate")
    return bool(made)


def native_failure(copy: Path, number: int) -> str:
    """Return which program of tests/cpp does not compile or fails with a mutant; an empty text: none."""
    program = copy / "build" / "native"
    flags = f"-std=c++17 -O1 -w -fpermissive -pthread -DPALPATE_MUTANT={number} -I{copy / 'cpp' / 'include'}".split()
    for name in NATIVE:
        source = copy / "tests" / "cpp" / f"{name}.cpp"
        try:
            subprocess.run(
                ["c++", *flags, source, "-o", program],
                check=True,
                capture_output=True,
                timeout=1800,
            )
            subprocess.run([program], check=True, capture_output=True, timeout=600)
        except (subprocess.CalledProcessError, subprocess.TimeoutExpired):
            return f"tests/cpp/{name}.cpp"
    return ""
