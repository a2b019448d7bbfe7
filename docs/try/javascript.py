"""Expressions and statements of Python as JavaScript: what plain functions of values are made of, and nothing else."""

import ast
import json
from collections.abc import Callable

GIVEN = {
    "isfinite": "Number.isFinite",
    "abs": "Math.abs",
    "bool": "Boolean",
    "isinf": "isinf",
    "error": "error",
    "plus_minus": "plusMinus",
    "Now": "Now",
    "Line": "Line",
    "View": "View",
    "sentence": "sentence",
}
"""Functions that JavaScript has, or docs/try/core/given.js."""
_COMPARES = {
    ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "===", ast.NotEq: "!==", ast.Is: "===", ast.IsNot: "!=="
}  # fmt: skip
_OPERATORS = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/"}


class NotTranslated(ValueError):
    """A part of Python that is not understood here."""


def function(node: ast.FunctionDef) -> str:
    """Return a function.

    Examples
    --------
    >>> [node] = ast.parse("def half(x): return x / 2").body
    >>> function(node).splitlines()
    ['function half(x) {', '  return (x / 2);', '}']
    """
    own = {one.id for one in ast.walk(node) if isinstance(one, ast.Name) and isinstance(one.ctx, ast.Store)}
    own -= {name for one in ast.walk(node) if isinstance(one, ast.comprehension) for name in _names(one.target)}
    if taken := own & {*GIVEN.values(), "has", "common", "largest", "fixed", "general"}:
        raise NotTranslated(f"{node.name}: {min(taken)} is the name of a function of JavaScript's side")
    let = [f"let {', '.join(sorted(own))};"] if own else []
    body = [one for one in node.body if not (isinstance(one, ast.Expr) and isinstance(one.value, ast.Constant))]
    lines = [*let, *(statement(one) for one in body)]
    return f"function {node.name}({_parameters(node.args)}) {{\n{_indented(lines)}\n}}"


def statement(node: ast.stmt) -> str:
    """Return a statement."""
    match node:
        case ast.Return(value=ast.expr() as value):
            return f"return {text(value)};"
        case ast.If():
            otherwise = f" else {{\n{_indented(map(statement, node.orelse))}\n}}" if node.orelse else ""
            return f"if ({text(node.test)}) {{\n{_indented(map(statement, node.body))}\n}}{otherwise}"
        case ast.Assign(targets=[target]):
            return f"{text(target)} = {text(node.value)};"
        case ast.AugAssign(op=ast.Add()):
            return f"{text(node.target)} += {text(node.value)};"
    raise _not(node)


def text(node: ast.expr) -> str:
    """Return an expression.

    Examples
    --------
    >>> text(ast.parse("f'{a} of {b}' if 0 < a < b else ''", mode="eval").body)
    '(((0 < a) && (a < b)) ? `${a} of ${b}` : "")'
    """
    kind = type(node).__name__
    if kind not in _EXPRESSIONS:
        raise _not(node)
    return _EXPRESSIONS[kind](node)


def _joined(node: ast.JoinedStr) -> str:
    parts = []
    for part in node.values:
        if isinstance(part, ast.Constant):
            parts.append(json.dumps(part.value, ensure_ascii=False)[1:-1].replace("`", "\\`").replace("${", "\\${"))
        elif isinstance(part, ast.FormattedValue) and part.conversion == -1:
            parts.append(f"${{{_formatted(part)}}}")
        else:
            raise _not(part)
    return "`" + "".join(parts).replace('\\"', '"') + "`"


def _formatted(part: ast.FormattedValue) -> str:
    if part.format_spec is None:
        return text(part.value)
    match part.format_spec:
        case ast.JoinedStr(values=[ast.Constant(value=str(spec))]) if spec[0] == "." and spec[1:-1].isdigit():
            how = {"f": "fixed", "g": "general"}.get(spec[-1])
            if how:
                return f"{how}({text(part.value)}, {spec[1:-1]})"
    raise _not(part)


def _compare(node: ast.Compare) -> str:
    parts = []
    for left, operator, right in zip([node.left, *node.comparators], node.ops, node.comparators, strict=False):
        if isinstance(operator, ast.In | ast.NotIn):
            parts.append(f"{'!' if isinstance(operator, ast.NotIn) else ''}has({text(right)}, {text(left)})")
        else:
            parts.append(f"({text(left)} {_COMPARES[type(operator)]} {text(right)})")
    return parts[0] if len(parts) == 1 else f"({' && '.join(parts)})"


def _binary(node: ast.BinOp) -> str:
    left, right = text(node.left), text(node.right)
    if isinstance(node.op, ast.BitAnd):  # of sets
        return f"common({left}, {right})"
    if type(node.op) not in _OPERATORS:
        raise _not(node)
    return f"({left} {_OPERATORS[type(node.op)]} {right})"


def _unary(node: ast.UnaryOp) -> str:
    signs = {ast.Not: "!", ast.USub: "-"}
    if type(node.op) not in signs:
        raise _not(node)
    return f"{signs[type(node.op)]}{text(node.operand)}"


