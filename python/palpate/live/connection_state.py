"""The state of a measurement over time: collects the facts, steadies the line, and says what a screen reader reads."""

import math
import time
from collections import deque
from collections.abc import Callable, Mapping
from typing import Any

from palpate.flags import Flag, Suspicion, advice
from palpate.live.feed import Document
from palpate.live.judged import JudgedChannels
from palpate.live.measurement import LiveMeasurement
from palpate.live.plan import TouchPlan
from palpate.live.signal_state import SignalFollower
from palpate.live.source_watch import SourceWatch
from palpate.live.state_rules import (
    SILENT_S,
    Facts,
    LastTouch,
    Now,
    PairRate,
    StatusLine,
    slow,
    view_of,
)
from palpate.live.touch_rows import TouchTable
from palpate.sources import Conditions, Gap, Source, TroubleBegan, TroubleEnded, TroubleKind
from palpate.stream import Listener, Stream, StreamCounters

GAP_S = 3.0  # a gap, or a wrong baseline, is shown for this time, and until the baseline is measured again
# pairs a second are known from then on; they, and late pairs, are counted over this time
RATE_S, LATE_S = (2.0, 10.0)
HOLD_S = 3.0  # a line whose cause may come and go stays for this time after it
SETTLED_S = 1.0  # what stays for this time is announced; a fault, and the end of a touch, at once
_LOOK_S = 0.1
_SETTLED_S = {"done": 0.0, "left out": 0.0, "after": 3.0}
_COMES_AND_GOES = {"silent", "wiring", "constant", "unwired", "range"}


