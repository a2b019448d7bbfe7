"""The pages of options, settings and flags: name, default, allowed values and meaning of each."""

import dataclasses
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pkgutil import resolve_name
from typing import Any

import palpate
from palpate._core import scenes
from palpate.flags import Flag
from palpate.simulation.board_input import board_scenarios
from palpate.sources.board import I2cOptions, UsbOptions
from palpate.sources.demo import DemoOptions
from palpate.sources.iio import IioOptions
from palpate.sources.lsl import LslOptions
from palpate.sources.options import Options
from palpate.sources.playback import FileOptions
from palpate.sources.registry import schemes
from palpate.sources.serial import SerialOptions
from palpate.sources.sim import DEFAULT, SimOptions

from docs.generator.attributes import attribute_docstrings
from docs.generator.docstrings import Entry, parse
from docs.generator.markdown import block, code, page, prose, table


@dataclass(frozen=True)
class Scheme:
    """One kind of source: its address, what it reads, an example, and the class of its options."""

    address: str
    reads: str
    example: str
    options: type[Options]


SCHEMES: Mapping[str, Scheme] = {
    "usb": Scheme(
        "usb: or usb:BUS/ADDRESS", "The evaluation kit on USB.", "usb:?capf=4", UsbOptions
    ),
    "sim": Scheme(
        "sim:SCENARIO",
        "The same driver with a simulated evaluation kit and a simulated probe.",
        "sim:tremor?seed=1&speed=1",
        SimOptions,
    ),
    "demo": Scheme(
        "demo:",
        "The same simulated probe, pressed by hand on the page of `palpate live demo:`.",
        "demo:?seed=1",
        DemoOptions,
    ),
    "i2c": Scheme(
        "i2c:/dev/i2c-N", "The chip on a Linux I2C bus.", "i2c:/dev/i2c-1?capf=4", I2cOptions
    ),
    "iio": Scheme(
        "iio: or iio:PATH", "The chip with the driver of the Linux kernel.", "iio:", IioOptions
    ),
    "serial": Scheme(
        "serial:PORT",
        "Lines of text from a serial port.",
        "serial:/dev/ttyACM0?baud=115200",
        SerialOptions,
    ),
    "lsl": Scheme(
        "lsl:NAME", "A stream of Lab Streaming Layer.", "lsl:lab?hard=C1&soft=C2", LslOptions
    ),
    "": Scheme(
        "a path",
        "A recording, or a table of another program, as if it was measured now.",
        "run.csv?speed=1",
        FileOptions,
    ),
}
"""The kinds of sources; "" is a path."""

_SOURCES = """\
A source is the first argument of `palpate record`, `palpate live` and `palpate.open`:
`SCHEME:ADDRESS?NAME=VALUE&NAME=VALUE`. In Python the options can also be keywords:
`palpate.open("sim:tremor", seed=1)`. In a shell write a source with `?` or `&` in quotes. Some
options take objects that only Python code has; they have no default here."""
_SETTINGS = """\
Settings of the scenes are keywords of `palpate.Tracker`, `palpate.touches` and `palpate.Stream`,
and `--set NAME=VALUE` on the command line. [Choosing a scene](../scenes.md) says which scene is
for what."""
_FLAGS = """\
A flag is a warning about the result of a touch. `palpate replay`, the page and `palpate.advice`
print a sentence for each flag: the likely cause, its size, and the remedy. A flag can leave a
touch out of means and fits; one whose error is less than a third of the uncertainty of the ratio
does not."""
_MAP = "The columns of a table: names, or positions counted from 1."
_ESTIMATORS = (
    palpate.HandoverRls,
    palpate.AdaptiveRls,
    palpate.Rls,
    palpate.VectorRls,
)
_AS_IN = re.compile(r"^As in `(\w+)`")


def sources_page() -> str:
    """Return the page of the sources."""
    if set(schemes()) - set(SCHEMES):
        raise ValueError(f"schemes without a description: {set(schemes()) - set(SCHEMES)}")
    parts = ["# Sources and their options", _SOURCES]
    for name, scheme in SCHEMES.items():
        title = code(f"{name}:") if name else "A path"
        parts += [f"## {title}", scheme.reads, block("text", scheme.address)]
        parts.append(f"Example: {code(scheme.example)}")
        parts.append(options_table(scheme.options))
        if name == "sim":
            names = ", ".join(code(each) for each in board_scenarios())
            parts.append(f"Scenarios, {code(DEFAULT)} by default: {names}.")
    return page(parts)


def options_table(owner: type[Options]) -> str:
    """Return the table of the options of one kind of source."""
    texts = attribute_docstrings(owner)
    rows = []
    if owner is FileOptions:
        rows.append(("`map`", "", "hard=COL,soft=COL,time=COL", _MAP))
    for field in dataclasses.fields(owner):
        text = texts.get(field.name)
        if text is None:
            continue
        stated = re.search(r" ?Default: ([^.]*)\.$", text)
        default = default_value(field.default)
        if stated:
            default = prose(stated[1])
            text = text[: stated.start()]
        rows.append((code(field.name), default, allowed(field), prose(text)))
    return table(("option", "default", "allowed", "meaning"), rows)


