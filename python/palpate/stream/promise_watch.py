"""Notices samples that are not what a source promises, and with which a stream goes on."""

import math

import numpy as np

from palpate.samples import Block, Status, samples_of

_CHANNELS = ("hard", "soft")
_TIMES = ("t_hard_ns", "t_soft_ns")


class PromiseWatch:
    """Tells the first value that is not finite without a status that says so, and the first time that goes back."""

    def __init__(self) -> None:
        self._value_told = self._time_told = False
        self._last: dict[str, np.int64] = {}

    def follow(self, block: Block, *, has_refused: bool) -> list[str]:
        """Take the next samples; return messages, of each kind one at most.

        Parameters
        ----------
        block : numpy.ndarray, shape (n,)
            Samples, at least one.
        has_refused : bool
            Whether any of them has no valid value.

        Examples
        --------
        >>> from palpate.samples import Sample, block_of
        >>> watch = PromiseWatch()
        >>> watch.follow(block_of([Sample(7, 0, 0, -1, -1, math.inf, 2.5)]), has_refused=True)  # doctest: +ELLIPSIS
        ['source: hard: got inf pF with status 0 at sample 7, allowed: a finite value, or status 8 (LOST): ...']
        """
        told = ""
        if has_refused and not self._value_told:
            told = _unsaid(block)
            self._value_told = bool(told)
        back = "" if self._time_told else self._backward(block)
        self._time_told |= bool(back)
        return [message for message in (told, back) if message]

    def _backward(self, block: Block) -> str:
        for name in _TIMES:
            times = block[name]
            before, self._last[name] = self._last.get(name, times[0]), times[-1]
            if times[0] < before or np.count_nonzero(times[1:] < times[:-1]):  # a difference of integers can overflow
                return _fallen(block, name, int(before))
        return ""


def _unsaid(block: Block) -> str:
    known = np.isfinite(block["hard"]) & np.isfinite(block["soft"])
    wrong = block[(block["status"] == int(Status.OK)) & ~known]
    if not len(wrong):
        return ""
    sample = samples_of(wrong[:1])[0]
    name = next(name for name in _CHANNELS if not math.isfinite(getattr(sample, name)))
    return (
        f"source: {name}: got {getattr(sample, name)} pF with status 0 at sample {sample.seq}, allowed: a finite value, "
        "or status 8 (LOST): such samples are not used, and are counted as refused"
    )


def _fallen(block: Block, name: str, before_ns: int) -> str:
    times = [before_ns, *block[name].tolist()]
    at = next(row for row in range(len(block)) if times[row + 1] < times[row])
    return (
        f"source: {name}: goes back by {(times[at] - times[at + 1]) / 1e9:.3g} s at sample {block['seq'][at]}, "
        "allowed: times that do not fall: touches there may be wrong"
    )