class ConnectionState(Listener):
    """What to do, what is wrong, and what a screen reader reads. `clock`: seconds that only rise."""

    def __init__(
        self,
        measurement: LiveMeasurement,
        plan: TouchPlan,
        table: TouchTable,
        clock: Callable[[], float] = time.monotonic,
        watch: SourceWatch | None = None,
    ) -> None:
        self._measurement, self._plan, self._table, self._clock = measurement, plan, table, clock
        self._watch = watch
        # when the computer was found to be slow; -inf: that was understood, or is over
        self._slow_s = math.inf
        self._signal = SignalFollower(measurement, clock)
        self._judged = JudgedChannels(measurement, clock)
        self._shown: list[str] = []
        measurement.listeners += [self._signal, self._judged, self]

    def document(self) -> Document:
        """Return now, line, announce and `on`, what the running touch will be stored with, of the message `state`."""
        shown = self._look()
        self._shown = _key(shown)
        contact_s, last_s = self._signal.seen.contact_s, self._measurement.last_s
        return {**shown, "on": self._plan.progress.on(last_s - contact_s) if contact_s else None}

    def is_news(self) -> bool:
        """Return whether word or line differ from the last document."""
        return _key(self._look()) != self._shown

    def _look(self) -> Document:
        facts = self.facts()
        if not facts.slow_told and slow(facts):
            self._slow_s = self._clock()
        elif self._clock() - self._slow_s > HOLD_S:  # once
            self.understood()
        return self._steady.show(*view_of(facts), facts.result, self._clock())

    def understood(self) -> str:
        """Say no more that the computer is slow; return the message."""
        self._slow_s = -math.inf
        return ""

    def begun(self, stream: Stream) -> None:
        """Begin with the next measurement."""
        self._awake_s = self._looked_s = self._clock()
        self._steady = SteadyLine()
        self._period_s = float(stream.source.describe().get("period_s", math.nan))
        self._gap, self._gap_s, self._retaken_s = "", -math.inf, -math.inf
        self._retaken = self._lost = self._cut = self._before = 0
        self._troubles: dict[TroubleKind, str] = {}
        self.measured_conditions: list[Conditions] = []
        self._reads: deque[tuple[float, StreamCounters]] = deque()
        self._known: tuple[tuple[int, bool, str], LastTouch] | None = None

    def gap(self, gap: Gap) -> None:
        """Show a gap for a while."""
        self._gap, self._gap_s = gap.text or "gap", self._clock()

    def trouble_began(self, trouble: TroubleBegan) -> None:
        """Keep a trouble until it ends."""
        self._troubles[trouble.kind] = trouble.text

    def trouble_ended(self, trouble: TroubleEnded) -> None:
        """Forget a trouble."""
        self._troubles.pop(trouble.kind, None)

    def conditions(self, conditions: Conditions) -> None:
        """Keep measured conditions."""
        self.measured_conditions.append(conditions)

    def facts(self) -> Facts:
        """Return what is known now."""
        at_s, measurement, stream, seen = (
            self._clock(),
            self._measurement,
            self._measurement.stream,
            self._signal.seen,
        )
        source, state, counters = stream.source, measurement.state, stream.counters
        troubles = dict(self._troubles)
        self._follow_gaps(state, troubles, counters, at_s)
        if at_s - self._looked_s > SILENT_S and seen.at_s > self._awake_s:
            self._awake_s = at_s  # this process stood still, not the source; once, until there is a sample again
        self._looked_s = at_s
        last, recorder = measurement.newest_recorder, measurement.recorder
        pressed, last_s, following = (
            measurement.pressed,
            measurement.last_s,
            self._plan.document["next"],
        )
        if (
            state in ("contact", "adapting")
            and self._plan.progress.since_s > last_s - seen.contact_s
        ):
            following = (
                None  # the list was changed during this touch, which is on what was next before
            )
        rows_wait, notes_wait, unrecorded = "", "", 0
        if last:
            unrecorded = last.dropped
        if recorder:
            rows_wait = recorder.rows_trouble
            notes_wait = recorder.sidecar_trouble
        return Facts(
            state,
            seen=seen,
            silent_s=at_s - max(self._awake_s, seen.at_s)
            if source.live and state != "ended"
            else 0.0,
            period_s=self._period_s,
            troubles={kind.value: text for kind, text in troubles.items()},
            judged=self._judged.lasting,
            news=self._judged.news,
            outside=stream.out_of_range,
            can_centre=can_centre(source),
            full_scale_pF=stream.tracker.settings["full_scale"],
            retaken=self._retaken_s > -math.inf,
            gap=self._gap,
            lost=self._lost,
            cut=self._cut,
            pace=self._pace(at_s, counters, steady=source.live and not troubles),
            recording=recorder.path.name if recorder else "",
            recording_error=str(last.error or "") if last else "",
            rows_wait=rows_wait,
            notes_wait=notes_wait,
            unrecorded=unrecorded,
            error=measurement.error,
            uncalibrated=self._watch.refused if self._watch else "",
            forced=measurement.forced,
            result=self._result(),
            next=following,
            finished=self._plan.finished(),
            slow_told=self._slow_s == -math.inf,
            hand=(pressed(last_s), pressed(last_s, 1)) if measurement.demo else None,
        )

    def _follow_gaps(
        self, state: str, troubles: Mapping[TroubleKind, str], counters: StreamCounters, at_s: float
    ) -> None:
        """Note wrong baselines and what is lost at a gap, and forget those that are over."""
        if counters.retaken > self._retaken:
            self._retaken, self._retaken_s = counters.retaken, at_s
        if TroubleKind.UNPLUGGED in troubles and state in ("contact", "adapting"):
            self._cut = self._cut or len(self._measurement.touches) + 1
        if self._gap:
            self._lost = counters.lost - self._before
        elif not troubles and not counters.waiting:  # no gap is on its way
            self._before, self._cut = counters.lost, 0
        if state != "baseline":
            self._gap = self._gap if at_s - self._gap_s < GAP_S else ""
            self._retaken_s = self._retaken_s if at_s - self._retaken_s < GAP_S else -math.inf

    def _pace(self, at_s: float, counters: StreamCounters, *, steady: bool) -> PairRate:
        """Return how fast pairs arrive; after an interruption, when pairs come together, counted anew."""
        if not steady or self._gap:
            self._reads.clear()
            return PairRate()
        if not self._reads or at_s - self._reads[-1][0] >= _LOOK_S:
            self._reads.append((at_s, counters))
        while at_s - self._reads[0][0] > LATE_S:
            self._reads.popleft()
        since_s, before = self._reads[0]
        read, long_s = counters.read - before.read, at_s - since_s
        per_s = read / long_s if long_s >= RATE_S else math.nan
        # not by an error of the board
        refused = counters.refused - before.refused - (counters.errors - before.errors)
        share = 1 - max(refused, 0) / max(read, 1)
        return PairRate(per_s * share, 1 / self._period_s, read, counters.dropped - before.dropped)

    def _result(self) -> LastTouch | None:
        """Return the last touch that ended; made anew only if it, or what is thought of it, has changed."""
        touches, rows = self._measurement.touches, self._plan.rows
        if not (number := min(len(touches), len(rows))):  # the plan may lack the newest one yet
            return None
        touch, why = touches[number - 1], str(rows[number - 1]["why"])
        key = (number, touch.revised, why)
        if self._known is None or self._known[0] != key:
            texts = {each.flag: each.text for each in advice(touch)}
            swapped = texts.get(Suspicion.SWAPPED, "")
            against = self._plan.progress.objections(touch)
            flags = tuple(each for each in against if isinstance(each, Flag))
            seconds = self._measurement.tracker.settings.get("seconds")
            of = f" of {seconds / self._period_s:.0f}" if seconds and self._period_s > 0 else ""
            late = f"late: {touch.samples}{of} pairs" if Flag.LATE in touch.flags else ""
            known = self._table.known(touch)
            text = self._table.result(touch)
            self._known = (
                key,
                LastTouch(number, text, why, flags, swapped, touch.revised, late, known),
            )
        return self._known[1]


