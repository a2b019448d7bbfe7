"""Notices samples that are not what a source promises, and with which a stream goes on."""

import math

import numpy as np

from palpate.samples import Block, Sample, Status, samples_of

_CHANNELS = ("hard", "soft")


class PromiseWatch:
    """Tells the first value that is not finite without a status that says so, and the first time that goes back."""

    def __init__(self) -> None:
        self._told: set[str] = set()
        self._last: Sample | None = None

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
        >>> from palpate.samples import block_of
        >>> watch = PromiseWatch()
        >>> watch.follow(block_of([Sample(7, 0, 0, -1, -1, math.inf, 2.5)]), has_refused=True)  # doctest: +ELLIPSIS
        ['source: hard: got inf pF with status 0 at sample 7, allowed: a finite value, or status 8 (LOST): ...']
        """
        found = self._unsaid(block) if has_refused and "value" not in self._told else []
        if "time" not in self._told:
            found += self._backward(block)
        return found

    def _unsaid(self, block: Block) -> list[str]:
        good = np.isfinite(block["hard"]) & np.isfinite(block["soft"])
        wrong = np.flatnonzero((block["status"] == int(Status.OK)) & ~good)
        if not len(wrong):
            return []
        self._told.add("value")
        sample = samples_of(block[wrong[:1]])[0]
        name = next(name for name in _CHANNELS if not math.isfinite(getattr(sample, name)))
        return [
            f"source: {name}: got {getattr(sample, name)} pF with status 0 at sample {sample.seq}, allowed: a finite value, "
            "or status 8 (LOST): such samples are not used, and are counted as refused"
        ]

    def _backward(self, block: Block) -> list[str]:
        last, self._last = self._last, samples_of(block[-1:])[0]
        for name in _CHANNELS:
            times = block[f"t_{name}_ns"]
            if last:
                times = np.concatenate([[getattr(last, f"t_{name}_ns")], times])
            back = np.flatnonzero(times[1:] < times[:-1])  # a difference of integers can overflow
            if len(back):
                self._told.add("time")
                at = int(back[0])
                seq = int(block["seq"][at + (last is None)])
                step_s = (int(times[at]) - int(times[at + 1])) / 1e9
                return [
                    f"source: t_{name}_ns: goes back by {step_s:.3g} s at sample {seq}, allowed: times that do not fall: "
                    "touches there may be wrong"
                ]
        return []
