"""Collect what palpate says when something is wrong; print what docs/troubleshooting.md lacks.

The rule, by the syntax tree of the package: a message is a text that is given to an exception. A
name stands for the texts that are assigned to it, a call of a function of the module for the texts
that it returns. A value in a text becomes …. A message with the word "allowed" is plain: it says the
value and what to do, so it needs no row. A message of less than three words is only a frame around
another one.

    python tests/tools/error_texts.py
"""

import ast
import builtins
import inspect
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "python" / "palpate"
PAGE = ROOT / "docs" / "troubleshooting.md"
FOR_PROGRAMMERS = {"reference", "simulation", "simulator", "conformance.py", "include"}
"""Folders and modules whose errors only a programmer meets."""
FOREIGN_ERRORS = {"UsageError", "BadParameter", "ClickException"}
"""Exceptions of click."""
NOT_SHOWN = {
    "AssertionError",
    "AttributeError",
    "KeyboardInterrupt",
    "NotImplementedError",
    "OptionError",  # composes "got ..., allowed ..." from its arguments
}
WIRING_ERROR = "Mistake"  # of `ad7746.wiring`: the driver raises some of them together
FEWEST_WORDS = 3
DEEPEST = 3  # names and calls that are followed
VALUE = "…"


@cache
def modules(folder: Path = PACKAGE) -> list[ast.Module]:
    """Return the tree of each module that a user can meet."""
    found = []
    for path in sorted(folder.rglob("*.py")):
        parts = path.relative_to(PACKAGE).parts
        if not FOR_PROGRAMMERS.intersection(parts):
            found.append(ast.parse(path.read_text(encoding="utf-8")))
    return found


def calls(tree: ast.Module) -> Iterator[tuple[ast.AST, ast.Call]]:
    """Yield each call of a module, with the function that it is in."""
    owner: dict[ast.Call, ast.AST] = {}
    for function in ast.walk(tree):  # an inner function comes after the outer one
        if isinstance(function, ast.FunctionDef | ast.Module):
            for node in ast.walk(function):
                if isinstance(node, ast.Call):
                    owner[node] = function
    for call, function in owner.items():
        yield function, call


def name_of(node: ast.AST) -> str:
    """Return the name of what is called or named: `c` of `a.b.c`."""
    if isinstance(node, ast.Attribute):
        return node.attr
    if isinstance(node, ast.Name):
        return node.id
    return ""


def is_target(name: str, node: ast.Assign) -> bool:
    """Return whether a name gets a value, alone."""
    return any(isinstance(each, ast.Name) and each.id == name for each in node.targets)


