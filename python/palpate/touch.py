"""Touches of a recording."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, Protocol, Unpack, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from palpate._core import Touch, Tracker
from palpate.samples import Block, usable

if TYPE_CHECKING:
    from palpate._core import _AnySettings, _Scene


class Channels(Protocol):
    """Interface of a recording in memory for `touches`."""

    @property
    def t_hard_s(self) -> NDArray[np.float64]: ...  # noqa: D102
    @property
    def t_soft_s(self) -> NDArray[np.float64]: ...  # noqa: D102
    @property
    def hard(self) -> NDArray[np.float64]: ...  # noqa: D102
    @property
    def soft(self) -> NDArray[np.float64]: ...  # noqa: D102
    @property
    def full_scale_pF(self) -> float: ...  # noqa: D102


@runtime_checkable
class Blocks(Protocol):
    """Interface of a recording read in blocks for `touches`."""

    @property
    def timed(self) -> bool: ...  # noqa: D102
    @property
    def full_scale_pF(self) -> float: ...  # noqa: D102
    @property
    def tares(self) -> frozenset[int]: ...  # noqa: D102
    def blocks(self) -> Iterator[Block]: ...  # noqa: D102


def touches(
    recording: Channels | Blocks, *, scene: "_Scene" = "handheld", **settings: Unpack["_AnySettings"]
) -> list[Touch]:
    """Return the touches of a recording, each with its estimated ratio.

    Parameters
    ----------
    recording : Recording, Simulation, or the result of `palpate.recorded`
        Arrays of shape (n,): `t_hard_s`, `t_soft_s` (s; nan if unknown), `hard`, `soft` (pF, baseline included). A
        reading that is nan, or `full_scale_pF` or more, is left out and counted. The result of `palpate.recorded` is
        read in blocks, and tared at the same samples as in the measurement.
    scene : str
        As in `Tracker`.
    **settings
        As in `Tracker`.

    Returns
    -------
    list of Touch
        In order of time; empty if no change was above the noise.

    Raises
    ------
    ValueError
        An unknown scene, or a setting out of range.
    TypeError
        An unknown setting; or not a recording: a path, for example, has to be read first.

    Examples
    --------
    >>> import palpate
    >>> from palpate.simulation import scenarios
    >>> [touch] = palpate.touches(scenarios.run("stiff-steady"))
    >>> abs(touch.ratio / scenarios.PROBE.ratio(8.68) - 1) < 3 * touch.standard_error / touch.ratio
    True
    """
    if not hasattr(recording, "full_scale_pF"):
        raise TypeError(f"recording: got {recording!r:.60}, allowed: the result of palpate.read or palpate.recorded")
    given: dict[str, Any] = {"full_scale": recording.full_scale_pF, **settings}
    tracker = Tracker(scene, **given)
    for _ in replayed(tracker, recording):
        pass
    tracker.finish()
    return tracker.touches if timed(recording) else [touch._untimed() for touch in tracker.touches]


def timed(recording: Channels | Blocks) -> bool:
    """Return whether the times of a recording are known."""
    if isinstance(recording, Blocks):
        return recording.timed
    return bool(np.isfinite(recording.t_hard_s).all() and np.isfinite(recording.t_soft_s).all())


def replayed(tracker: Tracker, recording: Channels | Blocks) -> Iterator[tuple[NDArray[Any], ...]]:
    """Feed a recording to a tracker.

    Yields
    ------
    tuple of five numpy.ndarray
        Of each part of the recording: times of both channels, s; hard, soft, pF, as the tracker got them; and the rows
        of `Tracker.process`.
    """
    if isinstance(recording, Blocks):
        for block in recording.blocks():
            hard, soft = usable(block, tracker.settings["full_scale"])
            times = block["t_hard_ns"], block["t_soft_ns"]
            yield times[0] / 1e9, times[1] / 1e9, hard, soft, tracker.process(*times, hard, soft)
            if int(block["seq"][-1]) in recording.tares:
                tracker.tare()
        return
    rows = np.arange(len(recording.hard)) * 1_000_000  # without times: equal steps, the same time for both channels
    t_hard, t_soft = (recording.t_hard_s, recording.t_soft_s) if timed(recording) else (rows, rows)
    channels = recording.hard, recording.soft
    yield t_hard, t_soft, *channels, tracker.process(t_hard, t_soft, *channels)
