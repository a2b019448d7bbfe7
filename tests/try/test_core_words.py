"""Functions that are translated from Python to JavaScript give the same; and what cannot be translated is refused."""

import ast
import json
from dataclasses import asdict, replace
from math import inf, isfinite, isnan, nan
from random import Random
from types import SimpleNamespace
from typing import Any

import pytest
from effort import draws, random_of
from javascript import NotTranslated, function
from palpate import sentences, several
from palpate.live.desk import touching
from palpate.live.desk.facts import Facts, Result
from palpate.live.desk.watching import Seen
from try_core import Node

SIZES = (0.0, 1e-9, 3.1e-5, 0.0123, 0.047, 0.31, 0.99, 1.7, 12.3, 240.0, nan)


def some_touch(rng: Random) -> dict[str, Any]:
    """Return what a touch says of itself, true to nothing."""

    def size() -> float:
        return rng.choice(SIZES) * rng.choice([1, -1, rng.random()])

    return {
        "samples": rng.choice([0, 5, 16, 19, 20, 250]),
        "saturated": rng.choice([0, 1, 7]),
        "refused": rng.choice([0, 3]),
        "ratio": rng.choice([nan, -1.0, 0.5, 0.97, 1.5, 4.2]),
        "standard_error": abs(size()),
        "revised": rng.random() < 0.5,
        "offset_ratio": size(),
        "offset_standard_error": abs(size()),
        "effects": {name: size() for name in ("offset", "drift", "lag", "curve", "shift")},
        "flags": [flag for flag in sentences.FLAGS if rng.random() < 0.25],
    }


def asked(node: Node, name: str, given: list[list[Any]]) -> list[Any]:
    answers: list[Any] = node.ask("call", name=name, args=[json.dumps(_sayable(one)) for one in given])
    return answers


def _sayable(value: Any) -> Any:
    if isinstance(value, float) and not isfinite(value):
        return "NaN" if isnan(value) else "Infinity" if value > 0 else "-Infinity"
    if isinstance(value, dict):
        return {name: _sayable(inner) for name, inner in value.items()}
    return [_sayable(inner) for inner in value] if isinstance(value, list | tuple) else value


def test_the_sentences_about_flags_are_those_of_python(node: Node) -> None:
    rng = random_of("sentences")
    touches = [some_touch(rng) for _ in range(draws(3000, 30_000))]
    there = [SimpleNamespace(**touch) for touch in touches]
    assert asked(node, "advice", [[touch] for touch in touches]) == [sentences.advice(one) for one in there]  # type: ignore[arg-type]
    assert asked(node, "objections", [[touch] for touch in touches]) == [list(several.objections(one)) for one in there]  # type: ignore[arg-type]


def some_facts(rng: Random) -> Facts:

    def maybe(*values: float) -> float:
        return rng.choice([nan, *values])

    result = Result(
        rng.randrange(1, 9), "1.5", rng.choice(["", "short: hold it longer"]), tuple(rng.sample(sorted(touching.HOW), 2)),
        rng.choice(["", "swapped: look"]), rng.random() < 0.5,
    )  # fmt: skip
    seen = replace(
        Seen(),
        share=rng.choice([None, 0.25]),
        left_s=maybe(0.04, 3.21),
        contact_s=maybe(2.4),
        done_s=maybe(3.0, 10.1),
        noise_pF=(nan, nan),
    )
    return Facts(
        rng.choice(["baseline", "no contact", "contact", "adapting", "done", "ended"]), seen, result=rng.choice([None, result]),
        gap_s=rng.choice([inf, 1.0]), gap=rng.choice(["the board restarted", "run.csv went"]), lost=rng.choice([0, 1, 5]), retaken_s=rng.choice([inf, 2.0]),
        next=rng.choice([None, {"name": "gel", "nth": 2, "of": 3}, {"name": None, "of": None}]), about=rng.choice(["", "Recording."]),
    )  # fmt: skip


@pytest.mark.parametrize("name", ["calm", "gap", "retaken", "swapped", "left_out"])
def test_the_word_and_the_line_are_those_of_the_live_page(node: Node, name: str) -> None:
    rng = random_of(name)
    facts = [some_facts(rng) for _ in range(draws(300, 3000))]
    given = [[asdict(one) | {"pressed": one.pressed, "cut_text": one.cut_text}] for one in facts]
    for one, answer in zip(facts, asked(node, name, given), strict=True):
        expected = getattr(touching, name)(one)
        if name == "calm":
            assert answer == [expected[0]._asdict(), expected[1]._asdict()]
        elif expected is None:
            assert answer is None
        else:
            assert answer == {"line": expected.line._asdict(), "now": expected.now and expected.now._asdict()}


@pytest.mark.parametrize(
    "text",
    [
        "def f(x):\n    for y in x: pass",
        "def f(x):\n    return x // 2",
        "def f(x):\n    return f'{x!r}'",
        "def f(x):\n    return f'{x:>9}'",
        "def f(x):\n    return ~x",
        "def f(x):\n    return x.upper()",
        "def f(x):\n    return max(x, key=abs)",
        "def f(x):\n    return print(x, end='')",
        "def f(*, x):\n    return x",
        "def f(x):\n    return {**x}",
        "def f(x):\n    error = x\n    return error",
        "def f(x):\n    x -= 1\n    return x",
        "def f(x):\n    return [y for z in x for y in z]",
        "def f(x):\n    return",
    ],
)
def test_what_is_not_understood_is_not_translated(text: str) -> None:
    [node] = ast.parse(text).body
    assert isinstance(node, ast.FunctionDef)
    with pytest.raises(NotTranslated):
        function(node)
