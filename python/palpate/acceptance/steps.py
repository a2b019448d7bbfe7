"""The acceptance of a board: all its steps in order, whatever happens."""

from collections.abc import Callable, Collection, Iterator

from palpate.acceptance.board_under_test import Ask, BoardUnderTest
from palpate.acceptance.chip_steps import (
    check_bus,
    check_capdac,
    check_inputs,
    check_noise,
    check_registers,
    check_times,
    check_voltages,
)
from palpate.acceptance.driver_steps import check_pairs, check_press, check_replug
from palpate.acceptance.report import Step, Verdict, error_line
from palpate.errors import DeviceNotFound, SourceError
from palpate.messages import unlike

_STEPS: dict[str, Callable[[BoardUnderTest], Iterator[Step]]] = {
    "registers": check_registers,
    "bus": check_bus,
    "voltages": check_voltages,
    "times": check_times,
    "inputs": check_inputs,
    "capdac": check_capdac,
    "noise": check_noise,
    "pairs": check_pairs,
    "replug": check_replug,
    "press": check_press,
}
NAMES = tuple(_STEPS)  # as `--skip` takes them, in order; the last two need a hand
_NEED_INPUTS = ("capdac", "noise", "press")
_BY_DRIVER = ("pairs", "replug", "press")
_FIRST = "registers"
_CHECK = "check link LK2 and the supply of the board, then the cable; unplug the board for a moment"


class Acceptance:
    """Measures a board step by step: iterate over it.

    Without `ask` the steps that need a hand are left out.
    """

    def __init__(
        self, board: BoardUnderTest, ask: Ask | None = None, *, skip: Collection[str] = ()
    ) -> None:
        for name in sorted(skip):
            if name not in NAMES:
                raise ValueError(f"skip: {unlike(name, NAMES)}")
        self.stopped: str = ""
        self._board = board
        self._board.ask = ask
        self._skip = skip
        self._done: set[str] = set()

    def __iter__(self) -> Iterator[Step]:
        """Do the steps."""
        for name in NAMES:
            reason = self._reason_to_leave_out(name)
            if reason:
                yield Step.not_done(name, reason)
                continue
            try:
                yield from _STEPS[name](self._board)
                self._done.add(name)
            except SourceError as error:
                yield self._failed(name, error)

    def _failed(self, name: str, error: SourceError) -> Step:
        """Return the step that an error ended; all others end without a board or first step."""
        gone = isinstance(error, DeviceNotFound)
        message = error_line(error)
        if gone or name == _FIRST:
            self.stopped = message
        if gone:  # the error says what to do
            return Step(name, Verdict.WRONG, message)
        remedy = _CHECK if name == _FIRST else f"the chip stopped answering: {_CHECK}"
        return Step(name, Verdict.WRONG, message, do=(remedy,))

    def _reason_to_leave_out(self, name: str) -> str:
        if name in self._skip:
            return "left out"
        if self.stopped:
            return "the board cannot be used any more"
        if self._board.cannot_measure and name in _BY_DRIVER:
            return "needs right inputs"
        if name in _NEED_INPUTS and "inputs" not in self._done:
            return "needs the step inputs"
        return ""
