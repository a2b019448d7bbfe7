"""`palpate devices --blink`: which board is which."""

from pathlib import Path

import pytest
from click.testing import CliRunner, Result
from palpate.ad7746.clock import VirtualClock
from palpate.ad7746.evalkit import board, find
from palpate.ad7746.evalkit.board import EvalKit
from palpate.ad7746.twin.chip import ChipTwin
from palpate.ad7746.twin.kit import KitTwin
from palpate.ad7746.twin.usb import TwinBackend
from palpate.cli import main


def blink(*arguments: str) -> Result:
    return CliRunner().invoke(main, ["devices", "--blink", *arguments])


@pytest.fixture
def backend(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> TwinBackend:
    """Two boards; usb:1/2 and usb:1/3."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("PALPATE_FIRMWARE", raising=False)
    clock = VirtualClock()
    backend = TwinBackend(clock)
    for number in (1, 2):
        backend.plug(KitTwin(ChipTwin(lambda pin, begin_s, end_s: 1.0), clock), number)
    monkeypatch.setattr(find, "system_backend", lambda: backend)
    monkeypatch.setattr(board, "RealClock", lambda: clock)
    return backend


def test_each_board_in_turn(backend: TwinBackend) -> None:
    result = blink()
    assert result.exit_code == 0
    assert result.stdout == "usb:1/2: the red LED blinks for 3 s\nusb:1/3: the red LED blinks for 3 s\n"
    assert backend.opened == 0


def test_the_board_that_is_named(backend: TwinBackend) -> None:
    assert blink("usb:1/3").stdout == "usb:1/3: the red LED blinks for 3 s\n"
    result = blink("usb:1/9")
    assert result.exit_code == 3
    assert "--blink: got usb:1/9, connected: usb:1/2, usb:1/3" in result.stderr


def test_a_board_in_use_is_left_alone(backend: TwinBackend) -> None:
    measuring = EvalKit(1, 2, backend=backend)
    result = blink()
    assert result.exit_code == 3
    assert result.stdout == "usb:1/3: the red LED blinks for 3 s\n"
    assert "usb:1/2: the board at 1/2: another program uses the board" in result.stderr
    measuring.close()
