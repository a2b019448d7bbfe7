"""A page for each public class, alias and enumeration of the C++ headers, out of their comments: doxygen and breathe.

The headers are those of the installed package. Without doxygen there is one page, which says so.
"""

import re
import shutil
import subprocess
from collections import Counter, defaultdict
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as Xml

import palpate
from docutils import nodes
from sphinx.errors import ExtensionError
from sphinx.util import logging

DOXYFILE = Path(__file__).with_name("Doxyfile")
FOLDER = "cpp"  # of the pages, beside the others; like api/ it is written by every build
GUIDES = ("cpp", "embedded")  # pages on which a name in code is a link
NAMESPACES = ("palpate", "palpate::embedded")
PARTS = {"Event", "FitColumn", "FitSums"}  # which doxygen's EXCLUDE_SYMBOLS cannot leave out: it is for classes only
WITHOUT = "This site was built without doxygen, which reads the comments of the headers: `apt install doxygen`."


@dataclass(frozen=True)
class Entity:
    """A class, an alias or an enumeration."""

    name: str  # below palpate
    directive: str
    header: str
    brief: str
    specialisations: tuple[str, ...] = ()

    @property
    def page(self) -> str:
        """The name of its page."""
        return self.name.replace("::", ".")

    def text(self) -> str:
        """Return its page."""
        lines = [
            self.name,
            "=" * len(self.name),
            "",
            *PLAIN,
            ".. code-block:: cpp",
            "",
            f"   #include <{self.header}>",
            "",
        ]
        for name in (self.name, *self.specialisations):
            lines += [f".. {self.directive}:: palpate::{name}", *MEMBERS.get(self.directive, ()), ""]
        return "\n".join(lines)


PLAIN = (".. highlight:: none", "")  # the formulas of the comments are in no language
MEMBERS = {name: ("   :members:", "   :undoc-members:") for name in ("doxygenclass", "doxygenstruct")}


def run_doxygen(folder: Path) -> Path | None:
    """Return the folder of doxygen's XML; None without doxygen. A warning of it is an error."""
    doxygen = shutil.which("doxygen")
    if doxygen is None:
        return None
    folder.mkdir(parents=True, exist_ok=True)
    headers = palpate.get_include()
    more = f'\nINPUT = "{headers}"\nSTRIP_FROM_PATH = "{headers}"\nOUTPUT_DIRECTORY = "{folder}"\n'
    done = subprocess.run(
        [doxygen, "-"], input=DOXYFILE.read_text() + more, capture_output=True, encoding="utf-8", check=False
    )
    if done.returncode:
        raise ExtensionError(f"doxygen, on the C++ headers:\n{done.stderr}")
    for path in (folder / "xml").glob("*.xml"):
        as_shown(path)
    return folder / "xml"


def as_shown(path: Path) -> None:
    """Mend one file of doxygen's: private bases and groups without a name.

    Nobody can use private bases, and doxygen takes the default of a parameter for the base of that name. Functions that
    share a comment are functions like the others.
    """
    tree = Xml.parse(path)
    private = [
        (compound, base)
        for compound in tree.iter("compounddef")
        for base in compound.findall("basecompoundref[@prot='private']")
    ]
    groups = [group for group in tree.iter("sectiondef") if group.get("kind") == "user-defined"]
    for compound, base in private:
        compound.remove(base)
    for group in groups:
        if group.find("header") is None:
            group.set("kind", "public-func")
    if private or groups:
        tree.write(path, encoding="utf-8", xml_declaration=True)


def entities(xml: Path) -> list[Entity]:
    """Return what has a page, in the order of doxygen: classes by name, then the rest by file."""
    found, special = [], defaultdict(list)
    for namespace in NAMESPACES:
        tree = Xml.parse(xml / f"namespace{namespace.replace('::', '_1_1')}.xml")
        for inner in tree.iter("innerclass"):
            name = _below(inner.text)
            if "<" in name:
                special[name.split("<")[0].strip()].append(name)
            else:
                found.append(_class(xml / f"{inner.get('refid')}.xml", name))
        found += [_member(member, namespace) for kind in ("typedef", "enum") for member in _members(tree, kind)]
    return [
        Entity(e.name, e.directive, e.header, e.brief, tuple(special[e.name])) for e in found if e.name not in PARTS
    ]


def free(xml: Path) -> dict[str, list[str]]:
    """Return the directives for the functions and constants of each header."""
    members = [
        member
        for kind in ("function", "variable")
        for member in _members(Xml.parse(xml / "namespacepalpate.xml"), kind)
        if "<" not in _text(member.find("name"))  # a specialisation says what its template says
    ]
    overloads = Counter(_text(member.find("name")) for member in members)
    found: dict[str, list[str]] = defaultdict(list)
    for member in members:
        name = _text(member.find("name"))
        arguments = _text(member.find("argsstring")).removesuffix("noexcept") if overloads[name] > 1 else ""
        found[_header(member)].append(f".. doxygen{member.get('kind')}:: palpate::{name}{arguments}")
    return dict(sorted(found.items()))


