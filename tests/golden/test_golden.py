"""What palpate prints, writes and sends is what it was: tests/tools/freeze.py writes tests/golden anew."""

import pytest
from freeze import FROZEN, GOLDEN, frozen


@pytest.mark.parametrize("name", FROZEN)
def test_it_is_as_it_was(name: str) -> None:
    assert frozen(name) == (GOLDEN / f"{name}.txt").read_text(encoding="utf-8")
