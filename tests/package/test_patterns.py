"""No regular expression of the package takes time that grows faster than the text."""

import ast
import re
import time
from collections.abc import Iterator
from itertools import product
from pathlib import Path

import pytest
from palpate.sources.serial.suggesting import _PART, pattern_for
from project import ROOT

SOURCES = ROOT / "python" / "palpate"
METHODS = {"search", "match", "fullmatch", "split", "sub", "findall", "finditer"}
MADE = {
    "live/access/gatekeeper.py": [
        (r"=([\w-]{32})(?![\w-])", "findall"),
        (r"(?:^|;)\s*palpate-8746=([^;]*)", "findall"),
    ],
    "sources/serial/opening.py": [],
    "sources/serial/suggesting.py": [(_PART.pattern, "match"), (pattern_for(["hard 1", "soft 1"])[8:], "fullmatch")],
}
"""Patterns that are no literals. That of `opening.py` is the user's own."""
UNITS = ("0", "=", ";", "; ", "palpate-8746=", "9.", "9,", "1 ", "1e", "-", " ", "\t", "a", "a ", "a1", "OL", ",", ", ", "hard =", ",hard ",
         "(", "_", "/", ":", "@", "a:", "a:a@", "x@", "'", "extra == ", "a-", "\r", "\n", "1.0 2.0 ", "0a")  # fmt: skip
BEFORE = ("", "1", "a:", "hard=", "numpy extra == ")
AFTER = ("", "!", " ms!", "@")
SIZE, TIMES, FLOOR_S = 1000, 4, 1e-3


def used() -> Iterator[tuple[str, str, str]]:
    """Yield file, pattern and method of each regular expression."""
    for path in sorted(SOURCES.rglob("*.py")):
        name, text = path.relative_to(SOURCES).as_posix(), path.read_text()
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.Assign) and isinstance(node.value, ast.Call) and _is_re(node.value):
                [target] = node.targets
                if isinstance(target, ast.Name) and isinstance(node.value.args[0], ast.Constant):
                    for method in sorted(set(re.findall(rf"\b{target.id}\.(\w+)\(", text)) & METHODS):
                        yield name, str(node.value.args[0].value), method
                    continue
            if isinstance(node, ast.Call) and _is_re(node) and isinstance(node.args[0], ast.Constant):
                assert isinstance(node.func, ast.Attribute)
                if node.func.attr in METHODS:
                    yield name, str(node.args[0].value), node.func.attr
    yield from ((name, *made) for name, patterns in MADE.items() for made in patterns)


def _is_re(call: ast.Call) -> bool:
    function = call.func
    return isinstance(function, ast.Attribute) and isinstance(function.value, ast.Name) and function.value.id == "re"


USED = list(used())


def took(pattern: re.Pattern[str], method: str, text: str) -> float:
    """Return the shortest of some times, s; of this thread, so that others do not matter."""
    call = getattr(pattern, method)
    best = float("inf")
    for _ in range(3):
        begun = time.thread_time()
        found = call("", text) if method == "sub" else call(text)
        _ = list(found) if method == "finditer" else found
        best = min(best, time.thread_time() - begun)
        if not FLOOR_S <= best < 50 * FLOOR_S:
            break
    return best


def grows(pattern: str, method: str) -> Iterator[str]:
    """Yield the texts of which four times as much takes more than eight times as long."""
    compiled = re.compile(pattern)
    for before, unit, after in product(BEFORE, UNITS, AFTER):
        small, large = (before + unit * (size // len(unit)) + after for size in (SIZE, TIMES * SIZE))
        for _ in range(3):  # again, if something else ran meanwhile
            long = took(compiled, method, large)
            if long < FLOOR_S or long < 2 * TIMES * took(compiled, method, small):
                break
        else:
            yield f"{before}{unit * 3}...{after}"


@pytest.mark.parametrize(("file", "pattern", "method"), USED, ids=lambda value: value[:30])
def test_time_grows_with_the_length_only(file: str, pattern: str, method: str) -> None:
    assert next(grows(pattern, method), None) is None, file


@pytest.mark.parametrize(
    "pattern",
    [
        r"([\d.,]+)\s*(ms|s)$",
        r"(\d+(?:[.,]\d+)?)\s*[a-zA-Z]*[\s,;|]+(\d+)",
        r"a*!b",
    ],
)
def test_the_measure_finds_patterns_that_backtrack(pattern: str) -> None:
    assert next(grows(pattern, "search"), None)


def test_every_pattern_is_found() -> None:
    """Each use of `re` in the sources is a literal that is measured, or one of `MADE`."""
    for path in sorted(SOURCES.rglob("*.py")):
        text, name = path.read_text(), path.relative_to(SOURCES).as_posix()
        calls = [node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Call) and _is_re(node)]
        made = [call for call in calls if not isinstance(call.args[0], ast.Constant)]
        assert not made or name in MADE, (name, [ast.unparse(call) for call in made])
    literal = [pattern for file, pattern, _ in USED if file not in MADE]
    assert len(literal) >= len({Path(file) for file, *_ in USED if file not in MADE}) > 5
