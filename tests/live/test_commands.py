"""The commands of a page: each is decoded with its values, and run; what does not fit is refused with what is allowed."""

import json
from pathlib import Path
from typing import Any

import msgspec
import pytest
from live_bench import OWN_FILE, SOURCE, begun, client
from palpate.live.commands import FileWorkbench, LiveCommand, LiveWorkbench
from palpate.live.file_review import RecordedMeasurement
from palpate.live.measurement import LiveMeasurement, opener
from palpate.live.page_commands import (
    COMMANDS,
    CutCommand,
    HandCommand,
    NoteCommand,
    PlanCommand,
    decode,
)
from palpate.live.protocol import RefusedCommand
from palpate.live.run_files import RunFiles

VALUES: dict[str, dict[str, Any]] = {
    "record": {"name": "run.csv"},
    "mark text": {"id": 1, "text": "here"},
    "note": {"text": "warm"},
    "device": {"capf": 1, "excitation": "B"},
    "plan": {"text": "gel", "wanted": 4, "unit": "kPa", "title": "gels", "operator": "A. B."},
    "read list": {"text": "gel", "unit": "kPa"},
    "specimen": {"name": "gel"},
    "assign": {"touch": 1, "name": "gel"},
    "press": {"specimen": "40 A"},
    "discard": {"touch": 1},
    "keep": {"touch": 1},
    "open": {"what": "demo"},
    "name": {"touches": [1, 2], "text": "gel; 0.3"},
    "calibrating": {"on": True},
    "settings": {"unit": "kPa", "shore": True, "probe": "", "site": "", "operator": ""},
    "cut": {"from_s": 0.5, "to_s": 2},
    "view": {"id": 1, "from_s": 0.5, "to_s": 2, "rows": 20},
}
"""What the page sends with its commands; nothing with the rest."""


@pytest.mark.parametrize("do", COMMANDS)
def test_each_command_is_decoded_with_its_values(do: str) -> None:
    values = VALUES.get(do, {})
    command = decode(json.dumps({"do": do, **values}))
    assert isinstance(command, COMMANDS[do])
    assert msgspec.structs.asdict(command) == values
    assert command.do == do


def test_a_recording_refuses_what_needs_a_measurement(tmp_path: Path) -> None:
    bench = FileWorkbench(RecordedMeasurement(str(OWN_FILE), {}, {}, folder=tmp_path), "file")
    refused = []
    for do in COMMANDS:
        command = decode(json.dumps({"do": do, **VALUES.get(do, {})}))
        if isinstance(command, HandCommand):
            with pytest.raises(RefusedCommand, match=f"{do}: got it without a simulation, allowed"):
                bench.run(command)
        if isinstance(command, LiveCommand):
            with pytest.raises(RefusedCommand, match=f"{do}: this is a recording, nothing is"):
                bench.run(command)
            refused.append(do)
    assert len(refused) == 13
    live = LiveWorkbench(LiveMeasurement(opener(SOURCE, {}), RunFiles(), {}), SOURCE)
    with pytest.raises(RefusedCommand, match="cut: got it in a measurement, allowed: in a rec"):
        live.run(CutCommand(0.5, 2.0))


@pytest.mark.parametrize(
    ("message", "text"),
    [
        ("[" * 40, r"message: got '\[\[.* allowed: a command as a JSON object"),
        ('{"do": "keep", "touch": ' + "[" * 9000, "message: got .* allowed: a command as a JSON"),
        ('"keep"', "message: got '\"keep\"', allowed: a command as a JSON object"),
        ('{"do": "keep"}', "keep: got no touch, allowed: an integer above 0"),
        ('{"do": "keep", "touch": 0}', "touch: got 0, allowed: an integer above 0"),
        ('{"do": "keep", "touch": "1"}', "touch: got '1', allowed: an integer above 0"),
        ('{"do": "keep", "touch": 1, "why": 2}', "keep: got 'why', allowed: touch"),
        ('{"do": "tare", "force": true}', "tare: got 'force', allowed: no value"),
        ('{"do": "record", "name": 3}', "name: got 3, allowed: up to 4000 characters"),
        ('{"do": "plan", "text": "", "wanted": 100}', "wanted: got 100, allowed: an integer from"),
        ('{"do": "cut", "from_s": null, "to_s": 1}', "from_s: got None, allowed: seconds, a"),
        ('{"do": "name", "touches": [0], "text": ""}', r"touches: got \[0\], allowed: numbers of"),
        (
            '{"do": "note", "text": "' + "x" * 4001 + '"}',
            "text: got 'xxx.* allowed: up to 4000 characters that",
        ),
        ('{"do": "note", "text": "a\\u0000"}', "allowed: up to 4000 characters that can be shown"),
        ('{"do": "format the disk"}', "do: got 'format the disk', allowed: tare, tare anyway, "),
        ('{"touch": 1}', "do: got None, allowed: tare, tare anyway, "),
    ],
)
def test_what_is_refused(message: str, text: str) -> None:
    with pytest.raises(RefusedCommand, match=text):
        decode(message)


def test_tabs_and_lines_can_be_shown() -> None:
    plan = decode('{"do": "plan", "text": " a\\t1\\n b", "wanted": 4}')
    assert plan == PlanCommand(" a\t1\n b", 4)


def test_a_command_without_its_values_is_answered_and_the_socket_stays_open(tmp_path: Path) -> None:
    bench = begun(SOURCE, tmp_path, record=False)
    answers: list[dict[str, Any]] = []
    with client(bench) as page, page.websocket_connect("/ws") as socket:
        socket.send_text('{"do": "keep"}')
        socket.send_text('{"do": "note", "text": "warm"}')
        while len(answers) < 2:
            message = socket.receive()
            told = json.loads(message.get("text") or "{}")
            if told.get("type") in ("refused", "done"):
                answers.append(told)
    bench.measurement.close()
    assert answers == [
        {"type": "refused", "message": "keep: got no touch, allowed: an integer above 0"},
        {"type": "done", "do": "note", "message": "Noted: warm"},
    ]
    assert decode('{"do": "note", "text": "warm"}') == NoteCommand("warm")
