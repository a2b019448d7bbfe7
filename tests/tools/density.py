"""How large and how dense the Python of each room is. `python tests/tools/density.py [lower]` prints a table.

A room is a folder of the package, or of the tests and benches. Tokens are names, numbers, strings and operators, without
comments, docstrings and layout: the same program has the same number of them, however its lines are broken. Lines are
code lines. if-else expressions, comprehensions, assignments such as `a, b = x, y`, and walruses are counted per
1,000 lines; wide lines, above 100 columns, in per cent; `dict[str, Any]`, and computed attribute names, one by one.

`lower` writes the limits of tests/style/limits.csv again where a room needs less than them; it raises none.
"""

import ast
import csv
import io
import math
import subprocess
import sys
import tokenize
from collections.abc import Iterator
from dataclasses import astuple, dataclass
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[2]
LIMITS = ROOT / "tests" / "style" / "limits.csv"
OTHER_ROOMS = ("tests/tools", "tests", "bench", "release", "docs")
PACKAGE = "python/palpate"
WIDTH = 100
HEADROOM = 1.05  # a room may exceed its limit by so much: one more comprehension is no trend
LAYOUT = {
    tokenize.COMMENT,
    tokenize.NL,
    tokenize.NEWLINE,
    tokenize.INDENT,
    tokenize.DEDENT,
    tokenize.ENDMARKER,
}
COMPREHENSIONS = (ast.ListComp, ast.SetComp, ast.DictComp, ast.GeneratorExp)
DOCUMENTED = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)


@dataclass
class Counts:
    """What is counted in a file, or in a room."""

    files: int = 0
    tokens: int = 0
    lines: int = 0
    if_else: int = 0
    comprehensions: int = 0
    packed: int = 0
    walrus: int = 0
    wide: int = 0
    any_dicts: int = 0
    computed_names: int = 0

    def __add__(self, other: "Counts") -> "Counts":
        """Return the counts of both."""
        pairs = zip(astuple(self), astuple(other), strict=True)
        return Counts(*(a + b for a, b in pairs))


class Density(NamedTuple):
    """The columns that have a limit; the defaults are the limits of a room that has no row in limits.csv."""

    tokens_a_line: float = 7.5
    if_else: float = 12
    comprehensions: float = 15
    packed: float = 2
    walrus: float = 3
    wide: float = 0.5
    any_dicts: float = 0
    computed_names: float = 0


def density_of(counts: Counts) -> Density:
    """Return the densities of a room, rounded up: a tenth for tokens and wide lines, else 1."""
    lines = max(counts.lines, 1)
    thousands = lines / 1000
    return Density(
        tokens_a_line=math.ceil(10 * counts.tokens / lines) / 10,
        if_else=math.ceil(counts.if_else / thousands),
        comprehensions=math.ceil(counts.comprehensions / thousands),
        packed=math.ceil(counts.packed / thousands),
        walrus=math.ceil(counts.walrus / thousands),
        wide=math.ceil(1000 * counts.wide / lines) / 10,
        any_dicts=counts.any_dicts,
        computed_names=counts.computed_names,
    )


def count(text: str) -> Counts:
    """Count in the text of a module."""
    tree = ast.parse(text)
    counts = Counts(files=1)
    lines: set[int] = set()
    docstrings = docstring_lines(tree)
    f_strings = 0
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        name = tokenize.tok_name[token.type]
        if token.type not in LAYOUT and token.start[0] not in docstrings:
            if f_strings == 0:  # an f-string is one token, as it was before Python 3.12
                counts.tokens += 1
            lines.update(range(token.start[0], token.end[0] + 1))
        if name == "FSTRING_START":
            f_strings += 1
        elif name == "FSTRING_END":
            f_strings -= 1
    counts.lines = len(lines)
    source = text.splitlines()
    for line in lines:
        if len(source[line - 1]) > WIDTH:
            counts.wide += 1
    for node in ast.walk(tree):
        count_node(node, counts)
    return counts


def docstring_lines(tree: ast.Module) -> set[int]:
    """Return the numbers of the lines of docstrings."""
    lines: set[int] = set()
    for node in ast.walk(tree):
        if isinstance(node, DOCUMENTED) and ast.get_docstring(node, clean=False) is not None:
            first = node.body[0]
            lines.update(range(first.lineno, (first.end_lineno or first.lineno) + 1))
    return lines


