"""Where the measurement stands: collects the facts, and keeps what the page is told."""

import math
import time
from collections import deque
from collections.abc import Callable, Mapping
from typing import Any

from palpate._core import Touch
from palpate.calibration import Calibration
from palpate.digits import plus_minus
from palpate.live.desk.facts import Facts, Pace, Result
from palpate.live.desk.faults import SILENT_S
from palpate.live.desk.states import view_of
from palpate.live.desk.telling import Teller
from palpate.live.desk.watching import Watch
from palpate.live.session import Session
from palpate.live.summary import page_state
from palpate.recording.recorder import Recorder
from palpate.sentences import advice
from palpate.several import objections
from palpate.sources import Source
from palpate.stream.estimate import StreamCounters

GAP_S = 3.0
"""A gap, or a wrong baseline, is told for this time, and until the baseline is measured again."""
RATE_S, LATE_S = 2.0, 10.0
"""Times over which pairs a second, and late pairs, are counted."""
_LOOK_S = 0.1
_TELLING = ("gap", "baseline", "saturated", "refused")
"""Of several flags these are the cause of the others."""


class Standing:
    """What to do, what is wrong, and what a screen reader says.

    Parameters
    ----------
    session : Session
    calibration : callable, optional
        Returns that in use, or None; for the uncertainty, the modulus, and the flags that it accepts.
    clock : callable
        Seconds that only rise.

    Attributes
    ----------
    next_touch : callable
        Returns name, nth and of of the next touch, or None.
    why : callable
        Returns why the touch of this index is left out, or "".
    about : callable
        Returns a sentence of what goes on beside the measurement, or "".
    watch : Watch
    """

    def __init__(
        self,
        session: Session,
        calibration: Callable[[], Calibration | None] = lambda: None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.next_touch: Callable[[], Mapping[str, Any] | None] = lambda: None
        self.why: Callable[[int, Touch], str] = self._objection
        self.about: Callable[[], str] = str
        self.watch: Watch = Watch(clock)
        self._session, self._calibration, self._clock = session, calibration, clock
        self._number = 0
        self._awake_s = self._looked_s = 0.0
        self._last_recorder: Recorder | None = None  # one that failed is told until the next one begins
        self._shown: tuple[str, str, str] = ("", "", "")
        session.followers.append(self.watch.follow)

    def document(self) -> dict[str, Any]:
        """Return now, line and announce, of the message `state`."""
        facts = self.facts()
        now, line = view_of(facts)
        told = self._teller.tell(now, line, facts.result, self._clock())
        self._shown = self._key(told)
        return told

    def is_news(self) -> bool:
        """Return whether word or line are others than those of the last document."""
        facts = self.facts()
        now, line = view_of(facts)
        return self._key(self._teller.tell(now, line, facts.result, self._clock())) != self._shown

    @staticmethod
    def _key(told: Mapping[str, Any]) -> tuple[str, str, str]:
        return told["now"]["word"], told["line"]["what"], told["announce"]

    def facts(self) -> Facts:
        """Return what is known now."""
        at_s = self._clock()
        if self._number != self._session.number:
            self._begin(at_s)
        session, stream = self._session, self._session.stream
        state, troubles, counters = page_state(session), _troubles(stream.source), stream.counters
        self._follow_gaps(state, troubles, counters, at_s)
        recorder, seen = stream.recorder, self.watch.seen_of(stream)
        if at_s - self._looked_s > SILENT_S and seen.at_s > self._awake_s:
            self._awake_s = at_s  # this process stood still, not the source; once, until there is a sample again
        self._looked_s = at_s
        self._last_recorder = last = recorder or self._last_recorder
        return Facts(
            state,
            seen=seen,
            silent_s=at_s - max(self._awake_s, seen.at_s) if stream.source.live and state != "ended" else 0.0,
            period_s=self._period_s,
            troubles=troubles,
            outside=stream.out_of_range,
            can_centre=can_centre(stream.source),
            full_scale_pF=stream.tracker.settings["full_scale"],
            retaken_s=at_s - self._retaken_s,
            gap_s=at_s - self._gap_s,
            gap=self._gap,
            lost=self._lost,
            cut=self._cut,
            pace=self._pace(at_s, troubles, counters),
            recording=recorder.path.name if recorder and session.running else "",
            recording_error=str(last.error or "") if last else "",
            unrecorded=last.dropped if last and last.error else 0,
            error=session.error,
            result=self._result(),
            next=self.next_touch(),
            about=self.about(),
        )

    def _begin(self, at_s: float) -> None:
        stream = self._session.stream
        self._number, self._awake_s, self._looked_s = self._session.number, at_s, at_s
        self._teller = Teller()
        self._period_s = float(stream.source.describe().get("period_s", math.nan))
        self._gap, self._gap_s, self._retaken_s = "", -math.inf, -math.inf
        self._gaps, self._retaken, self._lost, self._cut = len(stream.source.gaps), 0, 0, 0
        self._before = stream.counters.lost
        self._reads: deque[tuple[float, int, int, int]] = deque()
        self._last_recorder = None
        self._known: tuple[tuple[int, bool, str], Result] | None = None

    def _follow_gaps(self, state: str, troubles: Mapping[str, str], counters: StreamCounters, at_s: float) -> None:
        """Note new gaps and wrong baselines, and forget those that are over."""
        gaps = self._session.stream.source.gaps
        if len(gaps) > self._gaps:
            self._gaps, self._gap, self._gap_s = len(gaps), gaps[-1].text, at_s
        if counters.retaken > self._retaken:
            self._retaken, self._retaken_s = counters.retaken, at_s
        if "unplugged" in troubles:
            pressed = state in ("contact", "adapting")
            self._cut = self._cut or (len(self._session.touches) + 1 if pressed else 0)
        if self._gap_s > -math.inf:
            self._lost = counters.lost - self._before
        elif not troubles:
            self._before, self._cut = counters.lost, 0
        if state != "baseline":
            self._gap_s = self._gap_s if at_s - self._gap_s < GAP_S else -math.inf
            self._retaken_s = self._retaken_s if at_s - self._retaken_s < GAP_S else -math.inf

    def _pace(self, at_s: float, troubles: Mapping[str, str], counters: StreamCounters) -> Pace:
        """Return how fast pairs arrive; it begins again after an interruption."""
        if not self._session.stream.source.live or troubles or self._gap_s > -math.inf:
            self._reads.clear()
            return Pace()
        if not self._reads or at_s - self._reads[-1][0] >= _LOOK_S:
            self._reads.append((at_s, counters.read, counters.late, counters.dropped))
        while at_s - self._reads[0][0] > LATE_S:
            self._reads.popleft()
        first, last = self._reads[0], self._reads[-1]
        recent = next(each for each in self._reads if last[0] - each[0] <= RATE_S)
        long_s = last[0] - recent[0]
        per_s = (last[1] - recent[1]) / long_s if long_s >= RATE_S - 2 * _LOOK_S else math.nan
        return Pace(per_s, 1 / self._period_s, last[1] - first[1], last[2] - first[2], last[3] - first[3])

    def _result(self) -> Result | None:
        """Return the last touch that ended; made anew only if it, or what is thought of it, has changed."""
        touches = self._session.touches
        if not touches:
            return None
        touch, why = touches[-1], self.why(len(touches) - 1, touches[-1])
        key = (len(touches), touch.revised, why)
        if self._known is None or self._known[0] != key:
            swapped = next((text for text in advice(touch) if text.startswith("swapped")), "")
            swapped = swapped.removeprefix("swapped: ")
            flags = objections(touch, self._accepted)
            self._known = key, Result(len(touches), self._text(touch), why, flags, swapped, touch.revised)
        return self._known[1]

    @property
    def _accepted(self) -> tuple[str, ...]:
        calibration = self._calibration()
        return tuple(calibration.accepted) if calibration else ()

    def _objection(self, _: int, touch: Touch) -> str:
        """Return the sentence of the most telling flag that excludes a touch; empty: none does."""
        excluding = objections(touch, self._accepted)
        if not excluding:
            return ""
        flag = next((name for name in _TELLING if name in excluding), excluding[0])
        return next(text for text in advice(touch) if text.startswith(f"{flag}:"))

    def _text(self, touch: Touch) -> str:
        """Return the ratio of a touch, and its modulus if there is a calibration."""
        ratio, error, calibration = touch.ratio, touch.standard_error, self._calibration()
        if not calibration:
            return f"ratio {plus_minus(ratio, error)}"
        text = f"ratio {plus_minus(ratio, calibration.uncertainty(ratio, error))}"
        if not math.isfinite(ratio):
            return text
        modulus = calibration.modulus(ratio, error if math.isfinite(error) else None)
        return f"{text}, modulus {modulus}"


def can_centre(source: Any) -> bool:
    """Return whether a source can set its range again."""
    return getattr(type(source), "centre", Source.centre) is not Source.centre


def _troubles(source: Any) -> Mapping[str, str]:
    found: Mapping[str, str] = getattr(source, "troubles", {})
    return found
