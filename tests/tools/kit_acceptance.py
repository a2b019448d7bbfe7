"""Acceptance of a simulated board: a probe on it, and a person who does what is asked for."""

import math
from collections.abc import Callable, Collection
from random import Random

from palpate.ad7746 import datasheet
from palpate.ad7746.bus import VirtualClock
from palpate.ad7746.twin.chip import ChipTwin
from palpate.ad7746.twin.kit import Fault, KitTwin
from palpate.ad7746.twin.usb import TwinBackend
from palpate.ad7746.twin.wiring import WIRINGS
from palpate.kit.acceptance import NAMES, Acceptance
from palpate.kit.bench import Bench, open_bench
from palpate.kit.step import NOT_DONE, WRONG, Step

IDLE_PF = (6.92, 4.69)
DEPTH_PF = (0.9, 0.3)
_PRESS_S = 2.0


class Board:
    """A simulated board with a probe, other than the data sheet's by the tolerances, drawn by the seed."""

    def __init__(self, wiring: str = "guide", seed: int = 0) -> None:
        random = Random(f"{wiring} {seed}")
        self.clock = VirtualClock()
        self.press_s = math.inf
        self.added_pF = 0.0
        self.idle_pF = [pF * random.uniform(0.5, 1.5) for pF in IDLE_PF]
        self.dac_step_pF = (0.164 * random.uniform(0.8, 1.2), 0.164 * random.uniform(0.8, 1.2))
        chip = ChipTwin(self._pF, seed=seed, dac_step_pF=self.dac_step_pF, wiring=WIRINGS[wiring])
        chip.pace = random.uniform(0.95, 1.05)
        self.kit = KitTwin(chip, self.clock, bus_kHz=random.uniform(60, 400))
        self.backend = TwinBackend(self.clock)
        self.port = self.backend.plug(self.kit)

    def _pF(self, bump: int, begin_s: float, end_s: float) -> float:
        share = ((begin_s + end_s) / 2 - self.press_s) / _PRESS_S
        pressed = math.sin(math.pi * share) if 0 < share < 1 else 0.0
        return self.idle_pF[bump - 1] + DEPTH_PF[bump - 1] * pressed + (self.added_pF if bump == 1 else 0.0)

    def open(self, options: str = "") -> Bench:
        """Open it, by `usb:` with these options."""
        return open_bench(f"usb:{options}", {"backend": self.backend, "clock": self.clock})

    def accept(
        self, options: str = "", *, by_hand: bool = False, replaced: bool = False, only: Collection[str] = NAMES
    ) -> list[Step]:
        """Do steps; `by_hand`: those that are asked for, too; `replaced`: by another board, when it is pulled."""
        bench = self.open(options)
        try:
            person = Person(self, replaced=replaced) if by_hand else None
            return list(Acceptance(bench, person, skip=set(NAMES) - set(only)))
        finally:
            bench.source.close()


class Person:
    """Does what is asked for: pulls the plug, presses, connects a capacitor of 2.2 pF."""

    def __init__(self, board: Board, *, replaced: bool = False) -> None:
        self._replaced = replaced
        self._board = board
        self._tasks: dict[str, Callable[[], None]] = {
            "USB plug": self._pull,
            "press": lambda: setattr(board, "press_s", board.clock.now_ns() / 1e9 + 4),
            "capacitor": lambda: setattr(board, "added_pF", 2.2),
        }

    def _pull(self) -> None:
        chip = self._board.kit.chip
        power_on = chip.power_on

        def another(now: int) -> None:
            power_on(now)
            chip.registers[datasheet.CAP_GAIN :] = b"\1\2\3\4"

        if self._replaced:
            setattr(chip, "power_on", another)  # noqa: B010  a method
        self._board.kit.faults.append(Fault("unplug", 2.0, skip=200))

    def ready(self, text: str) -> bool:
        """Do it."""
        [act] = [task for word, task in self._tasks.items() if word in text]
        act()
        return True

    def value(self, text: str) -> float | None:
        """Return the value of the capacitor; the person who replaces the board reads it wrongly, too."""
        return 2.6 if self._replaced else 2.2


def wrong(steps: list[Step]) -> list[Step]:
    """Return the steps that are wrong."""
    return [step for step in steps if step.verdict == WRONG]


def not_done(steps: list[Step]) -> list[str]:
    """Return the names of the steps that were not done."""
    return [step.name for step in steps if step.verdict == NOT_DONE]


def said(steps: list[Step]) -> str:
    """Return all that the wrong steps say."""
    return "\n".join(line for step in wrong(steps) for line in step.lines())