def count_node(node: ast.AST, counts: Counts) -> None:
    """Count a node of the syntax tree."""
    if isinstance(node, ast.IfExp):
        counts.if_else += 1
    elif isinstance(node, COMPREHENSIONS):
        counts.comprehensions += 1
    elif isinstance(node, ast.NamedExpr):
        counts.walrus += 1
    elif isinstance(node, ast.Assign):
        pair = isinstance(node.targets[0], ast.Tuple) and isinstance(node.value, ast.Tuple)
        counts.packed += pair
    elif isinstance(node, ast.Subscript):
        counts.any_dicts += ast.unparse(node) == "dict[str, Any]"
    elif isinstance(node, ast.Call):
        counts.computed_names += has_computed_name(node)


def has_computed_name(call: ast.Call) -> bool:
    """Return whether a call finds an attribute by a name that is computed."""
    if not isinstance(call.func, ast.Name) or not call.args:
        return False
    if call.func.id == "vars":
        return True
    if call.func.id not in ("getattr", "setattr", "hasattr", "delattr"):
        return False
    return len(call.args) > 1 and not isinstance(call.args[1], ast.Constant)


def sources() -> Iterator[tuple[str, Path]]:
    """Yield each Python file that git has, after its room."""
    listed = subprocess.check_output(["git", "ls-files", "*.py"], cwd=ROOT, text=True)
    for name in listed.splitlines():
        path = ROOT / name
        room = room_of(name)
        if room and path.is_file():
            yield room, path


def room_of(name: str) -> str:
    """Return the room of a file; "": none."""
    parts = Path(name).parts
    if name.startswith(PACKAGE):
        return "/".join(parts[:3]) if len(parts) > 3 else PACKAGE
    for room in OTHER_ROOMS:
        if name.startswith(f"{room}/"):
            return room
    return ""


def rooms() -> dict[str, Counts]:
    """Count in all rooms."""
    found: dict[str, Counts] = {}
    for room, path in sources():
        text = path.read_text(encoding="utf-8")
        found[room] = found.get(room, Counts()) + count(text)
    return dict(sorted(found.items()))


def read_limits() -> dict[str, Density]:
    """Return the limits of each room that has a row in the table."""
    limits = {}
    with LIMITS.open(encoding="utf-8", newline="") as file:
        for room, *numbers in list(csv.reader(file))[1:]:
            limits[room] = Density(*map(float, numbers))
    return limits


def exceeded(density: Density, limit: Density) -> list[str]:
    """Return each column that is above its limit and the headroom, in words."""
    texts = []
    for column, value, allowed in zip(Density._fields, density, limit, strict=True):
        if value > HEADROOM * allowed:
            texts.append(f"{column}: {value:g}, at most {allowed:g}")
    return texts


def lower_limits() -> None:
    """Write the limits again: as low as the rooms allow, but not below the defaults."""
    limits = read_limits()
    default = Density()
    with LIMITS.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["room", *Density._fields])
        for room, counts in rooms().items():
            density = density_of(counts)
            needed = Density(*map(max, density, default))
            lowered = map(min, needed, limits.get(room, default))
            if needed != default:
                writer.writerow([room, *(f"{number:g}" for number in lowered)])


def print_table() -> None:
    """Print the counts of all rooms, then of the package, and of the package without live/."""
    print(
        f"{'room':30} files  tokens  lines t/line | per 1,000 lines: if-else  comp  a,b=  :=",
        end="",
    )
    print("  wide % | dict[str, Any]  computed names")
    total = Counts()
    without_live = Counts()
    for room, counts in rooms().items():
        print_row(room, counts)
        if room.startswith(PACKAGE):
            total += counts
            if not room.endswith("/live"):
                without_live += counts
    print_row("the package", total)
    print_row("the package without live/", without_live)


def print_row(name: str, counts: Counts) -> None:
    """Print one line of the table."""
    density = density_of(counts)
    print(
        f"{name:30} {counts.files:5} {counts.tokens:7} {counts.lines:6} {density.tokens_a_line:6.1f}"
        f" |{density.if_else:24}{density.comprehensions:6}{density.packed:6}"
        f"{density.walrus:4}{density.wide:8.1f} |{counts.any_dicts:15}{counts.computed_names:16}"
    )


def main() -> None:
    """Print the table, or lower the limits."""
    if sys.argv[1:] == ["lower"]:
        lower_limits()
    else:
        print_table()


if __name__ == "__main__":
    main()