class SteadyLine:
    """Keeps the line and the announcement of one measurement: no flicker, and only what has settled is announced."""

    def __init__(self) -> None:
        self._line: StatusLine | None = None
        self._began_s = self._caused_s = 0.0
        # of a screen reader: the word, the line, the last result
        self._heard = self._pending = ("", "", "")
        self._since_s = -math.inf
        self._announce = ""

    def show(self, now: Now, line: StatusLine, result: LastTouch | None, at_s: float) -> Document:
        """Return now, line and announce at a time, s, that only rises."""
        line = self._steady(line, at_s)
        self._listen(now, line, result, at_s)
        since_s = None if line.level == "quiet" else round(at_s - self._began_s, 1)
        return {"now": now._asdict(), "line": line.as_dict(since_s), "announce": self._announce}

    def _steady(self, line: StatusLine, at_s: float) -> StatusLine:
        """Return this line, or the one before if its cause comes and goes and nothing else is wrong."""
        held, calm = self._line, line.level in ("quiet", "note")
        if held and held.what == line.what:
            self._caused_s = at_s
        elif held and held.what in _COMES_AND_GOES and calm and at_s - self._caused_s < HOLD_S:
            return held
        else:
            self._began_s = self._caused_s = at_s
        self._line = line
        return line

    def _listen(self, now: Now, line: StatusLine, result: LastTouch | None, at_s: float) -> None:
        """Announce what has settled and is new."""
        ended = f"{result.number}: {result.text}" if result and not result.why else ""
        heard = now.word, line.what, ended
        if heard != self._pending:
            self._pending, self._since_s = heard, at_s
        least_s = 0.0 if line.level == "fault" else _SETTLED_S.get(line.what, SETTLED_S)
        if heard == self._heard or at_s - self._since_s < least_s:
            return
        word, what, before = self._heard
        told = []
        if result and ended not in ("", before):
            told.append(
                f"Touch {result.number}{', revised' if result.revised else ''}: {result.text}."
            )
        if now.word != word:
            told.append(f"{now.word}.")
        if line.what != what:
            told.append(f"{line.title} {line.said or line.text}")
        self._announce = " ".join(" ".join(told).split()) or self._announce
        self._heard = heard


def can_centre(source: Any) -> bool:
    """Return whether a source can set its range again."""
    return getattr(type(source), "centre", Source.centre) is not Source.centre


def _key(shown: Mapping[str, Any]) -> list[str]:
    return [shown["now"]["word"], shown["line"]["what"], shown["announce"]]
