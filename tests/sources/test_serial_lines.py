"""Lines as instruments print them: each is read right, or refused with a reason."""

import re
from typing import Any

import pytest
from project import ROOT
from serial_lines import Sent

PAGE = (ROOT / "docs" / "serial.md").read_text(encoding="utf-8")


def documented() -> list[Any]:
    """Return line, option and result of each row of the table on the page."""
    table = PAGE[PAGE.index("## Which lines are read") : PAGE.index("A test sends each")]
    rows = [re.split(r"(?<!\\)\|", row)[1:-1] for row in table.splitlines() if row.startswith("| `")]
    plain = [[cell.replace("\\|", "|").strip() for cell in row] for row in rows]
    return [pytest.param(line[1:-1], option, result, id=line[:24]) for line, option, result in plain]


@pytest.mark.parametrize(("line", "option", "result"), documented())
def test_the_table_of_the_page(line: str, option: str, result: str) -> None:
    name, _, value = option.partition("=")
    sent = Sent([line] * 2, **({name: value} if option else {}))
    if result.startswith("refused: "):
        assert sent.samples == sent.said == []
        assert f"refused: {sent.refused}" == result
    else:
        assert sent.said == [f"{line.strip()!r} -> {result}"]
        assert bool(sent.samples) == (name != "pattern")


def test_the_table_is_read() -> None:
    assert len(documented()) >= 30
