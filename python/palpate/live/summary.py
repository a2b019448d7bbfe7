"""The state of the measurement for the page, without the samples: plain values, ready for JSON."""

import math
import time
from collections import deque
from collections.abc import Callable, Collection, Sequence
from datetime import UTC, datetime
from typing import Any

from palpate import __version__
from palpate._core import Touch
from palpate.calibration import Calibration
from palpate.live.review import Review
from palpate.live.session import Session
from palpate.sentences import advice
from palpate.several import TOUCH_SCATTER, Agreement, agreement, most_reliable

_RATE_S = 2.0  # pairs per second: mean over this time
_SHOWN = 200  # the newest touches
_UNKNOWN = {"specimen": None, "deviation": None, "kept": True, "why": ""}
STATES = {"baseline": "baseline", "waiting": "no contact", "done": "done", "ended": "ended"}


class Summary:
    """Summarises a session for the page.

    Parameters
    ----------
    session : Session or Review
    calibration : Calibration, optional
        To show moduli, and for the scatter from touch to touch.
    scatter : float
        Relative scatter from touch to touch without a calibration, for the question whether touches agree.

    Attributes
    ----------
    known : callable
        Returns for each touch its specimen, its deviation, whether it is kept, and why not.
    """

    def __init__(
        self, session: Session | Review, calibration: Calibration | None = None, scatter: float = TOUCH_SCATTER
    ) -> None:
        self.known: Callable[[], Sequence[dict[str, Any]]] = tuple  # the same as long as nothing changes
        self._session, self._calibration, self._scatter = session, calibration, scatter
        self._reads: deque[tuple[float, int]] = deque()
        self._measurement = 0
        self._rows: list[dict[str, Any]] = []
        self._told: tuple[tuple[Any, ...], dict[str, Any]] | None = None

    @property
    def calibration(self) -> Calibration | None:
        """The calibration in use; a new one holds for all touches."""
        return self._calibration

    @calibration.setter
    def calibration(self, calibration: Calibration | None) -> None:
        self._calibration, self._rows = calibration, []

    @property
    def accepted(self) -> Collection[str]:
        """Flags that do not exclude a touch."""
        return self._calibration.accepted if self._calibration else frozenset()

    def instrument(self, source: str) -> dict[str, Any]:
        """Return the values that do not change during a measurement."""
        tracker, device = self._session.stream.tracker, self._session.stream.source.describe()
        origin_s = self._session.levels.span and self._session.levels.span[0]
        return {
            "measurement": self._session.number,
            "kind": self._session.kind,
            "file": self._session.file,
            "version": __version__,
            "origin_s": origin_s,
            "utc": self._utc(origin_s),
            "samples": tracker.settings.get("samples"),
            "seconds": tracker.settings.get("seconds"),
            "source": source,
            "device": _name(device),
            "scene": tracker.scene,
            "threshold": tracker.settings.get("threshold"),
            "statistic_unit": "pF" if tracker.scene == "paper" else "",
            "calibrated": self._calibration is not None,
            "scatter": self._calibration.touch_spread if self._calibration else None,
        }

    def now(self) -> dict[str, Any]:
        """Return the values that change during a measurement."""
        session = self._session
        moment = session.moment
        measured = moment.state in ("contact", "done")
        ratio, error = (moment.ratio, moment.standard_error) if measured else (math.nan, math.nan)
        self._begin_again()
        return {
            "state": page_state(session),
            "end_s": session.levels.span and session.levels.span[1],
            "ratio": ratio,
            "standard_error": error,
            "uncertainty": self._uncertainty(ratio, error),
            "modulus": self._modulus(ratio, error),
            "pairs_per_s": self._rate(session.counters.read),
            "counters": session.counters.as_dict(),
            "messages": session.messages,
            "error": session.error,
        }

    def touches(self) -> dict[str, Any]:
        """Return a row for each completed touch; whether they agree; the number of the most reliable one if they do."""
        self._begin_again()
        found, known = self._session.touches, self.known()
        of = (found, known, self._calibration)
        if self._told is None or any(one is not other for one, other in zip(self._told[0], of, strict=True)):
            self._told = of, self._touches_of(found, known)
        return self._told[1]

    def _touches_of(self, found: list[Touch], known: Sequence[dict[str, Any]]) -> dict[str, Any]:
        for number, touch in enumerate(found):
            if number >= len(self._rows):
                self._rows.append(self._row(number, touch))
            elif self._rows[number]["revised"] != touch.revised:
                self._rows[number] = self._row(number, touch)
        alike = _on_the_last(found, known)
        together = self._together(alike)
        best = found.index(self._most_reliable(alike)) + 1 if together and together.agree else None
        rows = [{**row, **more} for row, more in zip(self._rows, [*known, *[_UNKNOWN] * len(found)], strict=False)]
        return {"rows": rows[-_SHOWN:], "most_reliable": best, "together": self._words(together)}

    def _begin_again(self) -> None:
        if self._measurement != self._session.number:
            self._measurement = self._session.number
            self._reads.clear()
            self._rows = []

    def _utc(self, origin_s: float | None) -> str | None:
        """Return the time of the first sample by the wall clock, as ISO 8601."""
        zero_ns = self._session.zero_utc_ns
        if origin_s is None or zero_ns is None:
            return None
        return datetime.fromtimestamp(zero_ns * 1e-9 + origin_s, UTC).isoformat(timespec="milliseconds")

    def _row(self, number: int, touch: Touch) -> dict[str, Any]:
        ratio, error = touch.ratio, touch.standard_error
        more = {"uncertainty": self._uncertainty(ratio, error), "modulus": self._modulus(ratio, error)}
        end_s = self._session.ends.get(number + 1)
        return {"number": number + 1, **touch.as_dict(), "end_s": end_s, **more, "advice": advice(touch)}

    def _uncertainty(self, ratio: float, error: float) -> float | None:
        """Return the standard deviation of a ratio, with the scatter from touch to touch if it is known."""
        known = self._calibration.uncertainty(ratio, error) if self._calibration else error
        return known if math.isfinite(known) else None

    def _together(self, touches: list[Touch]) -> Agreement | None:
        """Return whether the touches agree; None if none is usable."""
        try:
            if self._calibration:
                return self._calibration.agreement(touches)
            return agreement(touches, scatter=self._scatter)
        except ValueError:
            return None

    def _most_reliable(self, touches: list[Touch]) -> Touch:
        return most_reliable(touches, scatter=None, accept=self.accepted)

    def _words(self, found: Agreement | None) -> dict[str, Any] | None:
        """Return whether two touches or more agree, with the modulus of their mean; None for fewer."""
        if found is None or found.touches < 2:
            return None
        modulus = None
        if self._calibration and found.agree:
            modulus = self._calibration.modulus(found.ratio, found.own_error, touches=found.effective).as_dict()
        return {**found.as_dict(), "modulus": modulus}

    def _modulus(self, ratio: float, error: float) -> dict[str, Any] | None:
        if self._calibration is None or not math.isfinite(ratio):
            return None
        return self._calibration.modulus(ratio, error if math.isfinite(error) else None).as_dict()

    def _rate(self, read: int) -> float:
        """Return pairs per second; nan until it is known."""
        now = time.monotonic()
        self._reads.append((now, read))
        while now - self._reads[0][0] > _RATE_S and len(self._reads) > 2:
            self._reads.popleft()
        then, before = self._reads[0]
        return (read - before) / (now - then) if now > then else math.nan


def page_state(session: Session | Review) -> str:
    """Return the state of a measurement as the page names it."""
    moment = session.moment
    if moment.state != "contact":
        return STATES[moment.state]
    knows = session.stream.tracker.scene in ("handheld", "sliding")
    return "adapting" if moment.alarm or (knows and math.isnan(moment.standard_error)) else "contact"


def _on_the_last(touches: list[Touch], known: Sequence[dict[str, Any]]) -> list[Touch]:
    """Return the touches that are kept, on the same specimen as the last one; all, if nothing else is known."""
    here = known[: len(touches)]
    specimen = here[-1]["specimen"] if here else None
    kept = [touch for touch, row in zip(touches, here, strict=False) if row["kept"] and row["specimen"] == specimen]
    return kept + touches[len(here) :]


def _name(device: dict[str, Any]) -> str:
    inner = device.get("device")
    told = inner if isinstance(inner, dict) else device
    return ", ".join(str(told[key]) for key in ("name", "file") if key in told)
