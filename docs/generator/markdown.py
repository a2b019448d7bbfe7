"""Plain Markdown: escapes, tables, blocks of code, and the anchors of headings on a forge."""

import re
from collections.abc import Iterable, Sequence

_CODE = re.compile(r"(``.+?``|`[^`]+`)", re.DOTALL)
_STAR = re.compile(r"\*(?=\S)|(?<=\S)\*")
_EDGE_UNDERSCORE = re.compile(r"(?<!\w)_(?=\w)|(?<=\w)_(?!\w)")
_TAG = re.compile(r"<(?=[A-Za-z/!?])")


def prose(text: str) -> str:
    """Return text in which no character means Markdown, except for what is marked as code."""
    parts = _CODE.split(text)
    for i in range(0, len(parts), 2):
        part = _STAR.sub(r"\\*", parts[i])
        part = _EDGE_UNDERSCORE.sub(r"\\_", part)
        part = _TAG.sub("&lt;", part)
        parts[i] = part.replace("$", r"\$")
    return "".join(parts)


def code(text: str) -> str:
    """Return text as code in a line."""
    if "`" in text:
        return f"`` {text} ``"
    return f"`{text}`"


def block(language: str, text: str) -> str:
    """Return a block of code."""
    return f"```{language}\n{text.strip(chr(10))}\n```"


def cell(text: str) -> str:
    """Return text for a cell of a table: one line, without the border's character."""
    return " ".join(text.split()).replace("|", r"\|")


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table; the cells are Markdown already."""
    lines = [f"| {' | '.join(head)} |", "|---" * len(head) + "|"]
    for row in rows:
        cells = [cell(text) for text in row]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


def slug(heading: str) -> str:
    """Return the anchor of a heading, as forges and the site make it."""
    shown = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading)
    shown = shown.strip().lower().replace("`", "")
    return re.sub(r"[^\w\- ]", "", shown).replace(" ", "-")


def headings(text: str) -> list[tuple[str, str]]:
    """Return the headings of a page with their anchors; one that is there before gets a number."""
    without_code = re.sub(r"^ *```.*?^ *```$", "", text, flags=re.DOTALL | re.MULTILINE)
    found = []
    counts: dict[str, int] = {}
    for heading in re.findall(r"^#+ +(.+)$", without_code, re.MULTILINE):
        name = slug(heading)
        count = counts.get(name, 0)
        counts[name] = count + 1
        if count:
            name = f"{name}-{count}"
        found.append((heading, name))
    return found


def page(parts: Iterable[str]) -> str:
    """Return a page of these parts, with an empty line between them."""
    return "\n\n".join(part.strip("\n") for part in parts if part) + "\n"