def _call(node: ast.Call) -> str:
    arguments = [text(one) for one in node.args]
    match node:
        case ast.Call(func=ast.Name(id="set" | "tuple"), args=[_], keywords=[]):
            return arguments[0]
        case ast.Call(func=ast.Name(id="next"), args=[ast.GeneratorExp(), _], keywords=[]):
            return f"({arguments[0]}[0] ?? {arguments[1]})"
        case ast.Call(func=ast.Name(id="max"), args=[_, _, *_], keywords=[ast.keyword(arg="key", value=by)]):
            return f"largest({text(by)}, {', '.join(arguments)})"
        case ast.Call(func=ast.Name(id="max"), args=[_], keywords=[]):
            return f"Math.max(...{arguments[0]})"
        case ast.Call(func=ast.Attribute(value=ast.Name(id="math"), attr=name), keywords=[]) if name in GIVEN:
            return f"{GIVEN[name]}({', '.join(arguments)})"
        case ast.Call(func=ast.Attribute(value=inner, attr=method), keywords=[]):
            return _method(inner, method, arguments)
        case ast.Call(func=ast.Name() | ast.Subscript() | ast.Call(), keywords=[]):
            return f"{text(node.func)}({', '.join(arguments)})"
    raise _not(node)


def _method(inner: ast.expr, method: str, arguments: list[str]) -> str:
    match method, arguments:
        case "get", [key]:
            return f"({text(inner)}[{key}] ?? null)"
        case "get", [key, default]:
            return f"({text(inner)}[{key}] ?? {default})"
        case "items", []:
            return f"Object.entries({text(inner)})"
        case "join", [parts]:
            return f"{parts}.join({text(inner)})"
        case "strip", []:
            return f"{text(inner)}.trim()"
        case "startswith", [begin]:
            return f"{text(inner)}.startsWith({begin})"
    raise _not(inner)


def _comprehension(node: ast.ListComp | ast.SetComp | ast.GeneratorExp) -> str:
    match node.generators:
        case [ast.comprehension(is_async=0) as one]:
            target = text(one.target)
            tests = "".join(f".filter(({target}) => {text(test)})" for test in one.ifs)
            return f"{text(one.iter)}{tests}.map(({target}) => {text(node.elt)})"
    raise _not(node)


def _dict(node: ast.Dict) -> str:
    if None in node.keys:
        raise _not(node)
    pairs = (f"{text(key)}: {text(value)}" for key, value in zip(node.keys, node.values, strict=True) if key)
    return f"{{ {', '.join(pairs)} }}"


def _list(node: ast.List | ast.Tuple | ast.Set) -> str:
    return f"[{', '.join(text(one) for one in node.elts)}]"


_EXPRESSIONS: dict[str, Callable[..., str]] = {
    "Constant": lambda node: json.dumps(node.value, ensure_ascii=False),
    "Name": lambda node: GIVEN.get(node.id, node.id),
    "Attribute": lambda node: f"{text(node.value)}.{node.attr}",
    "Subscript": lambda node: f"{text(node.value)}[{text(node.slice)}]",
    "BoolOp": lambda node: f"({(' && ' if isinstance(node.op, ast.And) else ' || ').join(map(text, node.values))})",
    "IfExp": lambda node: f"({text(node.test)} ? {text(node.body)} : {text(node.orelse)})",
    "NamedExpr": lambda node: f"({text(node.target)} = {text(node.value)})",
    "Starred": lambda node: f"...{text(node.value)}",
    "Lambda": lambda node: f"({_parameters(node.args)}) => {text(node.body)}",
    "JoinedStr": _joined,
    "Compare": _compare,
    "BinOp": _binary,
    "UnaryOp": _unary,
    "Call": _call,
    "ListComp": _comprehension,
    "SetComp": _comprehension,
    "GeneratorExp": _comprehension,
    "Dict": _dict,
    "List": _list,
    "Tuple": _list,
    "Set": _list,
}


def _parameters(given: ast.arguments) -> str:
    if given.kwonlyargs or given.kwarg or given.posonlyargs:
        raise NotTranslated(f"parameters: {ast.unparse(given)}")
    names = [one.arg for one in given.args]
    for at, default in enumerate(given.defaults, len(names) - len(given.defaults)):
        names[at] += f" = {text(default)}"
    return ", ".join([*names, *([f"...{given.vararg.arg}"] if given.vararg else [])])


def _names(target: ast.expr) -> set[str]:
    return {one.id for one in ast.walk(target) if isinstance(one, ast.Name)}


def _indented(lines: "list[str] | map[str]") -> str:
    return "\n".join(f"  {line}" for each in lines for line in each.splitlines())


def _not(node: ast.AST) -> NotTranslated:
    shown = ast.unparse(node) if isinstance(node, ast.expr | ast.stmt) else ast.dump(node)
    return NotTranslated(f"not translated to JavaScript: {shown}")
