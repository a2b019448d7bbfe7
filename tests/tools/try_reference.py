"""What palpate itself says of a recording, in the form in which a page gets it: rows, touches, the word and the line."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from palpate.live.desk.recorded import Recorded
from palpate.live.feed import Rows
from palpate.live.opening import review
from palpate.live.summary import Summary


@dataclass(frozen=True)
class Reviewed:
    """An opened recording.

    Attributes
    ----------
    rows : numpy.ndarray
        Of `palpate.live.feed.ROW`.
    touches, state : dict
        The messages to a page.
    """

    rows: Rows
    touches: dict[str, Any]
    state: dict[str, Any]


def reviewed(path: Path) -> Reviewed:
    """Return what `palpate live PATH` shows."""
    opened = review(str(path), {}, {}, lambda _: None)
    parts: list[Rows] = []
    keep = opened.levels.add

    def add(rows: Rows) -> None:
        parts.append(rows.copy())
        keep(rows)

    opened.levels.add = add  # type: ignore[method-assign]
    opened.start()
    opened.close() if opened.error else opened._thread.join()
    summary = Summary(opened)
    desk = Recorded(opened, summary)
    summary.known = desk.rows
    return Reviewed(np.concatenate(parts), summary.touches(), {**summary.now(), **desk.state()})
