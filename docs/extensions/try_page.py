"""The page for a browser alone, beside the others: made where its compilers are, else the words say that it is not."""

import subprocess
import sys
from pathlib import Path
from typing import Any

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util import logging
from sphinx.util.docutils import SphinxDirective

NAME = "palpate-try.html"
MISSING = "This copy of the documentation was built without the page. The command below makes it."


class TryPage(SphinxDirective):
    """`{try-page}`: the link to the page, or that there is none."""

    def run(self) -> list[nodes.Node]:
        """Return a paragraph."""
        if not (Path(self.env.app.outdir) / NAME).is_file():
            return [nodes.paragraph(text=MISSING)]
        link = nodes.reference(text="Open palpate in the browser", refuri=NAME, internal=False)
        return [nodes.paragraph("", "", nodes.strong("", "", link), nodes.Text(", or save the file of this link."))]


def make(app: Sphinx) -> None:
    """Make the page in the folder of the others."""
    out = Path(app.outdir) / NAME
    out.unlink(missing_ok=True)
    command = [sys.executable, str(Path(__file__).parents[1] / "try" / "bundle.py"), str(out)]
    done = subprocess.run(command, capture_output=True, encoding="utf-8", check=False)
    if done.returncode:
        logging.getLogger(__name__).info("%s is left out. %s", NAME, (done.stderr.strip().splitlines() or [""])[-1])


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the directive."""
    app.add_directive("try-page", TryPage)
    app.connect("builder-inited", make)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
