"""The page of symptoms has each exit code, flag, word, title, note and error by its exact words."""

import ast
import re

from error_texts import PAGE, NameScope, all_texts, code_spans, errors, is_plain, lacking, outdated
from palpate.cli.exit_codes import ExitCode
from palpate.flags import Flag, Suspicion


def first_cells(title: str) -> list[str]:
    """Return the first cell of each row of the table under a title."""
    text = PAGE.read_text(encoding="utf-8")
    section = text.split(f"## {title}\n")[1].split("\n## ")[0]
    cells = re.findall(r"^\| ?(.*?) ?\|", section, re.MULTILINE)
    return cells[2:]  # without the header and the rule below it


def test_each_message_that_is_not_plain_is_on_the_page() -> None:
    """`python tests/tools/error_texts.py` prints them one by one."""
    assert lacking() == []


def test_no_message_of_the_page_is_gone() -> None:
    assert outdated() == []


def test_exit_codes_and_flags_are_on_the_page() -> None:
    assert [int(cell) for cell in first_cells("Exit codes")] == [code.value for code in ExitCode]
    flags = [cell.strip("`*") for cell in first_cells("Flags of a touch")]
    assert flags == [*(flag.value for flag in Flag), *(each.value for each in Suspicion)]


def test_flags_that_exclude_nothing_have_a_star() -> None:
    """As `flags.py` says: a touch with only this flag counts."""
    marked = [cell.strip("`*") for cell in first_cells("Flags of a touch") if cell.endswith("*")]
    never = [flag.value for flag in Flag if flag.meaning.excludes.__name__ == "_never"]
    assert marked == never


def test_the_rule_finds_messages_of_each_kind() -> None:
    """Else an empty set would be complete, too."""
    found = all_texts()
    assert all(len(found[kind]) > 8 for kind in ("doctor", "word", "title", "judgement"))
    assert len([text for text in errors() if not is_plain(text)]) > 100
    assert "has no rows" in found["error"]


def test_the_rule_follows_names_and_calls() -> None:
    source = """
DAMAGED = {"changed": "It was changed."}

def reason(size):
    if size:
        return f"it has {size} bytes"
    return "it is empty"

def check(size, verdict):
    text = reason(size) + ": repeat"
    raise ValueError(text, DAMAGED.get(verdict, "It is fine."), "a" if size else "b")
"""
    tree = ast.parse(source)
    check = tree.body[-1]
    [call] = [each.exc for each in ast.walk(check) if isinstance(each, ast.Raise)]
    assert isinstance(call, ast.Call)
    scope = NameScope(tree, check)
    assert [sorted(scope.texts(each)) for each in call.args] == [
        ["it has … bytes: repeat", "it is empty: repeat"],
        ["It is fine.", "It was changed."],
        ["a", "b"],
    ]


def test_code_with_backticks_is_read_whole() -> None:
    assert code_spans("a `b` and ``c `d` e``, `` `f` g ``") == {"b", "c `d` e", "`f` g"}