class NameScope:
    """The names of a function, and of its module."""

    def __init__(self, tree: ast.Module, function: ast.AST) -> None:
        self._tree = tree
        self._function = function

    def texts(self, node: ast.AST | None, depth: int = DEEPEST) -> list[str]:
        """Return the texts that an expression can be."""
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            return [node.value]
        if isinstance(node, ast.JoinedStr):
            return self._joined(node, depth)
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add):
            return self._sums(node, depth)
        if isinstance(node, ast.IfExp):
            return self.texts(node.body, depth) + self.texts(node.orelse, depth)
        if depth > 0 and isinstance(node, ast.Name):
            return self._assigned(node.id, depth)
        if depth > 0 and isinstance(node, ast.Call):
            return self._called(node, depth)
        return [VALUE]

    def _joined(self, node: ast.JoinedStr, depth: int) -> list[str]:
        """Return the texts of an f-string; the names in it count if it has few words itself."""
        text = "".join(_part(part) for part in node.values)
        has_few = words(text) < FEWEST_WORDS
        found = [""]
        for part in node.values:
            own = [_part(part)]
            if depth > 0 and isinstance(part, ast.FormattedValue):
                own = self._values(part.value, depth, is_needed=has_few)
            found = [before + each for before in found for each in own]
        return found

    def _values(self, node: ast.expr, depth: int, *, is_needed: bool) -> list[str]:
        """Return the texts of a value: … unless they are needed, or say what is allowed."""
        if not isinstance(node, ast.Name):
            return [VALUE]
        assigned = self._assigned(node.id, depth)
        return assigned if is_needed or any(map(is_plain, assigned)) else [VALUE]

    def _sums(self, node: ast.BinOp, depth: int) -> list[str]:
        found = []
        for left in self.texts(node.left, depth):
            for right in self.texts(node.right, depth):
                found.append(left + right)
        return found

    def _assigned(self, name: str, depth: int) -> list[str]:
        """Return the texts that a name gets in the function, else in the module."""
        for place in (self._function, self._tree):
            found: list[str] = []
            for node in ast.walk(place):
                if isinstance(node, ast.Assign) and is_target(name, node):
                    found += self.texts(node.value, depth - 1)
            if found:
                return found
        return [VALUE]

    def _called(self, call: ast.Call, depth: int) -> list[str]:
        """Return the texts that a function of the module returns, or a dict of it has."""
        if isinstance(call.func, ast.Attribute) and call.func.attr == "get":
            return self._in_dict(name_of(call.func.value)) + self.texts(call.args[-1], depth)
        for function in ast.walk(self._tree):
            if isinstance(function, ast.FunctionDef) and function.name == name_of(call.func):
                return NameScope(self._tree, function).returned(depth - 1)
        return [VALUE]

    def _in_dict(self, name: str) -> list[str]:
        found = []
        for node in ast.walk(self._tree):
            if isinstance(node, ast.Assign) and is_target(name, node):
                for each in ast.walk(node.value):
                    if isinstance(each, ast.Dict):
                        found += [text for value in each.values for text in self.texts(value)]
        return found

    def returned(self, depth: int = DEEPEST) -> list[str]:
        """Return the texts that the function returns."""
        found = []
        for node in ast.walk(self._function):
            if isinstance(node, ast.Return):
                found += self.texts(node.value, depth)
        return found


def _part(node: ast.expr) -> str:
    """Return a part of an f-string: its own text, or … for a value."""
    return str(node.value) if isinstance(node, ast.Constant) else VALUE


def words(text: str) -> int:
    """Return how many words a text has, without its values."""
    return len(re.findall(r"[A-Za-z]{2,}", text))


def exception_names() -> set[str]:
    """Return the names of all exceptions: Python's, click's and the package's."""
    names = set(FOREIGN_ERRORS)
    for name, value in inspect.getmembers(builtins, inspect.isclass):
        if issubclass(value, Exception):
            names.add(name)
    classes = []
    for tree in modules():
        classes += [node for node in ast.walk(tree) if isinstance(node, ast.ClassDef)]
    known = 0
    while known < len(names):  # until no class of the package has a base among them
        known = len(names)
        for node in classes:
            if names.intersection(map(name_of, node.bases)):
                names.add(node.name)
    return names - NOT_SHOWN | {WIRING_ERROR}


def errors() -> set[str]:
    """Return the messages of errors; not the frames around another message."""
    names = exception_names()
    found: set[str] = set()
    for tree in modules():
        for function, call in calls(tree):
            if name_of(call.func) in names:
                scope = NameScope(tree, function)
                is_wiring = name_of(call.func) == WIRING_ERROR
                for argument in call.args[:1] if is_wiring else call.args:  # the second: what to do
                    found.update(map(one_line, scope.texts(argument)))
    return {text for text in found if words(text) >= FEWEST_WORDS}


def one_line(text: str) -> str:
    """Return a text without line ends, as a command prints it."""
    return " ".join(text.split())


def is_plain(text: str) -> bool:
    """Return whether a message says what is allowed: it needs no row."""
    return "allowed" in text


