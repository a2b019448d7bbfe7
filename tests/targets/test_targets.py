"""The headers by their include path alone on other processors and systems: the same bits as here, fusing allowed."""

import subprocess
from functools import cache
from pathlib import Path

import pytest
import targets
from building import run
from kept import kept_json
from project import ROOT, need
from targets import PRINTING, TARGETS, Target

INPUTS = ROOT / "cpp" / "include", ROOT / "tests" / "cpp", ROOT / "bench" / "embedded"


def write(lines: dict[str, list[str]], made: Path) -> None:
    import json

    made.write_text(json.dumps(lines), encoding="utf-8")


@cache
def expected() -> dict[str, list[str]]:
    lines: dict[str, list[str]] = kept_json(
        "targets here", INPUTS, (need("g++"),), lambda made: write(targets.reference("g++"), made)
    )
    return lines


@pytest.mark.parametrize("target", TARGETS, ids=lambda t: f"{t.name}-{t.compiler[0]}")
def test_the_same_bits_by_the_include_path_alone(target: Target) -> None:
    for tool in target.tools:
        need(tool)
    made = kept_json(f"target {target}", INPUTS, (target.compiler[0],), lambda made: write(targets.outputs(target), made))
    assert set(made) == {*PRINTING, *target.checking}
    for program in PRINTING:
        assert made[program] == expected()[program], (target.name, program)
