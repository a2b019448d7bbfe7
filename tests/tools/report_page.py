"""A report as a test sees it: its sections, the rows of their tables, and what it refers to."""

from html.parser import HTMLParser
from pathlib import Path


class Page(HTMLParser):
    """The sections of a report, with their text and the rows of their tables."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.text: dict[str, str] = {"": ""}
        self.rows: dict[str, list[list[str]]] = {"": []}
        self.tags: set[str] = set()
        self.refers: list[str] = []
        self._in: list[str] = []
        self._section = ""
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Note an element."""
        self.tags.add(tag)
        self.refers += [value or "" for name, value in attrs if name in ("src", "href", "srcset", "data", "action")]
        self.refers += [name for name, _ in attrs if name.startswith("on") or name == "style"]
        hidden = ("class", "pad") in attrs
        if tag not in ("meta", "br"):
            self._in.append("pad" if hidden else tag)
        if tag == "h2":
            self._section = "new"
        elif tag == "tr":
            self.rows[self._section].append([])
        elif tag in ("td", "th"):
            self.rows[self._section][-1].append("")

    def handle_endtag(self, tag: str) -> None:
        """End it."""
        self._in.pop()

    def handle_data(self, data: str) -> None:
        """Take a text."""
        if "style" in self._in or "pad" in self._in:
            return
        if "h2" in self._in:
            self._section = data
            self.text[data], self.rows[data] = "", []
            return
        self.text[self._section] += data + " "
        if {"td", "th"} & set(self._in) and self.rows[self._section]:
            self.rows[self._section][-1][-1] += data

    def row(self, section: str, first: str) -> list[str]:
        """Return the only row of a section that begins with a text."""
        [found] = [row for row in self.rows[section] if row and row[0] == first]
        return found
