"""The options of `lsl:`."""

from collections.abc import Mapping
from typing import Any

from palpate.sources.lsl.channels import Asked
from palpate.sources.lsl.finding import PROPERTIES, WAIT_S, only
from palpate.sources.lsl.source import LslSource
from palpate.sources.options import Check, anything, checked, choice, number, text
from palpate.tables.asked import parsed_map
from palpate.tables.units import PICOFARADS

_WHICH: dict[str, Check] = {"type": text, "source_id": text, "host": text}
_CHANNELS: dict[str, Check] = {"hard": text, "soft": text, "unit": choice(*PICOFARADS)}
_MAP: dict[str, Check] = {"map": lambda _, value: parsed_map(str(value)), "columns": anything}
_STREAM: dict[str, Check] = {"stamps": choice("converter", "host"), "replug": number(0, 86400)}


def open_lsl(address: str, options: Mapping[str, Any]) -> LslSource:
    """Return the source of `lsl:NAME`: of the stream with this name, and of those with it the one of the options."""
    given = checked("lsl", options, {**_WHICH, **_CHANNELS, **_MAP, **_STREAM, "wait": number(0, 86400)})
    for columns in (given.pop(name) for name in _MAP if name in given):  # as for a table
        given |= checked("lsl: map", columns, {"hard": text, "soft": text})
    wanted = {"name": address} if address else {}
    wanted |= {PROPERTIES[name]: given[name] for name in _WHICH if name in given}
    if not wanted:
        raise ValueError("lsl: got no stream, allowed: lsl:NAME or lsl:?type=TYPE; see `palpate devices --lsl`")
    info = only(wanted, given.get("wait", WAIT_S))
    return LslSource(
        info,
        Asked(**{name: given[name] for name in _CHANNELS if name in given}),
        **{name: given[name] for name in _STREAM if name in given},
    )