def _members(tree: Any, kind: str) -> list[Any]:
    return [member for member in tree.iter("memberdef") if member.get("kind") == kind]


def _below(name: str | None) -> str:
    return (name or "").removeprefix("palpate::")


def _text(element: Any) -> str:
    return "" if element is None else " ".join("".join(element.itertext()).split())


def _header(element: Any) -> str:
    return str(element.find("location").get("file"))


def _class(path: Path, name: str) -> Entity:
    compound = Xml.parse(path).find("compounddef")
    assert compound is not None
    brief = _text(compound.find("briefdescription"))
    return Entity(name, f"doxygen{compound.get('kind')}", _header(compound), brief)


def _member(member: Any, namespace: str) -> Entity:
    name = _below(f"{namespace}::{_text(member.find('name'))}")
    return Entity(name, f"doxygen{member.get('kind')}", _header(member), _text(member.find("briefdescription")))


def index_of(found: list[Entity], functions: dict[str, list[str]]) -> str:
    """Return the first page: the names by header."""
    lines = ["# C++ reference", "", "Every public name of the headers, out of their comments; [the guide](../cpp.md)."]
    by_header: dict[str, list[Entity]] = defaultdict(list)
    for entity in found:
        by_header[entity.header].append(entity)
    for header in sorted(by_header, key=lambda header: (header.count("/"), header)):
        rows = [f"| [`{e.name}`]({e.page}.rst) | {e.brief.replace('|', chr(92) + '|')} |" for e in by_header[header]]
        lines += ["", f"## {header}", "", "| name | is |", "|---|---|", *rows]
    lines += ["", "[Functions and constants](functions.rst) of " + ", ".join(f"`{h}`" for h in functions) + "."]
    pages = [*sorted(e.page for e in found), "functions"]
    return "\n".join([*lines, "", "```{toctree}", ":hidden:", "", *pages, "```", ""])


def functions_page(functions: dict[str, list[str]]) -> str:
    """Return the page of what is not in a class."""
    lines = ["Functions and constants", "=======================", "", *PLAIN]
    for header, directives in functions.items():
        lines += [header, "-" * len(header), "", *(line for directive in directives for line in (directive, ""))]
    return "\n".join(lines)


def write(folder: Path, pages: dict[str, str]) -> None:
    """Write the pages that have changed, and no others: Sphinx reads again what is new."""
    folder.mkdir(exist_ok=True)
    assert len({name.lower() for name in pages}) == len(pages), "two pages of one name where names know no case"
    for old in set(folder.iterdir()) - {folder / name for name in pages}:
        old.unlink()
    for name, text in pages.items():
        path = folder / name
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")


def prepare(app: Any, config: Any) -> None:
    """Run doxygen, and write a page for each name."""
    xml = run_doxygen(Path(app.doctreedir) / "doxygen")
    if xml is None:
        logging.getLogger(__name__).info(WITHOUT)
        app.cpp_pages = {}
        write(Path(app.srcdir) / FOLDER, {"index.md": f"# C++ reference\n\n{WITHOUT}\n"})
        return
    config.breathe_projects, config.breathe_default_project = {"palpate": str(xml)}, "palpate"
    found, functions = entities(xml), free(xml)
    app.cpp_pages = {entity.name: f"{FOLDER}/{entity.page}" for entity in found}
    pages = {f"{entity.page}.rst": entity.text() for entity in found}
    write(
        Path(app.srcdir) / FOLDER,
        {**pages, "index.md": index_of(found, functions), "functions.rst": functions_page(functions)},
    )


def link_names(app: Any, tree: Any, page: str) -> None:
    """Make the names in code on a guide links to their pages; after `embedded::` and without it are two names."""
    if page not in GUIDES:
        return
    for literal in list(tree.findall(nodes.literal)):
        name = re.sub("<.*", "", _below(literal.astext()))
        if name in app.cpp_pages and not isinstance(literal.parent, nodes.reference):
            target = app.builder.get_relative_uri(page, app.cpp_pages[name])
            link = nodes.reference("", "", internal=True, refuri=target)
            literal.replace_self(link)
            link += literal


def setup(app: Any) -> dict[str, bool]:
    """Connect it; breathe reads what doxygen wrote."""
    app.setup_extension("breathe")
    app.connect("config-inited", prepare)
    app.connect("doctree-resolved", link_names)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
