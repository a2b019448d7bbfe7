"""pylsl is imported only when it is used; and the message without it."""

import subprocess
import sys
import time
from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import pytest
from click.testing import CliRunner
from palpate import MissingExtra
from palpate.cli import main
from palpate.sources.lsl import ahead_ns, library


@pytest.fixture
def fresh() -> Iterator[None]:
    library.cache_clear()
    yield
    library.cache_clear()


def test_devices_without_pylsl(fresh: None, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pylsl", None)
    line = "not searched: pylsl is not installed; type: pip install 'palpate[lsl]'"
    assert line in CliRunner().invoke(main, ["devices", "--lsl"]).stderr
    assert "pylsl" not in CliRunner().invoke(main, ["devices"]).stderr


def test_without_liblsl(fresh: None, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object) -> None:
        raise RuntimeError("LSL binary library file was not found. Please ...\nmore")

    monkeypatch.setattr("palpate.sources.lsl.need", fail)
    with pytest.raises(MissingExtra, match=r"pylsl finds no liblsl \(LSL binary library file was not found") as raised:
        library()
    assert "pip install --force-reinstall 'palpate[lsl]'" in str(raised.value)


def test_a_clock_that_is_another_one() -> None:
    """As on Windows, where Python before 3.13 counts ticks: the difference is measured; on Linux it is exactly 0."""
    other: Any = SimpleNamespace(local_clock=lambda: time.monotonic() + 5.0)
    assert ahead_ns(other) == pytest.approx(5 * 10**9, abs=10**7)
    same: Any = SimpleNamespace(local_clock=time.monotonic)
    assert ahead_ns(same) == 0


def test_it_is_imported_only_when_it_is_used() -> None:
    code = "import sys, palpate.lsl, palpate.sources.lsl, palpate.cli.record; sys.exit('pylsl' in sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True)
