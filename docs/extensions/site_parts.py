"""Parts of the site that are not Markdown: navigation, formulas, the page for a browser alone."""

import re
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

from docutils import nodes
from latex2mathml.converter import convert
from sphinx.application import Sphinx
from sphinx.util import logging

TRY_PAGE = "palpate-try.html"
TRY_LINK = re.compile(r"\[([^\]]*)\]\(#make-the-page\)")
"""In a copy of the pages without the built page this link leads to the command that makes it."""
GROUP = re.compile(r"^## (.+)\n\n((?:- \[.+\]\(\S+\.md\).*\n)+)", re.MULTILINE)
"""A heading of index.md with a list of links: a group of the navigation."""
ENTRY = re.compile(r"^- \[(.+?)\]\((\S+)\.md\)", re.MULTILINE)


LINK = re.compile(r"(?<!!)\[([^\]]*)\]\((?![a-z]+:|#)([^()\s]+)\)")
"""A link to another file."""
ROOT = Path(__file__).parents[2]


def mathml(formula: str, display: str = "inline") -> str:
    """Return a formula as MathML. A name such as max is no operator: it has no spaces around it."""
    return re.sub(r"<mo>([a-z]+)</mo>", r"<mi>\1</mi>", convert(formula, display=display))


def inline_formula(translator: Any, node: nodes.math) -> None:
    """Write a formula in a line."""
    translator.body.append(mathml(node.astext()))
    raise nodes.SkipNode


def block_formula(translator: Any, node: nodes.math_block) -> None:
    """Write a formula of its own, with its number if it has one."""
    number = f'<span class="eqno">({node["number"]})</span>' if node.get("number") else ""
    translator.body.append(translator.starttag(node, "div", CLASS="math"))
    translator.body.append(f"{mathml(node.astext(), 'block')}{number}</div>\n")
    raise nodes.SkipNode


def navigation(text: str) -> str:
    """Return the navigation of a page of links, in the words of Sphinx."""
    parts = []
    for caption, links in GROUP.findall(text):
        lines = [f"{title} <{page}>" for title, page in ENTRY.findall(links)]
        head = f"```{{toctree}}\n:hidden:\n:caption: {caption}\n\n"
        parts.append(head + "\n".join(lines) + "\n```\n")
    return "\n".join(parts)


def repository_address() -> str:
    """Return the address of the repository in pyproject.toml; "" without one."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    address: str = project.get("urls", {}).get("Source", "")
    return address.rstrip("/")


def complete_page(app: Sphinx, docname: str, source: list[str]) -> None:
    """Add what only the site has: the navigation, and the link to the page for a browser alone.

    A link to a file that is no page leads to the repository; without an address to a copy of the
    file, and one to a folder is text.
    """
    folder = (Path(app.srcdir) / docname).parent
    address = repository_address()

    def outside(link: re.Match[str]) -> str:
        path = (folder / link[2].partition("#")[0]).resolve()
        if not path.exists() or is_page(app, path):
            return link[0]
        if address:
            kind = "tree" if path.is_dir() else "blob"
            place = path.relative_to(ROOT).as_posix()
            return f"[{link[1]}]({address}/{kind}/v{app.config.release}/{place})"
        if path.is_dir():
            return link[1]
        return f"[{link[1]}](path:{link[2].partition('#')[0]})"

    source[0] = LINK.sub(outside, source[0])
    if docname == "index":
        source[0] += "\n" + navigation(source[0])
    if docname == "try" and (Path(app.outdir) / TRY_PAGE).is_file():
        source[0] = TRY_LINK.sub(rf'<a href="{TRY_PAGE}">\1</a>', source[0], count=1)


def is_page(app: Sphinx, path: Path) -> bool:
    """Return whether a file is a page of the site."""
    if path.suffix != ".md" or not path.is_relative_to(app.srcdir):
        return False
    return app.env.path2doc(path) in app.project.docnames


def make_try_page(app: Sphinx) -> None:
    """Make the page in the folder of the site."""
    out = Path(app.outdir) / TRY_PAGE
    out.unlink(missing_ok=True)
    command = [sys.executable, str(Path(__file__).parents[1] / "try" / "bundle.py"), str(out)]
    done = subprocess.run(command, capture_output=True, encoding="utf-8", check=False)
    if done.returncode:
        reason = (done.stderr.strip().splitlines() or [""])[-1]
        logging.getLogger(__name__).info("%s is left out. %s", TRY_PAGE, reason)


def add_level(_app: Sphinx, _page: str, _template: str, context: dict[str, Any], _: Any) -> None:
    """Give the captions of the navigation a level: Sphinx says only that they are headings."""
    tree = context["furo_navigation_tree"]
    context["furo_navigation_tree"] = tree.replace(
        'role="heading"', 'role="heading" aria-level="2"'
    )


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the renderer of formulas, and what is made before and in the pages."""
    app.add_html_math_renderer("mathml", (inline_formula, None), (block_formula, None))
    app.connect("builder-inited", make_try_page)
    app.connect("source-read", complete_page)
    app.connect("html-page-context", add_level, priority=900)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
