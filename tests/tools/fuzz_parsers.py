"""Fuzz targets of all parsers: functions of bytes that may raise only the documented errors.

Accepted input must give a valid result. `python tests/tools/fuzz_parsers.py TARGET FOLDER... [libFuzzer's options]`
searches with atheris for bytes that break a target; `tests/fuzz/test_corpus.py` runs the corpus and earlier findings.
"""

import contextlib
import json
import math
import os
import sys
import tempfile
import warnings
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any
from unittest.mock import patch

import scipy.optimize
import scipy.special  # noqa: F401

FOLDER = Path(
    tempfile.mkdtemp(dir="/dev/shm" if os.access("/dev/shm", os.W_OK) else None, prefix="palpate-")
)


imports: contextlib.AbstractContextManager[Any] = contextlib.nullcontext()
if __name__ == "__main__":
    import atheris

    imports = atheris.instrument_imports(include=["palpate"])

with imports:
    import click
    import palpate
    from palpate.ad7746.bus import VirtualClock
    from palpate.ad7746.evalkit.usb_bus import RAM_BYTES, read_hex
    from palpate.ad7746.simulator.usb_backend import SimulatedUsb
    from palpate.calibration.specimen_files import read_moduli, specimen_in
    from palpate.cli import config
    from palpate.cli.main import COMMANDS
    from palpate.errors import CalibrationError, ProtocolError, RecordingError, SourceError
    from palpate.live.access import Gatekeeper, new_token
    from palpate.recording import sidecar
    from palpate.recording.reading import recorded
    from palpate.recording.rows import HEADER, format_rows, parse_rows, unreadable
    from palpate.recording.verification import check
    from palpate.samples import Status, block_of
    from palpate.sources.options import split
    from palpate.sources.serial import SerialOptions
    from recording_bench import SampleReader
    from serial_lines import Chunks

ROWS = "".join(f"{i},{i}.0,{i}.5,8388608,8400000,0.0,0.0,-1,0\n" for i in range(3))


def _file(name: str, data: bytes) -> Path:
    path = FOLDER / name
    path.write_bytes(data)
    return path


def own_file(data: bytes) -> None:
    """Parse rows of a recording by palpate: all, or a line has a reason; written again, they have the same bits."""
    try:
        parse_rows(data)
    except ValueError:
        cut = data.endswith(b"\r")  # within the end of a line
        assert cut or any(
            unreadable(line + b"\n") for line in data.removesuffix(b"\n").split(b"\n")
        )
    path = _file("own.csv", HEADER.encode() + data)
    with suppress(RecordingError):
        report = check(path)
        for block in recorded(path).blocks():
            again = parse_rows(format_rows(block))
            assert again.tobytes() == block.tobytes()
            assert (block["status"] <= 8).all()
        assert json.dumps(report.as_dict())
        assert report.survey.rows == len(palpate.read(path).hard)
        palpate.touches(recorded(path))


def table(data: bytes) -> None:
    """Parse a table of another logger; the first byte selects the options."""
    how = data[0] if data else 0
    columns: dict[str, str | int] = (
        {"hard": "hard", "soft": "soft"} if how & 1 else {"hard": 2, "soft": 3}
    )
    columns |= {"time": 1} if how & 2 else {}
    path = _file("table.csv", data[1:])
    with suppress(RecordingError, ValueError):
        report = check(path, columns=columns, unit=[None, "fF"][how >> 2 & 1])
        recording = palpate.read(path, columns=columns)
        assert report.survey.rows == len(recording.hard) == len(recording.t_hard_s)
        assert not (abs(recording.hard) == math.inf).any()
        palpate.touches(recording)


def sidecar_of(data: bytes) -> None:
    """Parse a sidecar: with any content, the rows of the recording can be read."""
    path = _file("run.csv", (HEADER + ROWS).encode())
    sidecar.sidecar_path(path).write_bytes(data)
    report = check(path)
    assert json.dumps(report.as_dict())
    assert len(palpate.read(path).hard) == report.survey.rows == 3
    recording = recorded(path)
    assert recording.full_scale_pF > 0
    with palpate.open(str(path)) as source:
        assert isinstance(source.describe(), dict)
    with suppress(ValueError, TypeError):  # valid form, but not settings of a tracker
        palpate.touches(recording, **recording.settings)
    check(path, repair=True)


def calibration(data: bytes) -> None:
    """Parse a calibration; an accepted one converts ratios."""
    path = _file("probe.toml", data)
    with suppress(CalibrationError):
        found = palpate.Calibration.load(path)
        modulus = found.modulus(2.5, 0.01)
        assert not modulus.low > modulus.high
        assert math.isnan(modulus.value) or modulus.low <= modulus.value <= modulus.high


