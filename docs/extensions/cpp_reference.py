"""A page for each C++ header, out of its comments: doxygen and breathe.

The headers are those of the installed package. Without doxygen there is one page, which says so.
"""

import re
import shutil
import subprocess
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as Xml

import palpate
from docutils import nodes
from sphinx.errors import ExtensionError
from sphinx.util import logging

DOXYFILE = Path(__file__).with_name("Doxyfile")
FOLDER = "cpp"  # of the pages; like api/ it is written by every build
GUIDES = ("cpp", "embedded")  # pages on which a name in code is a link
# which doxygen's EXCLUDE_SYMBOLS cannot leave out: it is for classes only
PARTS = {"Event", "Term", "TermSums"}
WITHOUT = "This site was built without doxygen, which reads the comments of the headers: `apt install doxygen`."


def run_doxygen(folder: Path) -> Path | None:
    """Return the folder of doxygen's XML; None without doxygen. A warning of it is an error."""
    doxygen = shutil.which("doxygen")
    if doxygen is None:
        return None
    folder.mkdir(parents=True, exist_ok=True)
    headers = palpate.get_include()
    more = f'\nINPUT = "{headers}"\nSTRIP_FROM_PATH = "{headers}"\nOUTPUT_DIRECTORY = "{folder}"\n'
    done = subprocess.run(
        [doxygen, "-"],
        input=DOXYFILE.read_text() + more,
        capture_output=True,
        encoding="utf-8",
        check=False,
    )
    if done.returncode:
        raise ExtensionError(f"doxygen, on the C++ headers:\n{done.stderr}")
    for path in (folder / "xml").glob("*.xml"):
        correct(path)
    return folder / "xml"


def correct(path: Path) -> None:
    """Correct one file of doxygen's: without macros and what is private or internal; who shares a comment is in no group.

    Doxygen takes the default of a parameter for a private base of that name, and names a header without its folder.
    """
    tree = Xml.parse(path)
    for compound in tree.iter("compounddef"):
        unwanted = compound.findall("basecompoundref[@prot='private']")
        unwanted += [
            part for part in compound.findall("derivedcompoundref") if "detail::" in str(part.text)
        ]
        unwanted += compound.findall("includes") if compound.get("kind") != "file" else []
        for group in compound.findall("sectiondef"):
            if group.get("kind", "").startswith(("private", "define")):
                unwanted.append(group)
            elif group.get("kind") == "user-defined" and group.find("header") is None:
                group.set("kind", "public-func")
            for member in group.findall("memberdef"):
                if member.findtext("name") in PARTS:
                    group.remove(member)
        for element in unwanted:
            compound.remove(element)
    tree.write(path, encoding="utf-8", xml_declaration=True)


def page(header: str) -> str:
    """Return the page of a header; the formulas of its comments are in no language."""
    title = f"{header}\n{'=' * len(header)}\n\n.. highlight:: none"
    return f"{title}\n\n.. code-block:: cpp\n\n   #include <{header}>\n\n.. doxygenfile:: {Path(header).name}\n"


def write(folder: Path, pages: dict[str, str]) -> None:
    """Write the pages into an empty folder."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    for name, text in pages.items():
        (folder / name).write_text(text, encoding="utf-8")


def prepare(app: Any, config: Any) -> None:
    """Run doxygen, and write a page for each header, and their list."""
    lines, pages, xml = ["# C++ reference", ""], {}, run_doxygen(Path(app.doctreedir) / "doxygen")
    if xml is None:
        logging.getLogger(__name__).info(WITHOUT)
        lines.append(WITHOUT)
    else:
        config.breathe_projects, config.breathe_default_project = {"palpate": str(xml)}, "palpate"
        files = [path.find("compounddef") for path in map(Xml.parse, xml.glob("*_8hpp.xml"))]
        headers = sorted(str(file.find("location").get("file")) for file in files)
        pages = {
            f"{header.removeprefix('palpate/').removesuffix('.hpp').replace('/', '.')}.rst": page(
                header
            )
            for header in headers
        }
        lines += [
            "Every public name of the headers, out of their comments; [the guide](../cpp.md).",
            "",
        ]
        lines += ["```{toctree}", *(name.removesuffix(".rst") for name in pages), "```"]
    write(Path(app.srcdir) / FOLDER, {**pages, "index.md": "\n".join([*lines, ""])})


def link_names(app: Any, tree: Any, docname: str) -> None:
    """Make the names in code on a guide links to their places; after `embedded::` and without it are two names."""
    if docname not in GUIDES:
        return
    places = {
        name: (place, anchor)
        for name, _, _, place, anchor, _ in app.env.get_domain("cpp").get_objects()
    }
    for literal in list(tree.findall(nodes.literal)):
        name = "palpate::" + re.sub("<.*", "", literal.astext()).removeprefix("palpate::")
        if name in places and not isinstance(literal.parent, nodes.reference):
            place, anchor = places[name]
            link = nodes.reference(
                "",
                "",
                internal=True,
                refuri=f"{app.builder.get_relative_uri(docname, place)}#{anchor}",
            )
            literal.replace_self(link)
            link += literal


def setup(app: Any) -> dict[str, bool]:
    """Connect it; breathe reads what doxygen wrote."""
    app.setup_extension("breathe")
    app.connect("config-inited", prepare)
    app.connect("doctree-resolved", link_names)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
