"""The limits in SECURITY.md, made from those of the code.

`python tests/tools/security_limits.py` writes the tables anew.
"""

import re

from h11._connection import DEFAULT_MAX_INCOMPLETE_EVENT_SIZE as LARGEST_REQUEST
from palpate import files, line_protocol, messages
from palpate.ad7746.evalkit import usb_bus
from palpate.calibration import specimen_files
from palpate.live import access, page_commands, peers, run_files
from palpate.recording import sidecar
from palpate.sources import iio, options
from project import ROOT

PAGE = ROOT / "SECURITY.md"
_TABLE = re.compile(
    r"(<!-- python tests/tools/security_limits\.py (\w+) -->\n).*?(<!-- end -->)", re.DOTALL
)


def inputs() -> list[tuple[str, ...]]:
    """Return the table of inputs, with its header."""
    toml = (
        f"{files.LARGEST_TOML:,} bytes, {files.DEEPEST_TOML} levels of dots and brackets, "
        f"{files.LONGEST_TOML_WORD} characters of a number or a name"
    )
    table = f"{_size(files.LARGEST_TABLE)} after decompression of a .gz"
    return [
        ("input", "code", "limit", "error"),
        (
            "palpate's own recordings",
            "`palpate/recording/csv_reader.py`",
            "read in parts, of any length",
            "`RecordingError`",
        ),
        (
            "sidecars (JSON)",
            "`palpate/recording/sidecar.py`",
            _size(sidecar.LARGEST),
            "none: a note says so",
        ),
        (
            "tables of other programs",
            "`palpate/importers/`",
            table,
            "`RecordingError`, `ValueError` for columns",
        ),
        (
            "calibrations, palpate.toml (TOML)",
            "`palpate/files.py`",
            toml,
            "`CalibrationError`; a usage error",
        ),
        (
            "tables of moduli",
            "`palpate/calibration/specimen_files.py`",
            _size(specimen_files.LARGEST),
            "`CalibrationError`",
        ),
        (
            "firmware (Intel HEX)",
            "`palpate/ad7746/evalkit/usb_bus.py`",
            _size(usb_bus.LARGEST),
            "`ProtocolError`",
        ),
        (
            "lines on a serial port",
            "`palpate/line_protocol.py`",
            _size(line_protocol.LONGEST),
            "`ProtocolError` until lines can be read, then counted",
        ),
        (
            "files of the kernel's driver",
            "`palpate/sources/iio.py`",
            f"{iio.LARGEST:,} bytes",
            "`SourceError`",
        ),
        ("answers of the board", "`palpate/ad7746/`", "", "`SourceError`"),
        (
            "names of sources, with options",
            "`palpate/sources/options.py`",
            f"{options.LONGEST:,} characters",
            "`ValueError`",
        ),
        (
            "samples of a source",
            "`palpate/stream/reader.py`",
            "the values that a recording can store",
            "`ProtocolError`",
        ),
        (
            "states of estimators in a pickle",
            "`cpp/bind/estimator.hpp`",
            "",
            "`ValueError`, `TypeError`, `IndexError`, `RuntimeError`",
        ),
        ("a value in a message", "`palpate/messages.py`", f"{messages.LONGEST} characters", "none"),
    ]


def page() -> list[tuple[str, ...]]:
    """Return the table of the live page, with its header."""
    waiting = f"{peers.WAIT_S:.0f} s, and {peers.MOST_WAITING} of them: then the oldest is closed"
    return [
        ("of the live page", "limit"),
        ("the token", f"{len(access.new_token()) * 6} random bits"),
        ("a connection that has not shown the token", waiting),
        ("a request", f"{LARGEST_REQUEST // 1024} KiB"),
        ("a message from the page", f"{page_commands.LONGEST_MESSAGE // 1024} KiB of JSON"),
        ("a text in it", f"{page_commands.LONGEST_TEXT:,} characters, all of which can be shown"),
        (
            "the name of a file",
            f"{run_files.LONGEST} characters of A-Z, a-z, 0-9, space, _, . and -",
        ),
    ]


TABLES = {"inputs": inputs, "page": page}


def made(text: str) -> str:
    """Return a text with its tables made anew."""

    def table(match: re.Match[str]) -> str:
        header, *rows = TABLES[match[2]]()
        lines = [_row(header), "|---" * len(header) + "|", *map(_row, rows)]
        return match[1] + "\n".join(lines) + "\n" + match[3]

    return _TABLE.sub(table, text)


def _row(cells: tuple[str, ...]) -> str:
    return " ".join(f"| {cell}".rstrip() for cell in cells) + " |"


def _size(size: int) -> str:
    """Return a size in bytes, kB or MB."""
    for factor, unit in ((1_000_000, "MB"), (1_000, "kB")):
        if size >= factor and size % factor == 0:
            return f"{size // factor} {unit}"
    return f"{size:,} bytes"


if __name__ == "__main__":
    PAGE.write_text(made(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
