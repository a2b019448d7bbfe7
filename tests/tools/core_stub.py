"""Write the compiled core's stub from the module itself.

    python tests/tools/core_stub.py > python/palpate/_core.pyi; ruff format python/palpate/_core.pyi

Names, their order, kinds and defaults are the module's own; here stand the types, which it does not carry.
"""

import inspect
from collections.abc import Iterable, Iterator
from typing import Any

from palpate import _core

HEAD = """\
# Written by tests/tools/core_stub.py from the compiled module: to change it, change that.
from collections.abc import Sequence
from typing import Any, ClassVar, Literal, Self, SupportsIndex, TypeAlias, TypedDict, Unpack, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

__version__: str
scenes: tuple[str, ...]

def simd() -> str: ...
"""
NUMBER, COUNT, FLAG = "float", "int", "bool"
"""Of a bank an array of them, one a stream."""

PARAMETERS = {
    "capacity": "int",
    "count": "int",
    "decimal": 'Literal[".", ","]',
    "delimiter": "str",
    "force": "bool",
    "hard": "ArrayLike",
    "largest_code": "int",
    "memo": "dict[int, Any]",
    "other": "object",
    "output": "ArrayLike",
    "protocol": "SupportsIndex",
    "regressor": "ArrayLike",
    "sample": "tuple[Any, ...]",
    "samples": "NDArray[np.void]",
    "shapes": "Sequence[str]",
    "scale": "tuple[int, float] | None",
    "soft": "ArrayLike",
    "state": "tuple[Any, ...]",
    "streams": "int",
    "t_hard": "ArrayLike",
    "t_soft": "ArrayLike",
    "text": "bytes",
    "uncertainty": "bool",
}
"""Others are settings, numbers."""
METHODS = {
    "__copy__": "Self",
    "__deepcopy__": "Self",
    "__eq__": "bool",
    "__getstate__": "tuple[Any, ...]",
    "__len__": "int",
    "__reduce_ex__": "tuple[Any, ...]",
    "__setstate__": "None",
    "_repr_html_": "str",
    "_untimed": "Touch",
    "as_dict": "dict[str, Any]",
    "close": "None",
    "copy": "Self",
    "count_lines": "int",
    "feed": "Touch | None",
    "format": "bytes",
    "finish": "Touch | None",
    "gap": "None",
    "ordinary": "tuple[float, int, tuple[float, float], tuple[float, float]] | None",
    "parse": "NDArray[np.void] | None",
    "pop_many": "int",
    "push": "bool",
    "row": "tuple[int, int, int, int, int, float, float, int, int]",
    "push_many": "int",
    "read": "tuple[int, list[NDArray[Any]]]",
    "revisions_since": "list[int]",
    "reset": "None",
    "take": "None",
    "tare": "None",
    "touches_since": "list[Touch]",
    "trace": "NDArray[np.void]",
}
SETTINGS = {"samples": "int | None", "seconds": "float | None", "host_stamps": "bool"}
"""Others are numbers."""
PROPERTIES = {
    "alarm": FLAG,
    "alarm_share": "float",
    "capacity": "int",
    "closed": "bool",
    "covariance": NUMBER,
    "dropped": "int",
    "dtype": "np.dtype[np.void]",
    "effects": "dict[str, float]",
    "first_dropped": "int | None",
    "first_ratio": "float",
    "first_standard_error": "float",
    "flags": "tuple[str, ...]",
    "innovation": NUMBER,
    "marked": "tuple[bool, ...]",
    "offset_ratio": "float",
    "offset_standard_error": "float",
    "ratio": NUMBER,
    "readings": "int",
    "refused": "int",
    "rejected": COUNT,
    "retaken": "int",
    "revised": "bool",
    "revision_count": "int",
    "rows": "int",
    "samples": COUNT,
    "saturated": "int",
    "scene": "_Scene",
    "settings": "dict[str, float]",
    "standard_error": NUMBER,
    "start": "int",
    "start_s": "float",
    "state": 'Literal["baseline", "waiting", "contact", "done"]',
    "statistic": NUMBER,
    "sure": "tuple[bool, ...]",
    "streams": "int",
    "touch_count": "int",
    "touches": "list[Touch]",
}


ARRAYS = {NUMBER: "{}", COUNT: "NDArray[np.uint64]", FLAG: "NDArray[np.bool_]"}


