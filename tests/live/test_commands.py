"""The commands of a page: each is obeyed by a method, and no text of a message is too long or cannot be shown."""

import inspect
import json
from typing import Any

import pytest
from live_bench import SOURCE
from palpate.live.commands import COMMANDS, Workbench, parse
from palpate.live.feed import RefusedCommand
from palpate.live.files import RunFiles
from palpate.live.measurement import LiveMeasurement, opener
from palpate.live.open_page import Page

VALUES: dict[str, dict[str, Any]] = {
    "record": {"name": "run.csv"},
    "mark text": {"id": 1, "text": "here"},
    "note": {"text": "warm"},
    "device": {"capf": 1, "excitation": "B"},
    "plan": {"text": "gel", "wanted": 4, "unit": "kPa", "title": "gels", "operator": "A. B."},
    "read list": {"text": "gel", "unit": "kPa"},
    "specimen": {"name": "gel"},
    "assign": {"touch": 1, "name": "gel"},
    "discard": {"touch": 1},
    "keep": {"touch": 1},
    "name": {"touches": [1, 2], "text": "gel; 0.3"},
    "calibrating": {"on": True},
    "settings": {"unit": "kPa", "shore": True, "probe": "", "site": "", "operator": ""},
    "cut": {"from_s": 0.5, "to_s": 2},
    "view": {"id": 1, "from_s": 0.5, "to_s": 2, "rows": 20},
}
"""What the page sends with its commands; nothing with the rest."""


def test_each_command_is_obeyed_by_a_method_with_its_values() -> None:
    bench = Workbench(LiveMeasurement(opener(SOURCE, {}), RunFiles(), {}), SOURCE)
    for do, part in COMMANDS.items():
        values = VALUES.get(do, {})
        assert parse(json.dumps({"do": do, **values})) == (do, values)
        each: Any = Page(None, bench.measurement.levels) if part == "page" else bench._parts[part]  # type: ignore[arg-type]
        inspect.signature(getattr(each, do.replace(" ", "_"))).bind(**values)


@pytest.mark.parametrize(
    ("message", "part"),
    [
        ("[" * 40, "Expecting value"),
        (
            '{"do": "note", "text": "' + "x" * 4001 + '"}',
            "text: got 'xxx.* allowed: up to 4000 characters that",
        ),
        ('{"do": "note", "text": "a\\u0000"}', "allowed: up to 4000 characters that can be shown"),
        ('{"do": "format the disk"}', "do: got 'format the disk', allowed: tare, tare anyway, "),
    ],
)
def test_what_is_refused(message: str, part: str) -> None:
    with pytest.raises(ValueError, match=part):
        parse(message)
    assert parse('{"do": "plan", "text": " a\\t1\\n b"}') == ("plan", {"text": " a\t1\n b"})
    assert issubclass(RefusedCommand, ValueError)
