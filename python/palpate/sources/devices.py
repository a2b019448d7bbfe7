"""What is plugged in, under the names by which `palpate.open` takes it."""

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from palpate.errors import MissingExtra, SourceError


class Found(NamedTuple):
    """A source that could be opened, and what it is."""

    uri: str
    what: str


def devices() -> tuple[list[Found], list[str]]:
    """Look for devices; opens none.

    Returns
    -------
    list of Found, list of str
        The devices, and why some could not be looked for.
    """
    return _look_for(_boards, _iio, _i2c, _ports)


def boards() -> tuple[list[Found], list[str]]:
    """Look for an AD7746 alone, as `devices` does: the evaluation kit, and the kernel's driver."""
    return _look_for(_boards, _iio)


def _look_for(*looks: Callable[[], list[Found]]) -> tuple[list[Found], list[str]]:
    found, notes = [], []
    for look in looks:
        try:
            found += look()
        except (SourceError, MissingExtra) as error:
            notes.append(str(error))
    return found, notes


def _boards() -> list[Found]:
    from palpate.ad7746.evalkit.find import boards

    return [Found(f"usb:{board}", "AD7746 evaluation kit") for board in boards()]


def _iio() -> list[Found]:
    from palpate.sources import iio

    return [Found(f"iio:{path}", "AD7746 by the kernel's driver") for path in iio.devices()]


def _i2c() -> list[Found]:
    buses = sorted(Path("/dev").glob("i2c-*"))
    return [Found(f"i2c:{path}", "I2C bus; an AD7746 may be on it") for path in buses]


def _ports() -> list[Found]:
    try:
        from serial.tools.list_ports import comports
    except ImportError as error:
        raise MissingExtra("serial ports need pyserial: pip install 'palpate[serial]'") from error
    ports = [port for port in comports() if port.vid is not None]
    return [Found(f"serial:{port.device}", port.description or "serial port") for port in sorted(ports)]
