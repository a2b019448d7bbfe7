"""What the core in a browser does not read is refused in words, and what is not as it was written is told."""

import json
from typing import Any

import pytest
from palpate.recording.rows import HEADER
from project import ROOT
from try_core import Node

OWN = ROOT / "tests" / "data" / "four-specimens.csv"


def test_what_was_cut_off_or_changed_is_told(node: Node) -> None:
    data, sidecar = OWN.read_bytes(), OWN.with_suffix(".json").read_bytes()

    def told(rows: bytes, beside: bytes = sidecar) -> list[str]:
        found = node.open(("run.csv", rows), ("run.json", beside))
        messages: list[str] = found["state"]["messages"]
        return messages

    assert told(data) == []
    cut = told(data[:-10])
    assert "1410 rows in the file, but 1411 were written" in cut[0]
    assert "bytes after the last complete row, left out" in cut[1]
    assert "300 bytes after the last complete row" in told(data + b"\0" * 300)[0]
    assert "the rows were changed" in told(data.replace(b"0.6200503", b"0.6200504"))[0]
    assert "the sidecar was changed" in told(data, sidecar.replace(b"four_specimens.py", b"four_specimens_py"))[0]
    assert told(data.replace(b"\n", b"\r\n")) == []


@pytest.mark.parametrize(
    ("rows", "told"),
    [
        (
            b"1,0.026,0.039,8388608,8388608,0.0,0.0,-1,0\n???\n",
            "run.csv: line 3: got '???', allowed here: a row as palpate writes it",
        ),
        (b"1, 0.026,0.039,8388608,8388608,0.0,0.0,-1,0\n", "line 2: got '1, 0.026"),
        (b"1,0.026,0.039,8388608,8388608,0.0,0.0,-1,9\n", "line 2"),
        (b"1,0.026,0.039,8388608,8388608,0.0,0.0,-1\n", "line 2"),
        (b"\n", "line 2: got ''"),
        (b"9" * 5000, "line 2"),
        (b"9" * 50_000 + b"\n", "line 2"),
        (b"1,0.026,0.039,8388608,8388608,0.0,0.0,-1,0\n" * 2000 + b"?\n", "line 2002: got '?'"),
    ],
)
def test_a_row_that_is_not_plain_is_refused_with_its_line(node: Node, rows: bytes, told: str) -> None:
    answer = node.open(("run.csv", HEADER.encode() + rows))
    assert told in answer["refused"]
    assert "palpate live run.csv" in answer["refused"]


@pytest.mark.parametrize(
    ("files", "told"),
    [
        ([("a.xlsx", b"PK")], "got a.xlsx, allowed: a recording of palpate, NAME.csv"),
        ([], "got no file"),
        ([("a.csv", b"x"), ("b.csv", b"x")], "got 2 recordings (a.csv, b.csv)"),
        ([("a.csv", b"time,C1,C2\n0,1,2\n")], "a.csv: its first line is 'time,C1,C2', allowed here: seq,t_hard_s"),
        ([("a.csv", b"")], "a.csv: is empty"),
        ([("a.csv", HEADER.encode()), ("a.json", b"{")], "a.json: not JSON"),
        ([("a.csv", HEADER.encode()), ("a.json", b'{"schema": "x"}')], "schema: got 'x', allowed: palpate-recording-1"),
    ],
)
def test_files_that_are_none_are_refused_in_words(node: Node, files: list[tuple[str, bytes]], told: str) -> None:
    assert told in node.open(*files)["refused"]


@pytest.mark.parametrize(
    ("parts", "told"),
    [
        (
            {"settings": {"scene": "paper"}},
            "scene: got 'paper', allowed here: handheld, sliding; 'palpate live run.csv' reads it",
        ),
        ({"settings": {"threshold": 3.0}}, "threshold: got 3, allowed here: 10, as the scene has it"),
        ({"settings": {"seconds": 2.0, "samples": 5}}, "a touch has one length"),
        ({"settings": {"release": 1.5}}, "release: got 1.5, allowed: 0 < release < 1"),
        ({"settings": {"seconds": "5"}}, "seconds: got '5'"),
        ({"settings": {"release": "0.4"}}, "release: got '0.4'"),
        ({"settings": {"host_stamps": "no"}}, "host_stamps: got 'no', allowed: true or false"),
        ({"settings": {"scene": "constructor"}}, "scene: got 'constructor'"),
        ({"settings": {"toString": 1}}, "toString: got 1"),
        ({"device": {"full_scale_pF": "4"}}, "full_scale_pF: got '4', allowed: above 0"),
        ({"device": {"codes": {"zero": 0, "per_pF": "5", "largest": 9}}}, "codes: got"),
        ({"end": None}, "end: got null, allowed: names and values"),
        ({"device": {"full_scale_pF": -1}}, "full_scale_pF: got -1, allowed: above 0"),
        ({"device": {"codes": {"zero": 0}}}, "codes: got"),
        ({"marks": [{"seq": 2**60, "tare": True}]}, "allowed here: below 2**53"),
        ({"marks": {}}, "marks: allowed: a list"),
        ({"device": []}, "device: got []"),
    ],
)
def test_what_this_page_does_not_have_is_refused(node: Node, parts: dict[str, Any], told: str) -> None:
    document = {"schema": "palpate-recording-2", "device": {}, "settings": {}, "notes": [], "marks": []} | parts
    answer = node.open(("run.csv", HEADER.encode()), ("run.json", json.dumps(document).encode()))
    assert told in answer["refused"]


def test_an_empty_recording_says_so(node: Node) -> None:
    found = node.open(("run.csv", HEADER.encode()))
    assert "no rows" in found["state"]["messages"]
    assert found["blocks"][0]["end"] == 0


def test_a_time_that_no_clock_shows_is_none(node: Node) -> None:
    document = {
        "schema": "palpate-recording-2",
        "device": {},
        "settings": {},
        "notes": [],
        "marks": [{"t_s": 1, "text": "m" * 999}],
    }
    row = b"1,0.026,0.039,8388608,8388608,0.0,0.0,-1,0\n"
    for zero, utc in (("1e400", None), ("true", None), ("1700000000000000000", "2023-11-14T22:13:20.026Z")):
        text = json.dumps(document).replace('"device"', f'"clock": {{"zero_utc_ns": {zero}}}, "device"')
        found = node.open(("run.csv", HEADER.encode() + row), ("run.json", text.encode()))
        assert found["hello"]["utc"] == utc
    assert found["events"]["marks"][0]["text"].endswith("mmm... (999 characters)")
