"""The pages of the Python API: signature, docstring and members of each public name."""

import enum
import inspect
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pkgutil import resolve_name
from typing import Any

from docs.generator.docstrings import Docstring, as_markdown, parse
from docs.generator.markdown import block, code, page, prose, table

_WIDEST = 96
_OTHERS = ("builtins", "enum", "typing", "abc", "collections.abc")
_AGAIN = "32"  # in float32 what the class without this number is in float64
_EXAMPLE = "Examples"


@dataclass(frozen=True)
class ApiPage:
    """One page of the API: its file, its title, a sentence, and the names on it by group."""

    file: str
    title: str
    introduction: str
    groups: dict[str, list[str]]

    def names(self) -> list[str]:
        """Return the names on the page, in order."""
        names = []
        for group in self.groups.values():
            names += group
        return names


@dataclass(frozen=True)
class Member:
    """A method or a property of a class."""

    name: str
    value: Any
    docstring: Docstring

    @property
    def is_method(self) -> bool:
        """Whether it is called."""
        return callable(self.value) or isinstance(self.value, classmethod | staticmethod)


def api_page(described: ApiPage) -> str:
    """Return a page."""
    rows = []
    for name in described.names():
        summary = parse(inspect.getdoc(resolve_name(name)) or "").summary
        rows.append((code(name), prose(summary)))
    parts = [f"# {described.title}", described.introduction, table(("name", "is or does"), rows)]
    for group, names in described.groups.items():
        parts.append(f"## {group}")
        for name in names:
            parts += described_name(name)
    return page(parts)


def described_name(name: str) -> list[str]:
    """Return the parts of a page for one name."""
    value = resolve_name(name)
    docstring = parse(inspect.getdoc(value) or "")
    if not docstring.description:
        raise ValueError(f"{name}: no docstring")
    parts = [f"### {code(name)}", block("python", signature(name, value))]
    parts += as_markdown(docstring)
    if inspect.isclass(value) and not name.endswith(_AGAIN):
        parts += described_members(name.rpartition(".")[2], value, docstring)
    return parts


def described_members(owner: str, value: type, docstring: Docstring) -> list[str]:
    """Return the parts of a page for what a class has, but for what its docstring describes."""
    parts = []
    if issubclass(value, enum.Enum) and "Attributes" not in docstring.sections:
        rows = [(code(member.name), code(str(member.value))) for member in value]
        parts.append(table(("name", "value"), rows))
    described = set()
    for entry in docstring.entries("Attributes"):
        described |= set(entry.name.split(", "))
    found = [member for member in members(value) if member.name not in described]
    properties = [member for member in found if not member.is_method]
    if properties:
        rows = [(code(each.name), prose(each.docstring.summary)) for each in properties]
        parts.append(table(("attribute", "meaning"), rows))
    for member in found:
        if member.is_method:
            parts.append(f"#### {code(f'{owner}.{member.name}')}")
            parts.append(block("python", signature(f"{owner}.{member.name}", member.value)))
            parts += as_markdown(member.docstring)
    return parts


def members(owner: type) -> Iterator[Member]:
    """Yield the public methods and properties with a docstring, in the order of the source."""
    seen = set()
    inherited = dict(inspect.getmembers(owner))
    for base in owner.__mro__:
        if base.__module__ in _OTHERS:
            continue
        for name, value in base.__dict__.items():
            if name.startswith("_") or name in seen or not is_described(value):
                continue
            seen.add(name)
            text = inspect.getdoc(inherited[name]) or ""
            if isinstance(value, property):
                text = value.__doc__ or ""
            if text and not isinstance(value, type):
                yield Member(name, value, parse(text))


def is_described(value: Any) -> bool:
    """Return whether a member is a method or a property, and no constant or field."""
    if isinstance(value, property | classmethod | staticmethod):
        return True
    kind = type(value).__name__
    return kind in (
        "function",
        "cached_property",
        "method_descriptor",
        "getset_descriptor",
        "instancemethod",
        "member_descriptor",
    )


def signature(name: str, value: Any) -> str:
    """Return how a function or a class is called; an enumeration or an error has no call."""
    if isinstance(value, classmethod | staticmethod):
        value = value.__func__
    if inspect.isclass(value):
        short = name
        if issubclass(value, BaseException) or issubclass(value, enum.Enum):
            return f"class {short}({', '.join(base.__name__ for base in value.__bases__)})"
        if getattr(value, "_is_protocol", False):
            return f"class {short}(Protocol)"
    try:
        parameters = list(inspect.signature(value).parameters.values())
    except (TypeError, ValueError):
        return name
    shown = parameter_texts(parameters)
    line = f"{name}({', '.join(shown)})"
    if len(line) <= _WIDEST:
        return line
    lines = "".join(f"    {text},\n" for text in shown)
    return f"{name}(\n{lines})"


def parameter_texts(parameters: list[inspect.Parameter]) -> list[str]:
    """Return the parameters without their types, which the docstring has in words."""
    shown = []
    star = False
    before_slash = False
    for parameter in parameters:
        if parameter.name in ("self", "cls"):
            continue
        positional = parameter.kind is inspect.Parameter.POSITIONAL_ONLY
        if before_slash and not positional:
            shown.append("/")
        before_slash = positional
        text = parameter.name
        if parameter.kind is inspect.Parameter.VAR_POSITIONAL:
            text = f"*{text}"
            star = True
        elif parameter.kind is inspect.Parameter.VAR_KEYWORD:
            text = f"**{text}"
        elif parameter.kind is inspect.Parameter.KEYWORD_ONLY and not star:
            shown.append("*")
            star = True
        if parameter.default is not inspect.Parameter.empty:
            text += f"={default_text(parameter.default)}"
        shown.append(text)
    if before_slash:
        shown.append("/")
    return shown


def default_text(value: Any) -> str:
    """Return a default value as source text; "..." if it is long or an object without one."""
    if isinstance(value, enum.Enum):
        return f"{type(value).__name__}.{value.name}"
    if isinstance(value, float) and value.is_integer() and abs(value) >= 1e5:
        return re.sub(r"e\+0*", "e", f"{value:g}")
    text = repr(value)
    if re.search(r" at 0x|<", text) or len(text) > 40:
        return "..."
    return text


def without_example(pages: list[ApiPage]) -> list[str]:
    """Return the names whose docstring has no example."""
    names = []
    for described in pages:
        for name in described.names():
            if _EXAMPLE not in parse(inspect.getdoc(resolve_name(name)) or "").sections:
                names.append(name)
    return names
