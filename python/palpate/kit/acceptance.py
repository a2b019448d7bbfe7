"""The acceptance of a board: all steps in order, whatever happens."""

from collections.abc import Callable, Collection, Iterator

from palpate.errors import DeviceNotFound, SourceError, unlike
from palpate.kit import board_steps, input_steps, pair_steps, prompted
from palpate.kit.bench import Bench
from palpate.kit.prompted import Nobody, Prompts
from palpate.kit.step import WRONG, Step, left_out, one_line

Act = Callable[[Bench], Iterator[Step]]

_ACTS: dict[str, Act] = {
    "registers": board_steps.registers,
    "bus": board_steps.bus_clock,
    "voltages": board_steps.voltages,
    "times": board_steps.conversion_times,
    "inputs": input_steps.inputs,
    "capdac": input_steps.capdac,
    "noise": input_steps.noise,
    "pairs": pair_steps.pairs,
}
_PROMPTED: dict[str, Callable[[Bench, Prompts], Iterator[Step]]] = {
    "replug": prompted.replug,
    "press": prompted.press,
    "capacitor": prompted.capacitor,
}
_NEEDS = {"capdac": "inputs", "noise": "inputs", "press": "inputs", "capacitor": "inputs"}
_BY_DRIVER = ("pairs", "replug", "press")
_FIRST = "registers"
_CHIP = "link LK2 and the supply of the board, then the cable; unplug the board for a moment"
NAMES = (*_ACTS, *_PROMPTED)
"""Names of the steps, in order."""


class Acceptance:
    """Measures a board step by step: iterate over it.

    Each step comes as soon as it is done. An error of the board is a step that is wrong; after one that ends all access,
    as an unplugged board, the others are not done.

    Parameters
    ----------
    bench : Bench
    prompts : Prompts, optional
        Asks the person at the board. Default: prompted steps are left out.
    skip : collection of str
        Of `NAMES`: steps to leave out.

    Attributes
    ----------
    stopped : str
        The error that ended all access; empty: none so far.

    Raises
    ------
    ValueError
        `skip` has an unknown name.

    Examples
    --------
    >>> from palpate.kit.bench import open_bench
    >>> for step in Acceptance(open_bench("sim:", {}), skip=set(NAMES) - {"registers"}):
    ...     if step.verdict != "not done":
    ...         print(step.lines()[0])
    ok  registers 07 to 0E after a reset: 00 00 03 a0 00 00 80 00 (expected: 00 00 03 a0 00 00 80 00)
    ok  fingerprint: CAP_GAIN and VOLT_GAIN: 66cc5c90 (expected: set in the factory, neither 0000 nor ffff)
    """

    def __init__(self, bench: Bench, prompts: Prompts | None = None, *, skip: Collection[str] = ()) -> None:
        if unknown := set(skip) - set(NAMES):
            raise ValueError(f"skip: {unlike(min(unknown), NAMES)}")
        self.stopped: str = ""
        self._bench = bench
        self._prompts = prompts or Nobody()
        self._skip = skip
        self._done: set[str] = set()

    def __iter__(self) -> Iterator[Step]:
        """Do the steps."""
        for name in NAMES:
            if why := self._left_out(name):
                yield left_out(name, why)
                continue
            try:
                yield from self._act(name)
                self._done.add(name)
            except SourceError as error:
                yield Step(name, WRONG, one_line(error), "", _remedy(name, error))
                if isinstance(error, DeviceNotFound) or name == _FIRST:
                    self.stopped = one_line(error)

    def _act(self, name: str) -> Iterator[Step]:
        return _ACTS[name](self._bench) if name in _ACTS else _PROMPTED[name](self._bench, self._prompts)

    def _left_out(self, name: str) -> str:
        if name in self._skip:
            return "left out"
        if self.stopped:
            return "the board cannot be used any more"
        if self._bench.cannot_measure and name in _BY_DRIVER:
            return "needs right inputs"
        needed = _NEEDS.get(name)
        return f"needs the step {needed}" if needed and needed not in self._done else ""


def _remedy(name: str, error: SourceError) -> tuple[str, ...]:
    if isinstance(error, DeviceNotFound):
        return ()  # the error says it
    return (f"check {_CHIP}" if name == _FIRST else f"the chip stopped answering: check {_CHIP}",)
