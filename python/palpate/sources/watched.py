"""The evaluation kit as a source that also tells which boards are plugged in and unplugged."""

from collections.abc import Mapping
from contextlib import suppress
from typing import Any, Self

from palpate.ad7746.clock import Clock
from palpate.ad7746.evalkit.board import EvalKit
from palpate.ad7746.evalkit.find import Board
from palpate.ad7746.evalkit.hotplug import Hotplug, Look
from palpate.errors import PalpateError
from palpate.sources.board import BoardSource


class WatchedKit(BoardSource):
    """Pairs of the evaluation kit, with a message within a second if a board is plugged in or unplugged.

    If the board that measures is unplugged, the driver tells it, and waits.

    Parameters
    ----------
    kit : EvalKit
        Opened.
    options : mapping
        As for `BoardSource`.
    clock : Clock
        The clock of the kit.
    look : callable, optional
        As for `Hotplug`.
    """

    def __init__(self, kit: EvalKit, options: Mapping[str, Any], clock: Clock, look: Look | None = None) -> None:
        super().__init__(kit, options, clock)
        self._evalkit, self._look = kit, look
        self._hotplug: Hotplug | None = None

    def __enter__(self) -> Self:
        """Configure the converter, as `BoardSource`, and begin to watch."""
        super().__enter__()
        with suppress(OSError, PalpateError):  # a measurement does not need it
            self._hotplug = Hotplug(self._tell, self._look)
        return self

    def close(self) -> None:
        """Close the device, and end the watch."""
        if self._hotplug:
            self._hotplug.close()
        super().close()

    def _tell(self, before: set[Board], now: set[Board]) -> None:
        measuring = self._evalkit.board
        beside = f"; usb:{measuring} goes on measuring" if measuring in now else ""
        for board in sorted(before - now):
            if board.ports != measuring.ports or board.bus != measuring.bus:
                self.notify(f"usb:{board} was unplugged{beside}.")
        for board in sorted(now - before):
            self.notify(f"usb:{board} was plugged in{beside if board != measuring else ''}.")
