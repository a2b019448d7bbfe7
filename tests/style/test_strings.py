"""Modules and functions that a string names are there, and in no higher layer than the module with the string."""

import ast
import re
import tomllib
from collections.abc import Iterator
from importlib.util import find_spec
from pkgutil import resolve_name

import palpate
import pytest
from palpate.cli.main import COMMANDS
from project import ROOT

SOURCES = ROOT / "python" / "palpate"
NAME = re.compile(r"palpate(?:\.\w+)+:\w+|palpate\.\w+(?:\.\w+)+")


def layers() -> dict[str, int]:
    """Return the height of each room, by the contract of pyproject.toml."""
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    rows = contracts["tool"]["importlinter"]["contracts"][0]["layers"]
    heights = {}
    for depth, row in enumerate(rows):
        for room in re.split(" [|:] ", row):
            heights[room] = -depth
    return heights


def strings() -> Iterator[tuple[str, str]]:
    """Yield each string that is the name of something in palpate, after the room that has it."""
    for path in sorted(SOURCES.rglob("*.py")):
        room = path.relative_to(SOURCES).with_suffix("").parts[0]
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Constant) and isinstance(node.value, str):
                if NAME.fullmatch(node.value):
                    yield room, node.value


def test_each_string_names_something_that_is_there() -> None:
    named = set(strings())
    assert ("sources", "palpate.sources.sim:open_sim") in named
    for _, name in named:
        assert resolve_name(name) is not None


def test_no_string_names_something_in_a_higher_layer() -> None:
    heights = layers()
    for room, name in strings():
        assert heights[name.split(".")[1]] <= heights[room], (room, name)


@pytest.mark.parametrize("name", COMMANDS)
def test_each_command_is_there(name: str) -> None:
    assert callable(resolve_name(f"palpate.cli.{COMMANDS[name].function}"))


def test_each_module_that_is_imported_at_its_first_use_is_there() -> None:
    for module, names in palpate._LAZY.items():
        assert find_spec(f"palpate.{module}"), module
        for name in names:
            assert resolve_name(f"palpate.{module}:{name}") is not None
