"""HTML and SVG elements: all text in them is escaped, nothing is fetched, no script runs."""

from html import escape
from typing import Any

MINUS, NONE, LEFT_OUT = "\N{MINUS SIGN}", "\N{EN DASH}", "\N{MULTIPLICATION SIGN}"
"""Before a number; in the place of one that is not known; beside what does not count."""


class Markup(str):
    """Text that is HTML already; templates do not escape it."""

    __slots__ = ()

    def __html__(self) -> str:
        """Return itself, for a template."""
        return self


def element(tag: str, *children: object, **attributes: object) -> Markup:
    """Return an element; children and attributes are escaped, but for children that are elements.

    An attribute None is left out; an underscore in its name is a hyphen, one at its end (as in `class_`) is left out.

    Examples
    --------
    >>> element("p", "a < b ", element("b", "&"), aria_label='"')
    '<p aria-label="&quot;">a &lt; b <b>&amp;</b></p>'
    """
    given = "".join(
        f' {name.rstrip("_").replace("_", "-")}="{escape(str(value))}"'
        for name, value in attributes.items()
        if value is not None
    )
    inner = "".join(child if isinstance(child, Markup) else escape(str(child)) for child in children)
    return Markup(f"<{tag}{given}>{inner}</{tag}>")


def card(title: str, facts: dict[str, object], *below: object, said: Any = ()) -> Markup:
    """Return a heading, a table of names and values, sentences, and what else stands below.

    Values of nothing ("" or None) are left out.
    """
    rows = [
        element("tr", _cell("th", name, "font-weight:normal;opacity:0.7"), _cell("td", value))
        for name, value in facts.items()
        if value not in ("", None)
    ]
    table = [element("table", element("tbody", *rows), style=_TABLE)] if rows else []
    return element("div", element("strong", title), *table, *sentences(said), *below, style="line-height:1.4")


def captioned(picture: Markup, caption: str) -> Markup:
    """Return a picture with a line below it."""
    return element("div", picture, element("small", caption, style="opacity:0.7"))


def sentences(said: Any) -> list[Markup]:
    """Return sentences that a reader should not miss, as a list with a coloured edge."""
    style = f"border-left:3px solid {WARNING};margin:0.4em 0;padding:0 0.6em;max-width:60em;white-space:pre-wrap"
    return [element("div", sentence, style=style) for sentence in said]


def columns(names: list[str], rows: list[list[object]]) -> Markup:
    """Return a table with a header; its cells are aligned to the left."""
    head = element("tr", *(_cell("th", name) for name in names))
    body = [element("tr", *(_cell("td", cell) for cell in row)) for row in rows]
    return element("table", element("thead", head), element("tbody", *body), style=_TABLE)


def _cell(tag: str, content: object, more: str = "") -> Markup:
    wrap = "nowrap" if tag == "th" else "normal"
    return element(tag, content, style=f"text-align:left;white-space:{wrap};padding:0.1em 0.8em 0.1em 0;{more}")


ACCENT, WARNING = "#2a84c4", "#c96a12"
"""Colours that can be read on white and on black; other lines have the colour of the text."""
_TABLE = "border-collapse:collapse;margin:0.3em 0;font-variant-numeric:tabular-nums"
