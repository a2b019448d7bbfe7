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
from palpate.kit.step import AcceptanceReport, ReportError, load, made, now


@pytest.fixture(scope="module")
def report() -> AcceptanceReport:
    board = Board("soft-exca")
    bench = board.open()
    steps = list(Acceptance(bench))
    return made(now(), "usb:?capf=0&firmware=/home/ann/Icv_usb.hex", bench.source.describe(), bench.dump, steps)


def test_what_was_written_is_read_back_without_the_users_path(report: AcceptanceReport, tmp_path: Path) -> None:
    path = tmp_path / "report.json"
    path.write_text(report.text())
    again = load(path)
    assert (again.text(), again.steps) == (report.text(), report.steps)
    assert len(bytes.fromhex(again.registers)) == 19
    assert "ann" not in report.text()
    assert report.source == "usb:?capf=0&firmware=..."


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda all_: all_ | {"schema": "palpate-kit-report-9"}, "no schema palpate-kit-report-1 in it"),
        (lambda all_: all_ | {"more": 1}, "'more'"),
        (lambda all_: all_ | {"steps": [{}]}, "not a report"),
        (lambda all_: all_ | {"steps": [all_["steps"][0] | {"verdict": "fine"}]}, "not a report"),
        (lambda all_: all_ | {"steps": [all_["steps"][0] | {"measured": "a\nb"}]}, "printable"),
        (lambda all_: all_ | {"stopped": "\x1b[2J"}, "printable"),
        (lambda all_: [], ""),
        (lambda all_: 10**5 * "[", ""),
    ],
)
def test_another_part_is_refused(report: AcceptanceReport, change: Any, said: str, tmp_path: Path) -> None:
    changed, path = change(json.loads(report.text())), tmp_path / "report.json"
    path.write_text(changed if isinstance(changed, str) else json.dumps(changed))
    with pytest.raises(ReportError, match="run palpate kit accept again") as raised:
        load(path)
    assert said in str(raised.value)


def test_changed_bytes_are_read_or_refused(report: AcceptanceReport, tmp_path: Path) -> None:
    random, data, path = random_of("kit report"), report.text().encode(), tmp_path / "report.json"
    refused, count = 0, draws(300)
    for _ in range(count):
        path.write_bytes(_changed(data, random))
        try:
            found = load(path)
        except PalpateError:
            refused += 1
            continue
        assert all(map(str.isprintable, found.lines()))
    assert refused > count / 3


def _changed(data: bytes, random: Random) -> bytes:
    at, count = random.randrange(len(data)), random.randrange(1, 20)
    return data[:at] + random.choice([b"", random.randbytes(count), data[at : at + count] * 2]) + data[at + count :]