def doctor_lines() -> set[str]:
    """Return the lines of `palpate doctor` that are wrong or could be better."""
    found: set[str] = set()
    for tree in modules(PACKAGE / "cli"):
        for function, call in calls(tree):
            is_named = any(each.arg in ("code", "is_optional") for each in call.keywords)
            if name_of(call.func) == "Finding" and (is_named or len(call.args) > 3):
                found.update(map(one_line, NameScope(tree, function).texts(call.args[1])))
    return {text for text in found if re.search("[A-Za-z]", text)}


def page_words() -> set[str]:
    """Return the words of the page that say what to do."""
    return _of_page(("Now", "Instruction"), 0) | _of_scripts("word")


def page_titles() -> set[str]:
    """Return the titles of the page's status line."""
    return _of_page(("StatusLine",), 2) | _of_scripts("title")


def _of_page(classes: tuple[str, ...], argument: int) -> set[str]:
    found = set()
    for tree in modules(PACKAGE / "live"):
        for function, call in calls(tree):
            if name_of(call.func) in classes and len(call.args) > argument:
                found.update(NameScope(tree, function).texts(call.args[argument]))
    return found - {"", VALUE}


def _of_scripts(field: str) -> set[str]:
    """Return the texts that the scripts of the page give to a field."""
    found: set[str] = set()
    for path in (PACKAGE / "live" / "page").rglob("*.js"):
        found.update(re.findall(rf'\b{field}: "([^"]+)"', path.read_text(encoding="utf-8")))
    return found


def judgement_texts() -> set[str]:
    """Return the sentences about readings."""
    [tree] = [ast.parse(path.read_text(encoding="utf-8")) for path in PACKAGE.glob("judgements.py")]
    found = set()
    for function in tree.body:
        if isinstance(function, ast.FunctionDef) and function.name.startswith("_"):
            found.update(NameScope(tree, function).returned())
    return found


@cache
def all_texts() -> dict[str, set[str]]:
    """Return what the page has to have, by kind."""
    return {
        "error": errors(),
        "doctor": doctor_lines(),
        "word": page_words(),
        "title": page_titles(),
        "judgement": judgement_texts(),
    }


def code_spans(page: str) -> set[str]:
    """Return what a page marks as code, outside of its blocks."""
    sentences = re.sub(r"^```.*?^```$", "", page, flags=re.DOTALL | re.MULTILINE)
    spans = re.findall(r"(?<!`)(`+)(?!`)(.+?)(?<!`)\1(?!`)", sentences)
    return {text.strip().replace(r"\|", "|") for _, text in spans}


def lacking() -> list[tuple[str, str]]:
    """Return kind and text of what the page does not have."""
    spans = code_spans(PAGE.read_text(encoding="utf-8"))
    return [
        (kind, text)
        for kind, texts in all_texts().items()
        for text in sorted(texts)
        if text not in spans and not (kind == "error" and is_plain(text))
    ]


MESSAGE_TABLES = ("palpate says", "the page says", "note", "line", "title", "word")
"""The first heads of tables whose first column has texts of the package."""


def quoted_texts(page: str) -> set[str]:
    """Return the texts in the first columns of these tables."""
    found = set()
    is_message = False
    for line in page.splitlines():
        if not line.startswith("|"):
            is_message = False
            continue
        first_cell = line.split(" | ")[0].removeprefix("| ")
        if first_cell in MESSAGE_TABLES:
            is_message = True
        elif is_message:
            found.update(code_spans(first_cell))
    return found


def constants() -> str:
    """Return all texts of the package, one after the other."""
    found = []
    for tree in modules():
        for node in ast.walk(tree):
            if isinstance(node, ast.Constant) and isinstance(node.value, str):
                found.append(node.value)
    return "\n".join(found)


def outdated() -> list[str]:
    """Return the messages on the page that the package does not have."""
    known = set().union(*all_texts().values())
    quoted = quoted_texts(PAGE.read_text(encoding="utf-8"))
    source = constants()
    return sorted(text for text in quoted if text not in known and text not in source)


if __name__ == "__main__":
    for kind, text in lacking():
        print(f"lacking {kind}: {text}")
    for text in outdated():
        print(f"outdated: {text}")
