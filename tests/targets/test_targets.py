"""The headers by their include path alone on other processors and systems: the same bits as here, fusing allowed."""

import json
from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest
import targets
from kept import kept_json
from project import ROOT, need
from targets import TARGETS, Target

INPUTS = ROOT / "cpp" / "include", ROOT / "tests" / "cpp", ROOT / "bench" / "embedded"


def kept(name: str, compiler: str, make: Callable[[], dict[str, list[str]]]) -> dict[str, list[str]]:
    """Return the lines of each program, compiled and run again if a source or the compiler has changed."""

    def write(made: Path) -> None:
        made.write_text(json.dumps(make()), encoding="utf-8")

    lines: dict[str, list[str]] = kept_json(name, INPUTS, (need(compiler),), write)
    return lines


@cache
def expected() -> dict[str, list[str]]:
    return kept("targets here", "g++", lambda: targets.reference("g++"))


@pytest.mark.parametrize("target", TARGETS, ids=lambda t: f"{t.name}-{t.compiler[0]}")
def test_the_same_bits_by_the_include_path_alone(target: Target) -> None:
    for tool in target.tools:
        need(tool)
    made = kept(f"target {target}", target.compiler[0], lambda: targets.outputs(target))
    assert list(made) == [*target.printing, *target.checking]
    for program in target.printing:
        assert made[program] == expected()[program], (target.name, program)