def default_value(value: Any) -> str:
    """Return a default as it is written in the name of a source."""
    if value is None or value in ("", ()):
        return ""
    if isinstance(value, bool):
        return code("yes" if value else "no")
    if isinstance(value, tuple):
        return code(str(value[0]))
    if isinstance(value, float):
        return code(f"{value:g}")
    return code(str(value))


def allowed(field: "dataclasses.Field[Any]") -> str:
    """Return what an option allows, by the message of its check."""
    check: Callable[[str, Any], Any] | None = field.metadata.get("check")
    if check is None:
        return ""
    try:
        check(field.name, "?")
    except ValueError as error:
        _, _, text = str(error).partition(", allowed: ")
        text = text.replace("1, 0, true, false, yes, no", "yes, no")
        for reason in ("; did you mean", " ("):  # about the value that was tried
            text = text.partition(reason)[0]
        return prose(text)
    return "text"


def settings_page() -> str:
    """Return the page of the settings."""
    parts = ["# Settings of scenes and estimators", _SETTINGS, "## Scenes", scene_table()]
    for estimator in _ESTIMATORS:
        parts.append(f"## {code(f'palpate.{estimator.__name__}')}")
        entries = estimator_entries(estimator)
        rows = []
        for name, value in made(estimator).settings.items():
            shown = "required" if name == "size" else value
            rows.append(setting_row(name, shown, entries[name]))
        parts.append(table(("setting", "default", "type, unit, range", "meaning"), rows))
    return page(parts)


def scene_table() -> str:
    """Return the table of the settings of all scenes, with the default in each."""
    entries: dict[str, Entry] = {}
    for estimator in (palpate.HandoverRls, palpate.AdaptiveRls, palpate.Rls):
        entries |= estimator_entries(estimator)
    entries |= tracker_entries()
    defaults = {scene: tracker_of(scene).settings for scene in scenes}
    names: dict[str, None] = {}
    for scene in ("handheld", *scenes):
        names |= dict.fromkeys(defaults[scene])
    rows = []
    for name in names:
        entry = entries[name]
        row = [code(name)]
        for scene in scenes:
            row.append(shown_setting(defaults[scene].get(name, "")))
        text = prose(" ".join(entry.text.split()))
        rows.append([*row, f"{text} ({prose(entry.kind)})"])
    return table(("setting", *scenes, "meaning (type, unit, range)"), rows)


def tracker_of(scene: Any) -> palpate.Tracker:
    """Return a tracker with the default settings of a scene."""
    return palpate.Tracker(scene)


def made(estimator: Any) -> Any:
    """Return an estimator with its default settings."""
    if estimator is palpate.VectorRls:
        return estimator(1)
    return estimator()


def setting_row(name: str, value: Any, entry: Entry) -> tuple[str, str, str, str]:
    """Return the cells of one setting."""
    text = prose(" ".join(entry.text.split()))
    return code(name), shown_setting(value), prose(entry.kind), text


def shown_setting(value: Any) -> str:
    """Return a value of a setting."""
    if isinstance(value, float):
        return re.sub(r"e\+?0*", "e", f"{value:g}")
    return str(value)


def tracker_entries() -> dict[str, Entry]:
    """Return the entry of each setting in the docstring of `Tracker`."""
    return by_name(parse(palpate.Tracker.__doc__ or "").entries("Other Parameters"))


def estimator_entries(estimator: Any) -> dict[str, Entry]:
    """Return the entry of each setting of an estimator; "As in X" is replaced by the one of X."""
    entries = by_name(parse(estimator.__doc__ or "").entries("Parameters"))
    for name, entry in entries.items():
        other = _AS_IN.match(entry.text)
        if other:
            entries[name] = estimator_entries(resolve_name(f"palpate.{other[1]}"))[name]
    return entries


def by_name(entries: list[Entry]) -> dict[str, Entry]:
    """Return entries by their names; an entry may have several names."""
    return {name: entry for entry in entries for name in entry.name.split(", ")}


def flags_page() -> str:
    """Return the page of the flags."""
    meanings = by_name(parse(Flag.__doc__ or "").entries("Attributes"))
    rows = []
    for flag in Flag:
        text = " ".join(meanings[flag.name].text.split())
        rows.append((code(flag.value), prose(text), prose(flag.meaning.hint)))
    parts = ["# Flags", _FLAGS, table(("flag", "meaning", "remedy in short"), rows)]
    parts.append("`palpate.flags.Flag` has their names in Python: [API](api_touches.md).")
    return page(parts)
