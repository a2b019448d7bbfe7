"""The acceptance of a board: all steps in order, whatever happens."""

from collections.abc import Callable, Collection, Iterator

from palpate.errors import DeviceNotFound, SourceError, unlike
from palpate.kit import steps
from palpate.kit.bench import Bench
from palpate.kit.step import WRONG, Step, left_out, one_line

_ACTS: dict[str, Callable[[Bench], Iterator[Step]]] = {
    act.__name__: act
    for act in (steps.registers, steps.bus, steps.voltages, steps.times, steps.inputs, steps.capdac, steps.noise,
                steps.pairs)
}  # fmt: skip
_PROMPTED = {act.__name__: act for act in (steps.replug, steps.press, steps.capacitor)}
_NEED_INPUTS = ("capdac", "noise", "press", "capacitor")
_BY_DRIVER = ("pairs", "replug", "press")
_FIRST = "registers"
_CHECK = "check link LK2 and the supply of the board, then the cable; unplug the board for a moment"
NAMES = (*_ACTS, *_PROMPTED)  # Names of the steps, in order.


class Acceptance:
    """Measures a board step by step: iterate over it. Without `prompts` the steps that need a hand are left out."""

    def __init__(self, bench: Bench, prompts: steps.Prompts | None = None, *, skip: Collection[str] = ()) -> None:
        if unknown := set(skip) - set(NAMES):
            raise ValueError(f"skip: {unlike(min(unknown), NAMES)}")
        self.stopped: str = ""
        self._bench, self._prompts, self._skip = bench, prompts, skip
        self._done: set[str] = set()

    def __iter__(self) -> Iterator[Step]:
        """Do the steps."""
        for name in NAMES:
            if why := self._left_out(name):
                yield left_out(name, why)
                continue
            try:
                if name in _ACTS:
                    yield from _ACTS[name](self._bench)
                else:
                    yield _PROMPTED[name](self._bench, self._prompts)
                self._done.add(name)
            except SourceError as error:
                gone = isinstance(error, DeviceNotFound)  # the error says what to do
                check = _CHECK if name == _FIRST else f"the chip stopped answering: {_CHECK}"
                yield Step(name, WRONG, one_line(error), "", () if gone else (check,))
                if gone or name == _FIRST:
                    self.stopped = one_line(error)

    def _left_out(self, name: str) -> str:
        if name in self._skip:
            return "left out"
        if self.stopped:
            return "the board cannot be used any more"
        if self._bench.cannot_measure and name in _BY_DRIVER:
            return "needs right inputs"
        return "needs the step inputs" if name in _NEED_INPUTS and "inputs" not in self._done else ""
