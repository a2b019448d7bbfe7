"""One name, one meaning: no class, public function or module has the name of another one in the package."""

import ast
from collections import defaultdict
from pathlib import Path

from project import ROOT

SOURCES = ROOT / "python" / "palpate"
# Rooms that are rewritten as a whole, later.
LEFT_OUT = ("reference",)
# Names that still have two meanings; a name leaves this list, and none comes in.
ALLOWED_CLASSES = {"Channels", "Converter", "Truth", "Wiring"}
ALLOWED_FUNCTIONS = {
    *(
        "board_options",
        "fresh",
        "known",
        "level_of",
        "load",
        "look",
    ),
    *("made", "number", "saturated", "split", "text_of", "times", "usable", "write"),
}
ALLOWED_MODULES = {"fit"}


def sources() -> list[Path]:
    """Return the modules whose names count."""
    paths = sorted(SOURCES.rglob("*.py"))
    return [path for path in paths if path.relative_to(SOURCES).parts[0] not in LEFT_OUT]


def repeated(places: dict[str, set[Path]]) -> set[str]:
    """Return the names that have several places."""
    return {name for name, found in places.items() if len(found) > 1}


def defined(kind: type[ast.ClassDef] | type[ast.FunctionDef]) -> dict[str, set[Path]]:
    """Return where each class or function is defined at the top level of a module."""
    places: dict[str, set[Path]] = defaultdict(set)
    for path in sources():
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            if isinstance(node, kind) and not is_command(path, node):
                places[node.name].add(path)
    return places


def is_command(path: Path, node: ast.ClassDef | ast.FunctionDef) -> bool:
    """Return whether this is a command, which has the name that a user types."""
    return path.parent.name == "cli" and bool(node.decorator_list)


def test_a_class_has_a_name_of_its_own() -> None:
    assert repeated(defined(ast.ClassDef)) - ALLOWED_CLASSES == set()


def test_a_public_function_has_a_name_of_its_own() -> None:
    found = repeated(defined(ast.FunctionDef))
    public = {name for name in found if not name.startswith("_")}
    assert public - ALLOWED_FUNCTIONS == set()


def test_a_module_has_a_name_of_its_own() -> None:
    places: dict[str, set[Path]] = defaultdict(set)
    for path in sources():
        if path.stem not in ("__init__", "__main__"):
            places[path.stem].add(path)
    assert repeated(places) - ALLOWED_MODULES == set()
