"""Permission to open the board, checked without opening it."""

import os
import re
import sys
from collections.abc import Iterable
from pathlib import Path

from palpate.ad7746.evalkit.find import PRODUCT, VENDOR, Board
from palpate.files import read_bytes

RULES = tuple(
    Path(folder) for folder in ("/etc/udev/rules.d", "/run/udev/rules.d", "/usr/lib/udev/rules.d", "/lib/udev/rules.d")
)
_LARGEST = 1_000_000  # bytes of a file of rules
USBFS = Path("/dev/bus/usb")


def may_open(board: Board, usbfs: Path = USBFS) -> bool | None:
    """Return whether this user may open a board; None: unknown without trying.

    Examples
    --------
    >>> may_open(Board(1, 2, ()), Path("/nowhere")) is None
    True
    """
    node = usbfs / f"{board.bus:03d}" / f"{board.address:03d}"
    return os.access(node, os.R_OK | os.W_OK) if node.exists() else None


def rule_files(folders: Iterable[Path] | None = None) -> list[Path]:
    """Return the files of udev rules that name the board.

    Examples
    --------
    >>> rule_files([Path("/nowhere")])
    []
    """
    named = [re.compile(f'{key}}}=="{number:04x}"', re.IGNORECASE) for key, number in
             (("idVendor", VENDOR), ("idProduct", PRODUCT))]  # fmt: skip
    files = [
        file
        for folder in (RULES if folders is None else folders)
        if folder.is_dir()
        for file in sorted(folder.glob("*.rules"))
    ]
    return [file for file in files if any(all(n.search(line) for n in named) for line in _lines(file))]


def rules_matter() -> bool:
    """Return whether this user needs a udev rule: on Linux, except root."""
    return sys.platform == "linux" and os.geteuid() != 0


def _lines(file: Path) -> list[str]:
    try:
        text = read_bytes(file, _LARGEST).decode(errors="replace")
    except OSError:
        return []
    return [line for line in text.splitlines() if not line.lstrip().startswith("#")]
