"""The page of the C++ headers: each public declaration with its comment."""

import re
from collections.abc import Iterator
from pathlib import Path

import palpate

from docs.generator.cpp_headers import Declaration, Reader, enumerators, without_template
from docs.generator.docstrings import paragraphs
from docs.generator.markdown import block, code, page, slug, table

_WIDEST = 100
_FIRST = ("rls", "handover", "adaptive_window", "vector_rls", "scenes", "tracker", "embedded")
PART_HEADERS = {
    *("noise_model", "two_sided_cusum", "robust_line", "normal_equations", "pending_change"),
    *("code_steps", "ratio_error", "slow_noise", "front", "decimator", "outliers", "standstill"),
}
"""Headers of what stages and estimators are made of: no scene of a user has a name of these."""
PARTS = {
    *("InstrumentalVariable", "Recovery", "Reading", "LastReadings", "TermTests", "TermSums"),
    *("Term", "Reviser", "Event", "LeastSquares", "JudgedSample", "BaselineState"),
    *("BaselineMemory", "RecentValues", "Observation"),
}
"""Such names in other headers."""
_INTRODUCTION = """\
Every public name of the headers, with its comment. [The C++ headers](../cpp.md) is the guide;
[Embedded](../embedded.md) has the scenes for microcontrollers. `#include <palpate/palpate.hpp>`
has all headers but `palpate/design.hpp`."""


def headers() -> list[Path]:
    """Return the public headers: those for a user first, then in the order of their names."""
    found = []
    for path in (folder() / "palpate").rglob("*.hpp"):
        if path.stem not in PART_HEADERS:
            found.append(path)
    return sorted(found, key=lambda path: (place_of(path), path))


def folder() -> Path:
    """Return the folder of the headers."""
    return Path(palpate.get_include())


def place_of(path: Path) -> int:
    """Return where a header is on the page."""
    if path.stem in _FIRST:
        return _FIRST.index(path.stem)
    return len(_FIRST)


def read_header(path: Path) -> list[Declaration]:
    """Return the public declarations of a header."""
    text = path.read_text(encoding="utf-8")
    return list(Reader(text).declarations())


def is_shown(declaration: Declaration) -> bool:
    """Return whether a declaration is public, and no specialisation, deduction guide or friend."""
    text = without_template(declaration.text)
    if declaration.name in PARTS or text.startswith(("extern", "friend")):
        return False
    is_specialised = re.search(r"constexpr bool \w+<", text)
    return " -> " not in text and not is_specialised


def cpp_page() -> str:
    """Return the page."""
    parts = ["# C++ reference", _INTRODUCTION]
    rows = []
    sections = []
    for path in headers():
        shown = list(described_declarations(read_header(path), "palpate", path.name))
        if shown:
            name = path.relative_to(folder()).as_posix()
            heading = code(f"#include <{name}>")
            names = [line.removeprefix("### ") for line in shown if line.startswith("### ")]
            rows.append((f"[{code(name)}](#{slug(heading)})", ", ".join(names)))
            sections += [f"## {heading}", *shown]
    return page([*parts, table(("header", "names"), rows), *sections])


def described_declarations(
    declarations: list[Declaration], scope: str, place: str
) -> Iterator[str]:
    """Yield the parts of the page for declarations of one namespace; overloads share a heading."""
    name = ""
    comment = ""
    for each in filter(is_shown, declarations):
        if each.text.startswith("namespace "):
            inner = f"{scope}::{each.name}"
            yield f"### {code(inner)}"
            yield paragraphs(each.comment)
            yield from described_declarations(each.members, inner, place)
            continue
        if not each.comment.strip():
            raise ValueError(f"{place}: {each.name} has no comment")
        if each.name != name:
            yield f"### {code(f'{scope}::{each.name}')}"
        name = each.name
        if each.comment != comment:
            yield paragraphs(each.comment)
        comment = each.comment
        yield block("cpp", written(each, place))


def written(each: Declaration, place: str) -> str:
    """Return a declaration as code, with its members and their comments."""
    head = split_template(each.text)
    if each.body:
        lines = [f"  {name},{trailing(comment)}" for name, comment in enumerators(each.body)]
        return "\n".join([f"{head} {{", *lines, "};"])
    if not each.members:
        return f"{head};"
    lines = []
    last = ""
    for member in each.members:
        if not member.comment.strip():
            if not is_plain(member):
                raise ValueError(f"{place}: {each.name}: {member.name} has no comment")
            continue
        comment = " ".join(member.comment.split())
        line = f"  {split_template(member.text)};".replace("\n", "\n  ")
        if comment == last:
            lines.append(line)
        elif len(line) + len(comment) < _WIDEST and "\n" not in line:
            lines.append(f"{line}{trailing(comment)}")
        else:
            lines += [*wrapped(comment), line]
        last = comment
    return "\n".join([f"{head} {{", *lines, "};"])


def is_plain(member: Declaration) -> bool:
    """Return whether a member needs no comment: a default, what is deleted, or a using."""
    return bool(re.search(r"= (default|delete)$|^using [\w:, ]+$|^friend", member.text))


def split_template(text: str) -> str:
    """Return a declaration with `template <...>` on a line of its own."""
    rest = without_template(text)
    before = text[: len(text) - len(rest)].strip()
    if not before:
        return text
    return f"{before}\n{rest}"


def trailing(comment: str) -> str:
    """Return a comment behind code."""
    if not comment:
        return ""
    return f"  // {comment}"


def wrapped(comment: str) -> list[str]:
    """Return a comment above code, in lines."""
    lines = []
    line = "  //"
    for word in comment.split():
        if len(line) + len(word) >= _WIDEST:
            lines.append(line)
            line = "  //"
        line += f" {word}"
    return [*lines, line]
