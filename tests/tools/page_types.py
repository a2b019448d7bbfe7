"""Types for the JavaScript of the live page, made from the messages: `python tests/tools/page_types.py` writes page/messages.d.ts.

The page refers to them in JSDoc, as `import("./messages").StateMessage`. The file is not served.
"""

from collections.abc import Iterator
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, Union, get_args, get_origin

import msgspec
from msgspec import Meta, Struct, UnsetType
from palpate.live import page_commands, protocol
from project import ROOT

TYPES = ROOT / "python" / "palpate" / "live" / "page" / "messages.d.ts"
HEAD = "// Made by tests/tools/page_types.py from live/protocol.py and live/page_commands.py.\n"
SCALARS: dict[object, str] = {
    str: "string",
    int: "number",
    float: "number",
    bool: "boolean",
    type(None): "null",
}


def types_text() -> str:
    """Return the declarations of all messages, and of the structs in them."""
    parts = [HEAD]
    for struct in structs():
        parts.append(declaration(struct))
    parts.append(union("Message", [each.__name__ for each in protocol.MESSAGES]))
    commands = [each.__name__ for each in page_commands.COMMANDS.values()]
    parts.append(union("Command", commands))
    return "\n".join(parts)


def structs() -> Iterator[type[Struct]]:
    """Yield the structs of both directions, each behind those that it has."""
    seen: dict[type[Struct], None] = {}
    for struct in (*protocol.MESSAGES, *page_commands.COMMANDS.values()):
        collect(struct, seen)
    yield from seen


def collect(kind: Any, seen: dict[type[Struct], None]) -> None:
    """Add a struct, and those in its fields before it."""
    for inner in get_args(kind):
        collect(inner, seen)
    if isinstance(kind, type) and issubclass(kind, Struct) and kind not in seen:
        for field in msgspec.structs.fields(kind):
            collect(field.type, seen)
        seen[kind] = None


def declaration(struct: type[Struct]) -> str:
    """Return the declaration of a struct."""
    text = (struct.__doc__ or "").strip().split("\n")[0]
    lines = [f"/** {text} */", f"export interface {struct.__name__} {{"]
    config = struct.__struct_config__
    if config.tag_field:
        lines.append(f'  {config.tag_field}: "{config.tag}";')
    for field in msgspec.structs.fields(struct):
        optional = "?" if not field.required or UnsetType in get_args(field.type) else ""
        lines.append(f"  {field.name}{optional}: {joined(field.type)};")
    return "\n".join([*lines, "}", ""])


def type_names(kind: Any) -> list[str]:
    """Return the names of a type in TypeScript; several: any of them."""
    origin = get_origin(kind)
    if origin is Annotated:
        return annotated_names(*get_args(kind))
    if origin in (UnionType, Union):
        names: list[str] = []
        for each in get_args(kind):
            if each is not UnsetType:
                names += [name for name in type_names(each) if name not in names]
        return names
    if origin is list:
        [inner] = get_args(kind)
        return [f"({joined(inner)})[]"] if len(type_names(inner)) > 1 else [f"{joined(inner)}[]"]
    if origin is dict:
        _, inner = get_args(kind)
        return [f"{{ [name: string]: {joined(inner)} }}"]
    return [SCALARS.get(kind) or kind.__name__]


def annotated_names(kind: Any, meta: Meta) -> list[str]:
    """Return the names of an annotated type: null is one of them if it says so."""
    names = type_names(kind)
    if meta.extra and meta.extra.get("null"):
        names.append("null")
    return names


def joined(kind: Any) -> str:
    """Return a type in TypeScript."""
    return " | ".join(type_names(kind))


def union(name: str, members: list[str]) -> str:
    """Return the declaration of a union."""
    return f"export type {name} =\n  | " + "\n  | ".join(members) + ";\n"


def write(path: Path = TYPES) -> None:
    """Write the file."""
    path.write_text(types_text(), encoding="utf-8")


if __name__ == "__main__":
    write()
