"""The live page in a cell of a notebook."""

import atexit
import os
import time
from contextlib import AbstractContextManager
from threading import Event, Thread
from typing import TYPE_CHECKING, Any, ClassVar, Unpack

from palpate.display.markup import element
from palpate.extras import need

if TYPE_CHECKING:
    from palpate._core import _AnySettings, _Scene
    from palpate.calibration import Calibration
    from palpate.live.app import PageApp
    from palpate.live.measurement import LiveMeasurement
    from palpate.touch import Touches

_HOST = "127.0.0.1"
_UNSEEN_S = 60.0  # a notebook that is loaded again, or scrolled, takes the page away for a moment


def live(
    source: str,
    *,
    scene: "_Scene" = "handheld",
    calibration: "Calibration | None" = None,
    record: str | os.PathLike[str] | None = None,
    height: int = 800,
    **settings: Unpack["_AnySettings"],
) -> "LivePage":
    """Measure, and show the live page of the measurement in the cell.

    The page is served to this machine alone, at a free port, with a token in its address. There is one page at a time:
    the next call, as when the cell is run again, ends the one before. It also ends by `close()`, with the kernel, and a
    minute after the last browser has closed it, unless it is recording.

    Parameters
    ----------
    source : str
        As in `palpate.open`. Files and simulations run in real time unless they have `speed`.
    scene : str
        As in `Tracker`.
    calibration : Calibration, optional
        To show moduli.
    record : path-like, optional
        NAME.csv: record from the start; the button Record continues with NAME-2.csv.
    height : int, pixels
        Of the frame.
    **settings
        As in `Tracker`.

    Returns
    -------
    LivePage
        Its `touches` are those measured so far.

    Raises
    ------
    MissingExtra
        The extra live is not installed.
    ValueError, PalpateError
        As from `Stream`.

    Examples
    --------
    >>> with live("sim:four-specimens") as page:
    ...     print(page.touches)
    []
    """
    for module in ("starlette", "uvicorn", "websockets"):
        need(module, "live")
    from palpate.live.app import PageApp
    from palpate.live.commands import Workbench
    from palpate.live.files import RunFiles
    from palpate.live.measurement import LiveMeasurement, opener

    if LivePage._newest:
        LivePage._newest.close()
    files = RunFiles(None if record is None else os.fspath(record))
    how: dict[str, Any] = {"scene": scene, **settings}
    how = {**calibration.for_tracking(how), **how} if calibration else how
    measurement = LiveMeasurement(opener(source, {}), files, how)
    return LivePage(measurement, PageApp(Workbench(measurement, source, calibration)), source, height)


class LivePage(AbstractContextManager["LivePage"]):
    """A running measurement with its live page; `live` makes it.

    Attributes
    ----------
    address : str
        Of the page, with its token.
    """

    _newest: ClassVar["LivePage | None"] = None

    def __init__(self, measurement: "LiveMeasurement", page: "PageApp", source: str, height: int) -> None:
        from palpate.live.access import new_token
        from palpate.live.server import address_of, listen

        self._measurement, self._page = measurement, page
        measurement.start()
        self._listening, self._token = listen(_HOST, 0), new_token()
        self.address: str = f"{address_of(self._listening, _HOST)}token={self._token}/"
        self._source, self._height = source, height
        self._closing, self._seen_s = Event(), time.monotonic()
        self._thread = Thread(target=self._serve, name="palpate-page", daemon=True)
        self._thread.start()
        LivePage._newest = self
        atexit.register(self.close)

    @property
    def touches(self) -> "Touches":
        """The touches that have ended so far, in order of time."""
        from palpate.touch import Touches

        return Touches(self._measurement.touches)

    @property
    def running(self) -> bool:
        """Whether the page is served."""
        return self._thread.is_alive()

    def close(self) -> None:
        """End the measurement, close its recording, and serve the page no more."""
        atexit.unregister(self.close)
        self._closing.set()
        self._thread.join()

    def __exit__(self, *_: object) -> None:
        """Close it."""
        self.close()

    def __repr__(self) -> str:
        """Return the source and the address."""
        return f"<live page of {self._source}: {self.address if self.running else 'closed'}>"

    def _repr_html_(self) -> str:
        if not self.running:
            return element("p", repr(self))
        title, may = f"live page of {self._source}", "allow-scripts allow-same-origin allow-downloads"
        style = "width:100%;border:0"  # `may`: the page cannot open another one in place of the notebook
        return element("iframe", src=self.address, title=title, height=self._height, sandbox=may, style=style)

    def _serve(self) -> None:
        from palpate.live.server import serve

        app = self._page.app(_HOST, self._listening.getsockname()[1], self._token, framed=True)
        try:
            serve(app, self._listening, self._ended)
        finally:
            self._listening.close()
            self._measurement.close()

    def _ended(self) -> bool:
        now = time.monotonic()
        if self._page.pages or self._measurement.stream.recorder:
            self._seen_s = now
        return self._closing.is_set() or now - self._seen_s > _UNSEEN_S
