"""The commands of a page: each message is one of the table, checked, or refused with what is allowed."""

import json
from typing import Any

import pytest
from live_bench import SOURCE
from palpate.live.commands import COMMANDS, LARGEST_S, Workbench, parse
from palpate.live.feed import RefusedCommand
from palpate.live.files import RunFiles
from palpate.live.hub import Page
from palpate.live.measurement import LiveMeasurement, opener

VALUES = {"rows": 20, "wanted": 4, "capf": 1, "on": True, "from_s": 0.5, "to_s": 2, "id": 0, "touch": 0,
          "touches": [1, 2], "unit": "kPa", "shore": True}  # fmt: skip


def test_each_command_is_parsed_and_obeyed_by_a_method_with_its_values() -> None:
    bench = Workbench(LiveMeasurement(opener(SOURCE, {}), RunFiles(), {}), SOURCE)
    for do, order in COMMANDS.items():
        whole = {name.rstrip("?"): VALUES.get(name.rstrip("?"), "a") for name in order.values}
        needed = {name: value for name, value in whole.items() if name in order.values}
        for given_ in (whole, needed):
            assert parse(json.dumps({"do": do, **given_})) == (do, given_)
        for name in needed:
            with pytest.raises(RefusedCommand, match=f"{name}: got None, allowed: "):
                parse(json.dumps({"do": do, **needed, name: None}))
        part, _, method = order.obeys.partition(".")
        obeys: Any = Page if part == "page" else bench._parts[part]
        assert callable(getattr(obeys, method))


@pytest.mark.parametrize(
    ("message", "part"),
    [
        ("[" * 4000, "JSON"),
        ("9", "an object"),
        ('{"do": "note", "text": "' + "x" * 201 + '"}', "1 to 200 printable characters"),
        ('{"do": "note", "text": "a\\u0000"}', "1 to 200 printable characters"),
        ('{"do": "plan", "wanted": 100, "text": ""}', "a whole number from 1 to 99"),
        ('{"do": "view", "id": 1, "from_s": 1e13, "to_s": 1, "rows": 16}', "from_s: got 10000000000000.0"),
        ('{"do": "view", "id": 1, "from_s": 1, "to_s": 1, "rows": 15}', "from 16 to 8192"),
        ('{"do": "name", "touches": [1, true], "text": "gel"}', "touches: got .* allowed: a list of numbers"),
        ('{"do": "tare", "do2": 1}', "no further names for tare"),
    ],
)
def test_limits_of_a_message(message: str, part: str) -> None:
    assert LARGEST_S == 1e12
    with pytest.raises(RefusedCommand, match=part):
        parse(message)
