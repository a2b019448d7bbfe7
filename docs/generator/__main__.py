"""Writes docs/reference: `python -m docs.generator [FOLDER]`. The same sources give the same pages.

It needs the installed package and nothing else. A test compares the committed pages with new ones.
"""

import re
import sys
from pathlib import Path

from docs.generator.api_names import PAGES
from docs.generator.command_pages import commands_page
from docs.generator.cpp_pages import cpp_page
from docs.generator.markdown import code, headings
from docs.generator.option_pages import flags_page, settings_page, sources_page
from docs.generator.python_pages import api_page

FOLDER = Path(__file__).parents[1] / "reference"


def pages() -> dict[str, str]:
    """Return the pages by the names of their files."""
    written = {
        "commands.md": commands_page(),
        "sources.md": sources_page(),
        "settings.md": settings_page(),
        "flags.md": flags_page(),
        "cpp.md": cpp_page(),
    }
    for each in PAGES:
        written[each.file] = api_page(each)
    places = {}
    for each in PAGES:
        anchors = dict(headings(written[each.file]))
        for name in each.names():
            places[name] = f"{each.file}#{anchors[code(name)]}"
    return {name: with_links(text, name, places) for name, text in written.items()}


def with_links(text: str, file: str, places: dict[str, str]) -> str:
    """Return a page on which public names in sentences are links to their places."""
    parts = re.split(
        r"(^```.*?^```$|^#[^\n]*$|\[[^\]]*\]\([^)]*\))", text, flags=re.DOTALL | re.MULTILINE
    )
    for i in range(0, len(parts), 2):
        for name in re.findall(r"`(palpate\.[\w.]+)`", parts[i]):
            if name in places:
                place = places[name].removeprefix(file)
                parts[i] = re.sub(rf"(?<!\[)`{re.escape(name)}`", f"[`{name}`]({place})", parts[i])
    return "".join(parts)


def write_pages(folder: Path) -> None:
    """Write the pages into a folder, and remove others that are there."""
    folder.mkdir(parents=True, exist_ok=True)
    written = pages()
    for path in folder.glob("*.md"):
        if path.name not in written:
            path.unlink()
    for name, text in written.items():
        (folder / name).write_text(text, encoding="utf-8", newline="\n")


if __name__ == "__main__":
    if len(sys.argv) > 2 or sys.argv[1:2] in (["-h"], ["--help"]):
        sys.exit(__doc__)
    write_pages(Path(sys.argv[1]) if len(sys.argv) == 2 else FOLDER)
