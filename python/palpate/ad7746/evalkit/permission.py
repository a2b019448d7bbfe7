"""Permission to open the board, checked without opening it."""

import os
from pathlib import Path

from palpate.ad7746.evalkit.find import Board

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
