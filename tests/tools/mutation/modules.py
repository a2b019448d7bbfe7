"""The mutants of the Python package: operators and constants in the syntax tree, changed in the text."""

import ast
from collections.abc import Iterator
from pathlib import Path

FLIPPED = {"+": "-", "-": "+", "*": "/", "/": "*", "//": "/", "%": "//", "<": ">=", ">": "<=", "<=": ">", ">=": "<",
           "==": "!=", "!=": "==", "is": "is not", "is not": "is", "in": "not in", "not in": "in", "and": "or", "or": "and"}  # fmt: skip


def changes(path: Path) -> list[tuple[int, int, str]]:
    """Return all mutants of a module: begin and end of what is written, in bytes, and what stands there instead."""
    text = path.read_bytes()
    starts = [0]
    for row in text.splitlines(keepends=True):
        starts.append(starts[-1] + len(row))

    def extent(node: ast.expr) -> tuple[int, int]:
        assert node.end_lineno
        assert node.end_col_offset
        return starts[node.lineno - 1] + node.col_offset, starts[
            node.end_lineno - 1
        ] + node.end_col_offset

    found = set()
    for node in _executed(ast.parse(text)):
        if operands := _operands(node):
            start = extent(operands[0])[1]
            end = extent(operands[1])[0]
            operator = text[start:end].decode().strip(" ()\n\\")
            if operator in FLIPPED:
                start = text.index(operator.encode(), start)
                found.add((start, start + len(operator), FLIPPED[operator]))
        elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
            found.add((extent(node)[0], extent(node)[0] + 3, ""))
        elif isinstance(node, ast.Constant) and isinstance(node.value, bool | int | float):
            found.add((*extent(node), _nudged(node.value)))
    return sorted(found)


def _executed(node: ast.AST) -> Iterator[ast.AST]:
    """Return all nodes but annotations, and f-strings, whose places Python 3.11 does not know."""
    if isinstance(node, ast.JoinedStr):
        return
    yield node
    for name, value in ast.iter_fields(node):
        for child in value if isinstance(value, list) else [value]:
            if isinstance(child, ast.AST) and name not in {"annotation", "returns"}:
                yield from _executed(child)


def _operands(node: ast.AST) -> tuple[ast.expr, ast.expr] | None:
    if isinstance(node, ast.BinOp):
        return node.left, node.right
    if isinstance(node, ast.BoolOp):
        return node.values[0], node.values[1]
    return (node.left, node.comparators[0]) if isinstance(node, ast.Compare) else None


def _nudged(value: bool | float) -> str:
    if isinstance(value, bool):
        return str(not value)
    return str(value + 1) if isinstance(value, int) or not value else repr(value * 1.1)
