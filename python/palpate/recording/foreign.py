"""Any recording as a sequence of blocks: palpate's own in parts, a table of another logger as one block."""

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from palpate.recording.columns_in import own_recording
from palpate.recording.own_file import Recorded
from palpate.recording.reading import read
from palpate.recording.survey import Survey
from palpate.samples import Block, blank

RATE = "pairs a second, for a table without times; or name the column of times with time=COL"
"""What is allowed as the rate of a table without times."""


class Foreign:
    """A table of another logger, read as one block.

    Parameters
    ----------
    path : path-like
    **asked
        Keywords of `palpate.read`.

    Raises
    ------
    RecordingError, ValueError
        As in `palpate.read`.

    Examples
    --------
    >>> table = Foreign("tests/data/four-specimens.csv", columns={"hard": "hard_pF", "soft": "soft_pF"})
    >>> [len(block) for block in table.blocks()] == [table.survey.rows]
    True
    """

    document = None
    doubts: tuple[str, ...] = ()

    def __init__(self, path: str | os.PathLike[str], **asked: Any) -> None:
        self.path: Path = Path(path)
        self.survey: Survey = Survey()
        self._recording = read(self.path, **asked)
        self.full_scale_pF: float = self._recording.full_scale_pF
        self.tares: frozenset[int] = frozenset()
        self.gap_marks: list[tuple[int, str]] = []
        times = (self._recording.t_hard_s, self._recording.t_soft_s)
        self.timed: bool = all(bool(np.isfinite(t).all()) for t in times)
        self.settings: dict[str, Any] = {}
        self.host_stamps: bool = False  # not known
        self.understood: str = self._recording.understood

    @property
    def notes(self) -> tuple[str, ...]:
        """Remarks on the data; complete after `blocks()`."""
        pause = self.survey.told_pause if self.timed else ""
        return (*self._recording.notes, *([pause] if pause else []))

    def describe(self) -> dict[str, Any]:
        """Return the file name and full scale; nothing else is known."""
        return {"name": "table of another logger", "file": self.path.name, "full_scale_pF": self.full_scale_pF}

    def blocks(self) -> Iterator[Block]:
        """Yield all samples as one block; without times, samples are 1 ms apart."""
        recording = self._recording
        block = blank(len(recording.hard))
        block["hard"], block["soft"] = recording.hard, recording.soft
        for name, seconds in (("t_hard_ns", recording.t_hard_s), ("t_soft_ns", recording.t_soft_s)):
            ns = seconds * 1e9  # halves away from zero, as the tracker rounds seconds
            block[name] = np.trunc(ns + np.copysign(0.5, ns)) if self.timed else block["seq"] * 1_000_000
        self.survey = Survey()
        self.survey.add(block)
        yield block


def recorded(path: str | os.PathLike[str], **asked: Any) -> Recorded | Foreign:
    """Open a recording of any length, to read it in blocks.

    Parameters
    ----------
    path : path-like
    **asked
        Keywords of `palpate.read`. A table of another program is still read as a whole.

    Returns
    -------
    Recorded or Foreign
        An input for `palpate.touches`: `blocks()` yields arrays of samples; `settings` and `describe()` are those of
        the sidecar.

    Raises
    ------
    RecordingError, ValueError
        As in `palpate.read`.

    Examples
    --------
    >>> import palpate
    >>> [touch.samples for touch in palpate.touches(recorded("tests/data/four-specimens.csv"))]
    [250, 250, 250, 250]
    """
    given = {name: value for name, value in asked.items() if value is not None}
    own = None if given else own_recording(Path(path))
    return own or Foreign(path, **given)
