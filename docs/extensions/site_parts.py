"""What the site has beside Markdown: help of the commands, formulas as MathML, the page for a browser alone."""

import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import click
from docutils import nodes
from latex2mathml.converter import convert
from palpate.cli.config import configurable_parameters
from palpate.cli.main import COMMANDS, palpate_command
from sphinx.application import Sphinx
from sphinx.util import logging
from sphinx.util.docutils import SphinxDirective

TRY_PAGE = "palpate-try.html"
NO_TRY_PAGE = (
    "This copy of the documentation was built without the page. The command below makes it."
)


class CommandHelp(SphinxDirective):
    """`{command-help}`: every command's help, and its variables."""

    def run(self) -> list[nodes.Node]:
        """Return the sections."""
        context = click.Context(
            palpate_command, info_name="palpate", terminal_width=84, max_content_width=84
        )
        return [self._section(context, palpate_command, name) for name in COMMANDS]

    def _section(self, parent: click.Context, group: click.Group, name: str) -> nodes.section:
        command = group.get_command(parent, name)
        assert command is not None
        context = click.Context(
            command, info_name=name, parent=parent, terminal_width=84, max_content_width=84
        )
        path = context.command_path.removeprefix("palpate ")
        anchor = f"command-{path.replace(' ', '-')}"
        section = nodes.section(ids=[anchor], names=[anchor])
        section += nodes.title(text=path)
        text = command.get_help(context)
        section += nodes.literal_block(text, text, language="text")
        options = [key for key in configurable_parameters(command) if key not in ("json", "debug")]
        if options:
            defaults = nodes.paragraph(text="Keys of its table in palpate.toml: ")
            defaults += nodes.literal(text=", ".join(options))
            section += defaults
        self.state.document.note_explicit_target(section)
        if isinstance(command, click.Group):
            section += [
                self._section(context, command, inner) for inner in command.list_commands(context)
            ]
        return section


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


class TryPage(SphinxDirective):
    """`{try-page}`: the link to the page, or that there is none."""

    def run(self) -> list[nodes.Node]:
        """Return a paragraph."""
        if not (Path(self.env.app.outdir) / TRY_PAGE).is_file():
            return [nodes.paragraph(text=NO_TRY_PAGE)]
        link = nodes.reference(text="Open palpate in the browser", refuri=TRY_PAGE, internal=False)
        return [
            nodes.paragraph(
                "", "", nodes.strong("", "", link), nodes.Text(", or save the file of this link.")
            )
        ]


def make_try_page(app: Sphinx) -> None:
    """Make the page in the folder of the site."""
    out = Path(app.outdir) / TRY_PAGE
    out.unlink(missing_ok=True)
    command = [sys.executable, str(Path(__file__).parents[1] / "try" / "bundle.py"), str(out)]
    done = subprocess.run(command, capture_output=True, encoding="utf-8", check=False)
    if done.returncode:
        logging.getLogger(__name__).info(
            "%s is left out. %s", TRY_PAGE, (done.stderr.strip().splitlines() or [""])[-1]
        )


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the directives, the renderer of formulas, and what is made before the pages."""
    for name, directive in {"command-help": CommandHelp, "try-page": TryPage}.items():
        app.add_directive(name, directive)
    app.add_html_math_renderer("mathml", (inline_formula, None), (block_formula, None))
    app.connect("builder-inited", make_try_page)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
