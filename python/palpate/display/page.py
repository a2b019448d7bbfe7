"""A document as one HTML file: no script, nothing to fetch, a style for screen, phone and paper. And its tables."""

from collections.abc import Iterable, Mapping, Sequence
from html import escape
from pathlib import Path
from string import Template

from palpate.display.markup import MINUS, Markup, element

_PAGE = Template("""<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; style-src 'unsafe-inline'">
<title>$title</title>
<style>
$style@page {
  size: A4; margin: 16mm 16mm 18mm;
  @bottom-left { content: "$footer"; font: 8pt system-ui, sans-serif; color: #555c63 }
  @bottom-right { content: counter(page) " of " counter(pages); font: 8pt system-ui, sans-serif; color: #555c63 }
}
</style>
</head>
<body>
$body
</body>
</html>
""")


def document(title: str, *body: Markup, footer: str) -> str:
    """Return the whole file. The content policy in it forbids scripts and requests, whatever a name in it may be.

    Parameters
    ----------
    title : str
    *body : Markup
    footer : str
        Below each printed page, at the left.
    """
    style = Path(__file__).with_name("page.css").read_text(encoding="utf-8")
    text = "\n".join(body)
    return _PAGE.substitute(title=escape(title), style=style, footer=_quoted(footer), body=text)


def _quoted(text: str) -> str:
    """Return a text as it stands between quotes in a style: anything but letters, digits and blanks by its number."""
    return "".join(c if c.isascii() and (c.isalnum() or c == " ") else f"\\{ord(c):x} " for c in text)


def section(title: str, *children: object) -> Markup:
    """Return a heading and what is below it."""
    shown = (child if isinstance(child, Markup) else escape(str(child)) for child in children if child)
    return Markup("\n".join([element("h2", title), *shown]))


def facts(named: Mapping[str, object]) -> Markup:
    """Return names and values, one a line; values of nothing ("" or None) are left out."""
    kept = {name: value for name, value in named.items() if value not in ("", None)}
    return element(
        "dl", *(part for name, value in kept.items() for part in (element("dt", name), element("dd", value)))
    )


def table(
    columns: Mapping[str, str], rows: Sequence[Sequence[object]], marks: Sequence[str] = (), *, kind: str = ""
) -> Markup:
    """Return a table that scrolls by itself where it is too wide.

    Parameters
    ----------
    columns : mapping
        Header -> class of the column: "" or "strong" for numbers, which stand with their decimal points in line; "n" for
        words, "name" for those from outside, "w" for sentences. Without a header if all are blank.
    rows : sequence of sequences
        Cells; a row with fewer than columns ends in one that spans the rest.
    marks : sequence of str
        Class of each row.
    kind : str
        Class of the table: "stack" for one whose cells stand below each other on a phone.
    """
    head = [element("th", name, class_=style or None, scope="col") for name, style in columns.items()]
    styles, width = list(columns.values()), len(columns)
    pads = [_fraction([row[at] for row in rows if at < len(row)]) for at in range(width)]
    body = []
    for row, mark in zip(rows, marks or [""] * len(rows), strict=True):
        cells = [
            element("td", _pointed(cell, pads[at]) if styles[at] in _NUMBERS else cell, class_=styles[at] or None)
            for at, cell in enumerate(row[:-1] if len(row) < width else row)
        ]
        rest = [element("td", row[-1], class_="w", colspan=width - len(row) + 1)] if len(row) < width else []
        body.append(element("tr", *cells, *rest, class_=mark or None))
    parts = [element("thead", element("tr", *head))] if any(map(str.strip, columns)) else []
    return element("div", element("table", *parts, element("tbody", *body), class_=kind or None), class_="wide")


_NUMBERS = ("", "strong")


def _fraction(cells: Iterable[object]) -> int:
    """Return the characters from the decimal point on of the longest number."""
    return max((len(_after(cell)) for cell in cells), default=0)


def _after(cell: object) -> str:
    whole, point, rest = str(cell).partition(".")
    return (
        point + rest if rest.isdigit() and not isinstance(cell, Markup) and whole.lstrip(f"+-{MINUS}").isdigit() else ""
    )


def _pointed(cell: object, longest: int) -> Markup:
    """Return a number with as much that is not seen behind it that its point is in line with those of the column."""
    text = str(cell) if isinstance(cell, Markup) else escape(str(cell))
    missing = 0 if any(map(str.isalpha, text)) else longest - len(_after(cell))
    unseen = ".0000000000000000"[-missing:] if 0 < missing < longest else ".0000000000000000"[:missing]
    signed = f"{MINUS}{text[1:]}" if text[:1] == "-" and text[1:] else text
    return Markup(signed + (element("span", unseen, class_="pad", aria_hidden="true") if missing else ""))
