"""The texts below the fields of a class: `field: int = 0`, then a line in three quotes."""

import ast
import inspect
import textwrap


def attribute_docstrings(owner: type) -> dict[str, str]:
    """Return the text below each field of a class and of its bases."""
    texts: dict[str, str] = {}
    for base in reversed(owner.__mro__):
        if base.__module__.partition(".")[0] == "palpate":
            texts |= _own_texts(base)
    return texts


def _own_texts(owner: type) -> dict[str, str]:
    [node] = ast.parse(textwrap.dedent(inspect.getsource(owner))).body
    assert isinstance(node, ast.ClassDef)
    texts: dict[str, str] = {}
    names: list[str] = []
    for statement in node.body:
        if isinstance(statement, ast.AnnAssign):
            names = [ast.unparse(statement.target)]
        elif isinstance(statement, ast.Assign):
            names = [ast.unparse(target) for target in statement.targets]
        elif _is_text(statement):
            for name in names:
                texts[name] = " ".join(ast.literal_eval(ast.unparse(statement)).split())
            names = []
        else:
            names = []
    return texts


def _is_text(statement: ast.stmt) -> bool:
    if not isinstance(statement, ast.Expr) or not isinstance(statement.value, ast.Constant):
        return False
    return isinstance(statement.value.value, str)
