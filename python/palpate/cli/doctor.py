"""`palpate doctor`: whether everything is there, and what to type."""

import json
import sys

import click

from palpate import __version__
from palpate.cli.options import json_option

_MARKS = {"ok": "ok", "free": "--", "wrong": "!!"}


@click.command()
@json_option
@click.pass_context
def doctor(context: click.Context, as_json: bool) -> None:
    """Tell what is installed, plugged in, allowed, and what to type.

    A board is opened for a moment. "ok": nothing to do; "--": not there, and not everybody needs it; "!!": wrong. Exit codes: that of the first
    line that is wrong: 1, a damaged installation; 2, a palpate.toml; 3, a board that may not be opened; 6, no libusb for
    pyusb. Without a board, and with nothing wrong, 0.

    \b
    Example:
      palpate doctor
    """  # noqa: D301
    from palpate.cli import diagnosis

    group = context.find_root().command
    assert isinstance(group, click.Group)
    commands = {name: command for name in group.list_commands(context) if (command := group.get_command(context, name))}
    findings = []
    for finding in diagnosis.all_of(commands):
        findings.append(finding)
        if not as_json:
            click.echo("\n".join([f"{_MARKS[finding.state]}  {finding.what}: {finding.text}", *_indented(finding.do)]))
    wrong = [finding.code or 1 for finding in findings if finding.state == "wrong"]
    if as_json:
        plain = [{name: value for name, value in f._asdict().items() if name != "code"} for f in findings]
        click.echo(json.dumps({"palpate": __version__, "wrong": len(wrong), "findings": plain}, indent=2))
    sys.exit(wrong[0] if wrong else 0)


def _indented(text: str) -> list[str]:
    return [f"      {line}" for line in text.splitlines()]
