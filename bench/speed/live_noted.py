"""A server of the live page that notes when each sample was converted, given to the stream, and sent to a page.

python -m bench.speed.live_noted RATE FOLDER      prints the address; at its end writes made.npy and sent.npy, ms
"""

import sys
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any, Self

import numpy as np
import palpate
from numpy.typing import NDArray
from palpate import Sample, Source
from palpate.live.feed import HEADER
from palpate.live.recordings import Recordings
from palpate.live.serve import address_of, listen, serve
from palpate.live.server import Server
from palpate.live.session import Session
from palpate.live.workbench import Workbench
from palpate.sources.sim import SimSource
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from bench.speed.live_load import HOST, Held

MOST = 1_000_000  # samples of a run
BOARD = "sim:four-specimens?seed=1&speed=1"


class Made(Source):
    """A source that notes the moment of each conversion, in memory that does not grow."""

    def __init__(self, rate: str) -> None:
        self._inner: Any = palpate.open(BOARD) if rate == "board" else Held(float(rate))
        self._moments, self._count = np.full((MOST, 3), np.nan), 0

    @property
    def moments(self) -> NDArray[np.float64]:
        """Time of each sample, s; moments of its conversion, and at which it was given, ms since 1970."""
        return self._moments[: self._count]

    def __enter__(self) -> Self:
        """Begin."""
        self._inner.__enter__()
        return self

    def describe(self) -> dict[str, Any]:
        """Return what the source says of itself."""
        return dict(self._inner.describe())

    def __iter__(self) -> Iterator[Sample]:
        """Return its samples, and note them."""
        begun = time.time_ns()
        for sample in self._inner:
            given = time.time_ns()
            converted = given - self._age(sample, given - begun)
            self._moments[self._count] = sample.t_hard_ns * 1e-9, converted / 1e6, given / 1e6
            self._count += 1
            yield sample

    def _age(self, sample: Sample, now_ns: int) -> int:
        """Return the time since the end of the conversion, ns."""
        if not isinstance(self._inner, SimSource):
            return now_ns - sample.t_hard_ns
        return int(self._inner.clock.now_ns() - self._inner.kit.chip.conversions[-1].end)

    def interrupt(self) -> None:
        """End it."""
        self._inner.interrupt()

    def close(self) -> None:
        """Close it."""
        self._inner.close()


class Noting:
    """An application that notes which samples it sends.

    Attributes
    ----------
    sent : list of (float, float)
        The moment, ms since 1970, and the time of the newest sample in the message, s.
    """

    def __init__(self, app: ASGIApp) -> None:
        self._app = app
        self.sent: list[tuple[float, float]] = []

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Forward."""

        async def noting(message: Message) -> None:
            if frame := message.get("bytes"):
                size = HEADER.unpack_from(frame)[2]
                if size:
                    self.sent.append((time.time() * 1e3, float(np.frombuffer(frame, "<f8", size, HEADER.size)[-1])))
            await send(message)

        await self._app(scope, receive, noting if scope["type"] == "websocket" else send)


def main() -> int:
    """Serve until interrupted."""
    rate, folder = sys.argv[1], Path(sys.argv[2])
    source = Made(rate)
    scene = "handheld" if rate == "board" else "sliding"
    session = Session(lambda: source, Recordings(folder / "run.csv"), {"scene": scene})
    with listen(HOST, 0) as listening:
        session.start()
        print(address_of(listening, HOST), flush=True)
        app = Noting(Server(Workbench(session, rate)).app(HOST, listening.getsockname()[1]))
        with suppress(KeyboardInterrupt):
            serve(app, listening)
    session.close()
    np.save(folder / "made.npy", source.moments)
    np.save(folder / "sent.npy", app.sent)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
