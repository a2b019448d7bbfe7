"""`palpate doctor`: checks of the installation, the board and the permissions."""

import json
import sys

import click

from palpate import __version__
from palpate.cli.options import json_option

_MARKS = {"ok": "ok", "free": "--", "wrong": "!!"}


@click.command()
@click.option(
    "--install-udev", is_flag=True, help="Linux: write the udev rule that lets users open the board; asks sudo."
)
@json_option
@click.pass_context
def doctor(context: click.Context, install_udev: bool, as_json: bool) -> None:
    """Check installation, board and permissions, and print what to type.

    A board is opened for a moment. "ok": nothing to do; "--": optional, or could be better; "!!": wrong. Exit codes: 0,
    nothing is wrong (a missing board is not wrong); else that of the first wrong line: 1, damaged installation; 2,
    error in a palpate.toml; 3, no permission to open the board or to write the rule; 4, the AD7746 does not answer, or
    the rule cannot be written; 6, no libusb for pyusb.

    \b
    Example:
      palpate doctor
      palpate doctor --install-udev
    """  # noqa: D301
    from palpate.cli import diagnosis, udev_rule

    group = context.find_root().command
    assert isinstance(group, click.Group)
    commands = {name: command for name in group.list_commands(context) if (command := group.get_command(context, name))}
    findings = []
    for finding in udev_rule.steps(as_json=as_json) if install_udev else diagnosis.all_of(commands):
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