def config_file(data: bytes) -> None:
    """Parse a palpate.toml; an accepted one has a table for each of some commands."""
    with suppress(click.UsageError, OSError):
        assert set(config.read_tables(_file("palpate.toml", data), COMMANDS)) <= set(COMMANDS)


def moduli(data: bytes) -> None:
    """Parse a table of moduli."""
    with suppress(CalibrationError):
        found = read_moduli(_file("moduli.csv", data))
        for known in found.values():
            assert 0 < known.modulus < math.inf
            assert 0 <= known.whole < math.inf
        specimen_in(Path("70A-1.csv"), {name: name for name in found})


def firmware(data: bytes) -> None:
    """Parse an Intel HEX file; an accepted one fits the board."""
    with suppress(ProtocolError):
        image = read_hex(_file("firmware.hex", data))
        assert all(at >= 0 and at + len(part) <= RAM_BYTES for at, part in image.items())
        assert 0 in image


def lines(data: bytes) -> None:
    r"""Parse bytes on a serial port; \xff separates the bytes of one read."""
    source = Chunks(b"\n" + data, SerialOptions())
    last = -1
    with suppress(ProtocolError):  # a board that restarts with each line
        for sample in SampleReader(source):
            assert sample.seq > last
            last = sample.seq
            lost = sample.status == Status.LOST
            assert lost == (math.isnan(sample.hard) or math.isnan(sample.soft))
            assert block_of([sample])["status"] <= 8
    assert source.counters["errors"] <= len(data)


def uri(data: bytes) -> None:
    """Parse names of sources with options, until a device would be opened."""
    text = data.decode("utf-8", "replace")
    with suppress(ValueError):
        split(text)
    refused = (ValueError, SourceError, RecordingError)
    no_port = patch("serial.Serial", side_effect=OSError("no port"))
    # reads the metadata of each package
    no_plugins = patch("palpate.sources.registry.entry_points", return_value=[])
    with no_port, no_plugins, warnings.catch_warnings():
        warnings.simplefilter("ignore", FutureWarning)  # warning of Python for a pattern with [[
        for prefix in ("sim:", "serial:", "i2c:nowhere?", "iio:/nowhere?", "nowhere:", "/nowhere/"):
            with suppress(*refused):
                palpate.open(prefix + text).close()
        with suppress(*refused):
            palpate.open("usb:?" + text, backend=SimulatedUsb(VirtualClock())).close()


HOST = "127.0.0.1"
PORT = 8746
TOKEN = new_token()


def request(data: bytes) -> None:
    """Request the page or its web socket: a path on the first line, headers on the next lines.

    No access without the token if there is one, nor with another host name, nor from a page of another origin.
    """
    path, *lines = data.split(b"\n")
    headers = [
        (name.strip().lower(), value.strip())
        for name, _, value in (line.partition(b"=") for line in lines)
    ]
    for kind in ("http", "websocket"):
        scope = {
            "type": kind,
            "path": f"/{path.decode('latin-1')}",
            "query_string": b"",
            "headers": headers,
        }
        assert not _passed(scope, TOKEN)
        if _passed(scope, None):
            host, *_ = [value.decode("latin-1") for name, value in headers if name == b"host"]
            origins = [value.decode("latin-1") for name, value in headers if name == b"origin"]
            assert host.lower().startswith((HOST, "localhost", "[::1]"))
            assert origins == [f"http://{host}"] or (not origins and kind == "http")


def _passed(scope: dict[str, Any], token: str | None) -> bool:
    entered = []

    async def page(*_: Any) -> None:
        entered.append(True)

    async def nothing(*_: Any) -> Any:
        """Receive or send nothing."""

    with suppress(StopIteration):  # without an event loop: nothing here waits
        Gatekeeper(page, HOST, PORT, token)(scope, nothing, nothing).send(None)
        raise AssertionError("it waited")
    return bool(entered)


TARGETS: dict[str, Callable[[bytes], None]] = {
    **{
        each.__name__: each
        for each in (
            own_file,
            table,
            calibration,
            moduli,
            firmware,
            lines,
            uri,
            request,
        )
    },
    "sidecar": sidecar_of,
    "config": config_file,
}


if __name__ == "__main__":
    warnings.simplefilter("error")
    atheris.Setup([sys.argv[0], *sys.argv[2:]], TARGETS[sys.argv[1]])
    atheris.Fuzz()
