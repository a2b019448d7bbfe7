"""Every text of the project: what it mentions is there (commands, options, modules, names, files), in plain words."""

import importlib.util
import pkgutil
import re
import subprocess
from pathlib import Path

import click
import pytest
from command_lines import commands, has_options, lines_of, parsed
from palpate.cli.main import palpate_command
from project import ROOT, need

TEXTS = [
    path
    for folder in (".", "docs", "bench", "cpp/examples/arduino/palpate_ad7746")
    for path in sorted((ROOT / folder).glob("*.md"))
]
TODAY = [path for path in TEXTS if path.name != "CHANGELOG.md"]  # which names what was there once
each = pytest.mark.parametrize(
    "path", [pytest.param(path, id=str(path.relative_to(ROOT))) for path in TODAY]
)
_SHELL = re.compile(r"^ *```(?:sh|console)\n(.*?)^ *```$", re.DOTALL | re.MULTILINE)
_ANY = re.compile(r"^ *```.*?^ *```$", re.DOTALL | re.MULTILINE)


def spans(path: Path) -> list[str]:
    """Return what is marked as code in the sentences."""
    return re.findall(r"(?<!`)`([^`\n]+)`(?!`)", _ANY.sub("", path.read_text(encoding="utf-8")))


def test_no_picture_is_large() -> None:
    """Of tests/tools/pictures.py, which makes them, and of the benches."""
    pictures = [*(ROOT / "docs" / "images").iterdir(), *(ROOT / "bench" / "results").glob("*.png")]
    assert [path.name for path in pictures if path.stat().st_size > 160_000] == []


@each
def test_blocks_of_commands_are_parsed(path: Path) -> None:
    """The shell reads each block, and palpate the commands in it; nothing is run."""
    text = path.read_text(encoding="utf-8")
    for block in re.findall(r"^```sh\n(.*?)^```$", text, re.DOTALL | re.MULTILINE):
        subprocess.run([need("bash"), "-n"], input=block, encoding="utf-8", check=True)
    for block in _SHELL.findall(text):
        for line in lines_of(block):
            if not line.startswith("-") and "2>&1" not in block:  # those are wrong on purpose
                parsed(line)


@each
def test_commands_in_sentences_have_these_options(path: Path) -> None:
    mentioned = [
        span.removeprefix("palpate ") for span in spans(path) if re.match(r"palpate [a-z-]", span)
    ]
    wrong = {span: why for span in mentioned if (why := has_options(span))}
    assert wrong == {}


@each
def test_modules_and_scripts_in_texts_are_there(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    for module in set(re.findall(r"python -m ((?:bench|tests|palpate)[\w.]*\w)", text)):
        assert importlib.util.find_spec(module), module
    for script in set(
        re.findall(r"(?:python|bash) ((?:tests|bench|docs|release|cpp)/[\w./-]+)", text)
    ):
        assert (ROOT / script).is_file(), script
    for file, test in re.findall(r"`(tests/[\w/]+\.py)::(\w+)`", text):
        assert f"def {test}(" in (ROOT / file).read_text(encoding="utf-8"), f"{file}::{test}"
    for script in set(re.findall(r"`(\.ci/[\w.]+)", text)):
        assert not (ROOT / ".ci").is_dir() or (ROOT / script).is_file(), script


@each
def test_names_of_python_in_sentences_exist(path: Path) -> None:
    for span in spans(path):
        match = re.fullmatch(r"(palpate(?:\.[A-Za-z_]\w*)+)(?:\(.*\))?", span)
        if match and not re.search(r"\.(hpp|h|toml|css|csv|json|sources|devices|html|wasm)$", span):
            assert pkgutil.resolve_name(match[1]) is not None, span


def test_examples_in_the_help_of_each_command_are_parsed() -> None:
    counted = 0
    for words, command in commands():
        text = command.get_help(
            click.Context(command, info_name=" ".join(words), **palpate_command.context_settings)
        )
        for line in re.findall(r"^ {4}palpate (.*)$", text, re.MULTILINE):
            counted += 1
            parsed(line)
    assert counted > 10


SOURCES = [
    path
    for folder in ("python", "cpp", "bench", "docs", "release")
    for path in (ROOT / folder).rglob("*")
    if path.suffix in (".py", ".pyi", ".hpp", ".cpp", ".js") and "build" not in path.parts
]
EVERYWHERE = ["is told", "what holds", "so many at most", "none waits", "is believed", "mended"]
IN_TEXTS = ["that of", "those of", "is said", "are said", "are told", "none of", "others"]
PRINTED = re.compile(r"^```.*?^```$|^<!-- python.*?<!-- end -->$", re.DOTALL | re.MULTILINE)


def test_pages_and_sources_are_plain() -> None:
    texts = {
        path: (PRINTED.sub("", path.read_text(encoding="utf-8")), EVERYWHERE + IN_TEXTS)
        for path in TEXTS
    }
    texts |= {path: (path.read_text(encoding="utf-8"), EVERYWHERE) for path in SOURCES}
    assert len(texts) > 250
    found = []
    for path, (text, phrases) in texts.items():
        phrase = rf"\b(?:{'|'.join(phrases)})\b".replace(" ", r"\s+")
        found += [
            f"{path.relative_to(ROOT)}: {match[0]}"
            for match in re.finditer(phrase, text, re.IGNORECASE)
        ]
    assert found == []