def rows_of(cls: Any) -> str:
    """Return the type of what process returns."""
    if cls is _core.Tracker:
        return "NDArray[np.void]"
    values = [[1.0]] if "Bank" in cls.__name__ else [1.0]
    return f"NDArray[np.{(cls(1) if 'Bank' in cls.__name__ else cls()).process(values, values).dtype}]"


def parameter_type(cls: Any, method: str, parameter: inspect.Parameter) -> str:
    """Return the type of a parameter."""
    if parameter.name == "out":
        rows = rows_of(cls) if method in ("update", "process") else "NDArray[np.void]"
        return rows if parameter.default is parameter.empty else f"{rows} | None"
    numbers = method == "feed" or (method == "update" and "Bank" not in cls.__name__)
    return "float" if numbers else PARAMETERS.get(parameter.name, "float")


def parameters(cls: Any, method: str) -> str:
    """Return the parameters of a method, with their types."""
    found = ["self"]
    given = list(inspect.signature(getattr(cls, method)).parameters.values())[1:]
    for p in given:
        if p.kind is p.KEYWORD_ONLY and "*" not in found:
            found.append("*")
        default = "" if p.default is p.empty else f" = {p.default!r}"
        found.append(f"{p.name}: {parameter_type(cls, method, p)}{default}")
    if given and given[-1].kind is inspect.Parameter.POSITIONAL_ONLY:
        found.append("/")
    return ", ".join(found)


def result_type(cls: Any, method: str) -> str:
    """Return the type of what a method returns."""
    if method == "update" and "Bank" not in cls.__name__:
        return "float"
    return METHODS.get(method) or rows_of(cls)


def property_type(cls: Any, name: str) -> str:
    """Return the type of a property."""
    if cls is _core.Tracker and name == "settings":
        return "dict[str, Any]"  # what any of the constructors takes
    kind, single = PROPERTIES[name], "Bank" not in cls.__name__ or name in ("streams", "rows")
    return kind if single else ARRAYS.get(kind, kind).format(rows_of(cls))


def members(cls: Any) -> Iterator[str]:
    """Yield what stands in a class after its constructor."""
    if cls.__hash__ is None:
        yield "    __hash__: ClassVar[None]  # type: ignore[assignment]"
    for name, member in vars(cls).items():
        if inspect.isgetsetdescriptor(member):
            yield f"    @property\n    def {name}(self) -> {property_type(cls, name)}: ..."
        elif name in {*METHODS, "update", "process"}:
            yield f"    def {name}({parameters(cls, name)}) -> {result_type(cls, name)}: ..."


def settings_of(scene: Any) -> dict[str, Any]:
    """Return the settings of a scene."""
    return _core.Tracker(scene).settings


def settings_class(scene: str) -> str:
    """Return the name of the class of a scene's settings."""
    return f"_{scene.capitalize()}Settings"


def settings_type(name: str, settings: Iterable[str]) -> str:
    """Return the class of settings with these names."""
    fields = (f"    {field}: {SETTINGS.get(field, 'float')}" for field in settings)
    return "\n".join([f"class {name}(TypedDict, total=False):", *fields])


def constructors(cls: Any) -> Iterator[str]:
    """Yield the constructor of a class, or that of each scene."""
    if cls is not _core.Tracker:
        yield f"    def __init__({parameters(cls, '__init__')}) -> None: ..."
        return
    default = inspect.signature(cls).parameters["scene"].default
    for scene in sorted(_core.scenes, key=lambda scene: scene != default):
        kind = f"Literal[{scene!r}]" + (f" = {default!r}" if scene == default else "")
        yield f"    @overload\n    def __init__(self, scene: {kind}, **settings: Unpack[{settings_class(scene)}]) -> None: ..."


def stub() -> str:
    """Return the stub."""
    lines = [HEAD, f"_Scene: TypeAlias = Literal[{', '.join(repr(scene) for scene in _core.scenes)}]"]
    lines += [settings_type(settings_class(scene), settings_of(scene)) for scene in _core.scenes]
    lines += [settings_type("_AnySettings", {n: None for s in _core.scenes for n in settings_of(s)})]
    for cls in (value for value in vars(_core).values() if inspect.isclass(value)):
        lines += [f"class {cls.__name__}:", *constructors(cls), *members(cls)]
    return "\n".join(lines)


if __name__ == "__main__":
    print(stub())
