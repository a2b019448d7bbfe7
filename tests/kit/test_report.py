"""The report: what was written is read back; everything else is refused."""

import json
from pathlib import Path
from random import Random
from typing import Any

import pytest
from effort import draws, random_of
from kit_acceptance import Board
from palpate.errors import PalpateError
from palpate.kit.acceptance import Acceptance
from palpate.kit.report import LARGEST, MOST_STEPS, Report, ReportError, load, made, now


@pytest.fixture(scope="module")
def report() -> Report:
    board = Board("soft-exca")
    bench = board.open()
    steps = list(Acceptance(bench))
    return made(now(), "usb:?capf=0&firmware=/home/ann/Icv_usb.hex", bench.source.describe(), bench.dump, steps)


def test_what_was_written_is_read_back(report: Report, tmp_path: Path) -> None:
    path = tmp_path / "report.json"
    path.write_text(report.text())
    again = load(path)
    assert again.text() == report.text()
    assert again.steps == report.steps
    assert len(bytes.fromhex(again.registers)) == 19


def test_no_path_of_the_user_is_in_it(report: Report) -> None:
    assert "ann" not in report.text()
    assert report.source == "usb:?capf=0&firmware=..."


def _deep(levels: int) -> dict[str, Any]:
    return {"in": _deep(levels - 1)} if levels else {}


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"schema": "palpate-kit-report-9"}, "no schema palpate-kit-report-1 in it"),
        ({"more": 1}, "'more' is unknown"),
        ({"steps": {}}, "steps: got {}"),
        ({"steps": [1]}, "step: got 1, allowed: names and values"),
        ({"steps": [{}]}, "is missing"),
        ({"started": "\x1b[2J"}, "not printable"),
        ({"stopped": "x" * 3000}, "too long"),
        ({"versions": {"palpate": [1]}}, "versions: got"),
        ({"device": _deep(40)}, "device: got"),
        ({"source": None}, "source: got None"),
    ],
)
def test_another_part_is_refused(report: Report, change: dict[str, Any], said: str, tmp_path: Path) -> None:
    path = tmp_path / "report.json"
    path.write_text(json.dumps({**json.loads(report.text()), **change}))
    with pytest.raises(ReportError) as raised:
        load(path)
    assert said in str(raised.value)


@pytest.mark.parametrize(
    ("part", "value"),
    [("verdict", "fine"), ("measured", "a\nb"), ("measured", 1), ("do", "text"), ("do", [1]), ("values", {"a": {}})],
)
def test_another_step_is_refused(report: Report, part: str, value: Any, tmp_path: Path) -> None:
    document = json.loads(report.text())
    document["steps"][3][part] = value
    path = tmp_path / "report.json"
    path.write_text(json.dumps(document))
    with pytest.raises(ReportError, match=part):
        load(path)


@pytest.mark.parametrize("data", [b"", b"[]", b"\xff\xfe", b"[" * 100_000, b'{"schema": NaN}', b"1" * 5000])
def test_what_is_not_json_is_refused(data: bytes, tmp_path: Path) -> None:
    path = tmp_path / "report.json"
    path.write_bytes(data)
    with pytest.raises(ReportError):
        load(path)


def test_too_much_is_refused(report: Report, tmp_path: Path) -> None:
    path = tmp_path / "report.json"
    path.write_text(report.text() + " " * LARGEST)
    with pytest.raises(OSError, match="larger than"):
        load(path)
    document = json.loads(report.text())
    path.write_text(json.dumps({**document, "steps": document["steps"][:1] * (MOST_STEPS + 1)}))
    with pytest.raises(ReportError, match="200 at most"):
        load(path)


def test_changed_bytes_are_read_or_refused(report: Report, tmp_path: Path) -> None:
    random, data, path = random_of("kit report"), report.text().encode(), tmp_path / "report.json"
    refused, count = 0, draws(300)
    for _ in range(count):
        path.write_bytes(_changed(data, random))
        try:
            found = load(path)
        except PalpateError:
            refused += 1
            continue
        assert all(line.isprintable() for step in found.steps for line in step.lines())
    assert refused > count / 3


def _changed(data: bytes, random: Random) -> bytes:
    at, count = random.randrange(len(data)), random.randrange(1, 20)
    return data[:at] + random.choice([b"", random.randbytes(count), data[at : at + count] * 2]) + data[at + count :]
