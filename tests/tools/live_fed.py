"""Measurements that are brought into a state: sources that do what no simulated board does, and waiting for a state."""

import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from palpate.live.opening import opener
from palpate.live.recordings import Recordings
from palpate.live.session import Session
from palpate.live.workbench import Workbench
from palpate.samples import Sample
from palpate.sources import Source
from palpate.sources.base import Gap

PATIENCE_S = 60


def begun(source: str | Callable[..., Source], folder: Path) -> tuple[Session, Workbench]:
    """Return a session that measures and records, and its workbench."""
    opened = opener(source, {}) if isinstance(source, str) else source
    session = Session(opened, Recordings(folder / "run.csv"), {"scene": "handheld"})
    session.start()
    return session, Workbench(session, source if isinstance(source, str) else "test:")


def waited(bench: Workbench, what: str) -> dict[str, Any]:
    """Return the first state with this word, or with a line of this kind; on a slow machine the line may be another one."""
    seen = []
    deadline = time.monotonic() + PATIENCE_S
    while time.monotonic() < deadline:
        state = bench.state()
        if what in (state["line"]["what"], state["now"]["word"]):
            return state
        seen.append(state["line"]["what"])
        time.sleep(0.02)
    raise AssertionError(f"no {what} in {PATIENCE_S} s, but {list(dict.fromkeys(seen))}")


class Fed(Source):
    """Pairs each `pause_s`; `made` gives number -> hard, soft, pF, or None: wait.

    `unplug` and `plug` do what they say; after the latter there is a gap.
    """

    def __init__(self, made: Callable[[int], tuple[float, float] | None], pause_s: float = 0.01) -> None:
        self._gone = self._was_gone = False
        self._made, self._pause_s, self._stopped = made, pause_s, False
        self._gaps: list[Gap] = []

    def __iter__(self) -> Iterator[Sample]:
        """Return the pairs."""
        begun_ns, seq = time.monotonic_ns(), 0
        while not self._stopped:
            time.sleep(self._pause_s)
            if not self._gone and (values := self._made(seq)) is not None:
                if self._was_gone:
                    seq += 10
                    self._gaps.append(Gap(seq, "the board was unplugged for a while"))
                    self._was_gone = False
                now = time.monotonic_ns() - begun_ns
                yield Sample(seq, now, now, -1, -1, *values)
                seq += 1

    def unplug(self) -> None:
        """Give nothing."""
        self._gone = True

    def plug(self) -> None:
        """Go on, after a gap."""
        self._was_gone = True
        self._gone = False

    @property
    def gaps(self) -> list[Gap]:
        """One for each time that it was unplugged."""
        return self._gaps

    @property
    def troubles(self) -> dict[str, str]:
        """Whether it is unplugged."""
        return {"unplugged": "the board is gone"} if self._gone or self._was_gone else {}

    def describe(self) -> dict[str, Any]:
        """Return name and period."""
        return {"name": "fed", "period_s": 0.01}

    def interrupt(self) -> None:
        """Stop the iteration."""
        self._stopped = True


def noisy(number: int) -> tuple[float, float]:
    return 0.6 + 1e-5 * ((number * 7919) % 13), 0.4 + 1e-5 * ((number * 104729) % 11)


def fed(made: Callable[[int], tuple[float, float] | None], pause_s: float = 0.01) -> Callable[..., Source]:
    return lambda: Fed(made, pause_s)
