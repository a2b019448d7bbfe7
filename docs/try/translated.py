"""Functions of palpate as JavaScript, so that the page in a browser has the same sentences and rules, and no copy of them.

Whether the results are equal is tested, function by function.
"""

import ast
import inspect
from collections.abc import Iterable
from types import FunctionType, ModuleType

from javascript import GIVEN, NotTranslated, function, text


def translated(wanted: Iterable[tuple[ModuleType, str]]) -> str:
    """Return functions and constants of modules, and all that they use, as statements of JavaScript.

    Parameters
    ----------
    wanted : iterable of (module, str)

    Raises
    ------
    NotTranslated
        They use a part of Python that is not understood.

    Examples
    --------
    >>> from palpate.live.desk import touching
    >>> translated([(touching, "LONG_S")])
    'const LONG_S = 10.0;'
    """
    found: dict[str, str] = {}
    for module, name in wanted:
        _collect(module, name, found)
    return "\n".join(found.values())


def _collect(module: ModuleType, name: str, found: dict[str, str]) -> None:
    if name in found or name in GIVEN:
        return
    value = vars(module)[name]
    home = inspect.getmodule(value) if isinstance(value, FunctionType) else None
    if home is not None and home is not module:
        _collect(home, name, found)
        return
    node = next((one for one in ast.parse(inspect.getsource(module)).body if name in _bound(one)), None)
    if node is None:
        raise NotTranslated(f"{module.__name__}.{name}: not a function or a constant of this module")
    found[name] = ""  # what it uses may use it, too
    for inner in _used(node):
        if inner in vars(module) and not isinstance(vars(module)[inner], type | ModuleType):
            _collect(module, inner, found)
    del found[name]
    found[name] = _definition(node)


def _used(node: ast.stmt) -> list[str]:
    code: list[ast.AST] = list(node.body) if isinstance(node, ast.FunctionDef) else [_value(node)]
    return [one.id for part in code for one in ast.walk(part) if isinstance(one, ast.Name)]


def _definition(node: ast.stmt) -> str:
    return function(node) if isinstance(node, ast.FunctionDef) else f"const {min(_bound(node))} = {text(_value(node))};"


def _value(node: ast.stmt) -> ast.expr:
    if not isinstance(node, ast.Assign | ast.AnnAssign) or node.value is None:
        raise NotTranslated(ast.unparse(node))
    return node.value


def _bound(node: ast.stmt) -> set[str]:
    if isinstance(node, ast.FunctionDef):
        return {node.name}
    targets = node.targets if isinstance(node, ast.Assign) else [node.target] if isinstance(node, ast.AnnAssign) else []
    return {target.id for target in targets if isinstance(target, ast.Name)}
