"""What the texts mention is there: commands and their options, modules, names, files; in every text of the project."""

import importlib
import importlib.util
import re
import subprocess
from pathlib import Path

import click
import pytest
from command_lines import has_options, lines_of, parsed
from palpate.cli import main
from project import ROOT, need

TEXTS = [
    *sorted(ROOT.glob("*.md")),
    *sorted((ROOT / "docs").glob("*.md")),
    ROOT / "bench" / "README.md",
    *sorted((ROOT / "cpp" / "examples").rglob("*.md")),
]
TODAY = [path for path in TEXTS if path.name != "CHANGELOG.md"]
"""Texts about what is there now; the list of changes names what was there once."""
_SHELL = re.compile(r"^ *```(?:sh|console)\n(.*?)^ *```$", re.DOTALL | re.MULTILINE)
_ANY = re.compile(r"^ *```.*?^ *```$", re.DOTALL | re.MULTILINE)


def each(texts: list[Path]) -> pytest.MarkDecorator:
    return pytest.mark.parametrize("path", [pytest.param(path, id=str(path.relative_to(ROOT))) for path in texts])


def spans(path: Path) -> list[str]:
    """Return what is marked as code in the sentences."""
    return re.findall(r"(?<!`)`([^`\n]+)`(?!`)", _ANY.sub("", path.read_text(encoding="utf-8")))


@each(TODAY)
def test_blocks_of_commands_are_parsed(path: Path) -> None:
    """The shell reads each block, and palpate the commands in it; nothing is run."""
    text = path.read_text(encoding="utf-8")
    for block in re.findall(r"^```sh\n(.*?)^```$", text, re.DOTALL | re.MULTILINE):
        subprocess.run([need("bash"), "-n"], input=block, encoding="utf-8", check=True)
    for block in _SHELL.findall(text):
        for line in lines_of(block):
            if not line.startswith("-") and "2>&1" not in block:  # those are wrong on purpose
                parsed(line)


def test_blocks_of_commands_are_found() -> None:
    found = [
        line for path in TODAY for block in _SHELL.findall(path.read_text(encoding="utf-8")) for line in lines_of(block)
    ]
    assert len(found) > 60
    assert "kit accept usb:" in " ".join(found)


@each(TODAY)
def test_commands_in_sentences_have_these_options(path: Path) -> None:
    mentioned = [span.removeprefix("palpate ") for span in spans(path) if re.match(r"palpate [a-z-]", span)]
    wrong = {span: why for span in mentioned if (why := has_options(span))}
    assert wrong == {}


@each(TODAY)
def test_modules_and_scripts_in_texts_are_there(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    for module in set(re.findall(r"python -m ((?:bench|tests|palpate)[\w.]*\w)", text)):
        assert importlib.util.find_spec(module), module
    for script in set(re.findall(r"(?:python|bash) ((?:tests|bench|docs|release|cpp)/[\w./-]+)", text)):
        assert (ROOT / script).is_file(), script
    for script in set(re.findall(r"`(\.ci/[\w.]+)", text)):
        assert not (ROOT / ".ci").is_dir() or (ROOT / script).is_file(), script


@each(TODAY)
def test_names_of_python_in_sentences_exist(path: Path) -> None:
    for span in spans(path):
        match = re.fullmatch(r"(palpate(?:\.[A-Za-z_]\w*)+)(?:\(.*\))?", span)
        if match and not re.search(r"\.(hpp|h|toml|css|csv|json|sources|devices|html|wasm)$", span):
            importlib.import_module("palpate")
            assert exists(match[1]), span


def test_every_page_answers_a_question() -> None:
    """Each page is in the index of questions, docs/howdoi.md."""
    linked = set(re.findall(r"\]\((\w+)\.md", (ROOT / "docs" / "howdoi.md").read_text(encoding="utf-8")))
    assert {path.stem for path in (ROOT / "docs").glob("*.md")} - {"index", "howdoi"} - linked == set()


def exists(name: str) -> bool:
    """Return whether a full name is a module, or an attribute of one."""
    parts = name.split(".")
    for count in range(len(parts), 0, -1):
        try:
            found = importlib.import_module(".".join(parts[:count]))
        except ImportError:
            continue
        for part in parts[count:]:
            if not hasattr(found, part):
                return part in getattr(found, "__annotations__", {})
            found = getattr(found, part)
        return True
    return False


def every(group: click.Group, path: str) -> list[tuple[str, click.Command]]:
    """Return all commands below a group."""
    found: list[tuple[str, click.Command]] = []
    for name in group.list_commands(click.Context(group)):
        command = group.get_command(click.Context(group), name)
        assert command is not None
        found.append((f"{path} {name}", command))
        if isinstance(command, click.Group):
            found += every(command, f"{path} {name}")
    return found


def test_examples_in_the_help_of_each_command_are_parsed() -> None:
    counted = 0
    for name, command in [("palpate", main), *every(main, "palpate")]:
        text = command.get_help(click.Context(command, info_name=name))
        for line in re.findall(r"^ {4}palpate (.*)$", text, re.MULTILINE):
            counted += 1
            parsed(line)
    assert counted > 10
