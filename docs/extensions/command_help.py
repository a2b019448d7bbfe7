"""A section for each command, out of what it says of itself."""

from typing import Any

import click
from docutils import nodes
from palpate.cli import COMMANDS, main
from palpate.cli.config import keys
from sphinx.util.docutils import SphinxDirective


class CommandHelp(SphinxDirective):
    """`{command-help}`: every command's help, and its variables."""

    def run(self) -> list[nodes.Node]:
        """Return the sections."""
        context = click.Context(main, info_name="palpate", terminal_width=84, max_content_width=84)
        return [self._section(context, main, name) for name in COMMANDS]

    def _section(self, parent: click.Context, group: click.Group, name: str) -> nodes.section:
        command = group.get_command(parent, name)
        assert command is not None
        context = click.Context(command, info_name=name, parent=parent, terminal_width=84, max_content_width=84)
        path = context.command_path.removeprefix("palpate ")
        anchor = f"command-{path.replace(' ', '-')}"
        section = nodes.section(ids=[anchor], names=[anchor])
        section += nodes.title(text=path)
        text = command.get_help(context)
        section += nodes.literal_block(text, text, language="text")
        options = [key for key in keys(command) if key not in ("json", "debug")]
        if options:
            defaults = nodes.paragraph(text="Keys of its table in palpate.toml: ")
            defaults += nodes.literal(text=", ".join(options))
            section += defaults
        self.state.document.note_explicit_target(section)
        if isinstance(command, click.Group):
            section += [self._section(context, command, inner) for inner in command.list_commands(context)]
        return section


def setup(app: Any) -> dict[str, bool]:
    """Add the directive."""
    app.add_directive("command-help", CommandHelp)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
