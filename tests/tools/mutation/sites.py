"""Finds the operators in a C++ header with clang, and replaces each by a call that can flip it."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from clang import cindex

CALLS = {
    "+": "plus",
    "-": "minus",
    "*": "times",
    "/": "over",
    "<": "less",
    ">": "greater",
    "<=": "less_equal",
    ">=": "greater_equal",
    "==": "equal",
    "!=": "unequal",
}
FLIPPED = {"+": "-", "-": "+", "*": "/", "/": "*", "<": ">=", ">": "<=", "<=": ">", ">=": "<", "==": "!=", "!=": "=="}
FLIPPED |= {"&&": "||", "||": "&&", "+=": "-=", "-=": "+=", "?": "? swapped"}
KINDS = {"BINARY_OPERATOR", "COMPOUND_ASSIGNMENT_OPERATOR", "CONDITIONAL_OPERATOR"}
CONSTANT = {"STATIC_ASSERT", "TEMPLATE_TYPE_PARAMETER", "TEMPLATE_NON_TYPE_PARAMETER", "ENUM_CONSTANT_DECL"}


@dataclass
class Site:
    """An operator: its begin and end, its operands, and the sites inside it."""

    operator: str
    line: int
    start: int
    end: int
    operands: list[tuple[int, int]]
    number: int = -1
    inside: list["Site"] = field(default_factory=list)


def sites(header: Path, include: Path) -> list[Site]:
    """Return the outermost sites of a header; they contain the others."""
    unit = cindex.Index.create().parse(str(header), args=["-x", "c++", "-std=c++17", f"-I{include}"])
    text = header.read_bytes()
    found = {
        (s.start, s.end): s
        for child in unit.cursor.get_children()
        if child.location.file and Path(child.location.file.name) == header
        for s in _walk(child, text)
    }
    outermost: list[Site] = []
    open_: list[Site] = []
    for site in sorted(found.values(), key=lambda s: (s.start, -s.end)):
        while open_ and open_[-1].end <= site.start:
            open_.pop()
        (open_[-1].inside if open_ else outermost).append(site)
        open_.append(site)
    return outermost


def _walk(node: Any, text: bytes) -> Iterator[Site]:
    if node.kind.name in CONSTANT or _is_constant(node, text):
        return
    if node.kind.name in KINDS and (site := _site(node, text)):
        yield site
    for child in node.get_children():
        yield from _walk(child, text)


def _is_constant(node: Any, text: bytes) -> bool:
    written = text[node.extent.start.offset : node.extent.end.offset]
    in_if = node.kind.name == "IF_STMT" and written.startswith(b"if constexpr")
    return in_if or (node.kind.name in {"VAR_DECL", "FIELD_DECL"} and b"constexpr" in written.split(b"=")[0])


def _site(node: Any, text: bytes) -> Site | None:
    parts = [(c.extent.start.offset, c.extent.end.offset) for c in node.get_children()]
    between = text[parts[0][1] : parts[1][0]].decode().strip(" \n()") if len(parts) > 1 else ""
    operator = "?" if node.kind.name == "CONDITIONAL_OPERATOR" else between
    if operator not in FLIPPED or parts[0][0] != node.extent.start.offset:
        return None
    return Site(operator, node.location.line, node.extent.start.offset, node.extent.end.offset, parts)


def rewritten(text: bytes, top: list[Site]) -> bytes:
    """Return the header with all sites replaced by calls."""
    return _within(text, 0, len(text), top)


def _within(text: bytes, start: int, end: int, inner: list[Site]) -> bytes:
    made, at = b"", start
    for site in (s for s in inner if start <= s.start and s.end <= end):
        made += text[at : site.start] + _call(text, site)
        at = site.end
    return made + text[at:end]


def _call(text: bytes, site: Site) -> bytes:
    parts = [_within(text, a, b, site.inside) for a, b in site.operands]
    on = b"::mutants::on(%d)" % site.number
    if site.operator == "?":
        both = (on, parts[0], parts[2], parts[1], parts[0], parts[1], parts[2])
        return b"(%b ? (%b ? %b : %b) : (%b ? %b : %b))" % both
    if site.operator in CALLS:
        return b"::mutants::%b(%d, %b, %b)" % (CALLS[site.operator].encode(), site.number, parts[0], parts[1])
    written, flipped = site.operator.encode(), FLIPPED[site.operator].encode()
    both = (on, parts[0], flipped, parts[1], parts[0], written, parts[1])
    return b"(%b ? (%b %b %b) : (%b %b %b))" % both
