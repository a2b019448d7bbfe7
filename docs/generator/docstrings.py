"""Docstrings in the form of numpydoc, read and written as Markdown."""

import inspect
import re
from dataclasses import dataclass, field

from docs.generator.markdown import block, prose

_SECTION = re.compile(r"^(\w[\w ]*)\n-{3,}\n", re.MULTILINE)
_LISTS = ("Parameters", "Attributes", "Returns", "Yields", "Raises")


@dataclass(frozen=True)
class Entry:
    """One entry of a list: a parameter, an attribute, a returned value or an error."""

    name: str
    kind: str
    text: str


@dataclass(frozen=True)
class Docstring:
    """The parts of a docstring."""

    description: str
    sections: dict[str, str] = field(default_factory=dict)

    @property
    def summary(self) -> str:
        """The first paragraph."""
        return self.description.split("\n\n")[0]

    def entries(self, section: str) -> list[Entry]:
        """Return the entries of a section."""
        return parse_entries(self.sections.get(section, ""))


def parse(text: str) -> Docstring:
    """Return the parts of a docstring; a signature in its first line is left out."""
    text = inspect.cleandoc(text)
    text = re.sub(r"\A\w+\(.*\)\n--\n+", "", text)
    parts = _SECTION.split(text)
    sections = dict(zip(parts[1::2], parts[2::2], strict=True))
    return Docstring(parts[0].strip(), sections)


def parse_entries(text: str) -> list[Entry]:
    """Return the entries of a list: a line with the name and the kind, then indented text."""
    entries: list[Entry] = []
    head = ""
    body: list[str] = []
    for line in [*text.rstrip().splitlines(), "end"]:
        if line.startswith(" ") or not line:
            body.append(line)
            continue
        if head:
            name, _, kind = head.partition(" : ")
            entries.append(Entry(name, kind, inspect.cleandoc("\n".join(body))))
        head = line
        body = []
    return entries


def paragraphs(text: str) -> str:
    """Return text as Markdown; what is indented is a block of code."""
    written = []
    for part in re.split(r"\n\s*\n", text.strip("\n")):
        if part.startswith("    "):
            written.append(block("text", inspect.cleandoc(part)))
        else:
            written.append(prose(" ".join(part.split())))
    return "\n\n".join(written)


def entry_list(entries: list[Entry]) -> str:
    """Return entries as a list."""
    lines = []
    for entry in entries:
        line = f"- {entry_names(entry)}"
        if entry.kind:
            line += f" ({prose(entry.kind)})"
        if entry.text:
            line += f": {prose(' '.join(entry.text.split()))}"
        lines.append(line)
    return "\n".join(lines)


def entry_names(entry: Entry) -> str:
    """Return the names of an entry as code; a type of several words is text."""
    names = entry.name.split(", ")
    if any(" " in name or "(" in name for name in names):
        return prose(entry.name)
    return ", ".join(f"`{name}`" for name in names)


def as_markdown(docstring: Docstring) -> list[str]:
    """Return a docstring as parts of a page."""
    parts = [paragraphs(docstring.description)]
    for title, text in docstring.sections.items():
        if title == "Examples":
            parts.append(example(text))
        elif title in _LISTS:
            parts += [f"**{title}**", entry_list(parse_entries(text))]
        else:
            parts += [f"**{title}**", paragraphs(text)]
    return parts


def example(text: str) -> str:
    """Return the examples: sessions as blocks, what is between them as text."""
    parts = []
    for part in re.split(r"\n\s*\n", text.strip("\n")):
        if part.startswith(">>>"):
            parts.append(block("pycon", part))
        else:
            parts.append(prose(" ".join(part.split())))
    return "\n\n".join(parts)
