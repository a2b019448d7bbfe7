"""How to cite the software, out of CITATION.cff: nothing is written twice."""

from pathlib import Path
from typing import Any

import yaml
from docutils import nodes
from sphinx.util.docutils import SphinxDirective


def name(author: dict[str, str]) -> str:
    """Return an author as BibTeX sorts it; the name of a group is in braces, so that it is not split."""
    if "name" in author:
        return f"{{{author['name']}}}"
    return f"{author['family-names']}, {author['given-names']}"


def bibtex(cited: dict[str, Any]) -> str:
    """Return an entry for the software."""
    fields = {
        "author": " and ".join(map(name, cited["authors"])),
        "title": cited["title"],
        "version": str(cited["version"]),
        "license": cited["license"],
        "year": str(cited.get("date-released", ""))[:4],
        "doi": cited.get("doi"),
        "url": cited.get("url") or cited.get("repository-code"),
    }
    lines = [f"  {key} = {{{value}}}," for key, value in fields.items() if value]
    return "\n".join([f"@software{{{cited['title']},", *lines, "}"])


class Citation(SphinxDirective):
    """`{citation} FILE`: a file of the Citation File Format as BibTeX."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """Return the entry."""
        _, path = self.env.relfn2path(self.arguments[0])
        self.env.note_dependency(path)
        text = bibtex(yaml.safe_load(Path(path).read_text(encoding="utf-8")))
        return [nodes.literal_block(text, text, language="bibtex")]


def setup(app: Any) -> dict[str, bool]:
    """Add the directive."""
    app.add_directive("citation", Citation)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
