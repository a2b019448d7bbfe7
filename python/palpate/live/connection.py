"""The state of a measurement over time: collects the inputs, steadies the line, and says what a screen reader reads."""

import math
import time
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import replace

from palpate.flags import Flag, Suspicion, advice
from palpate.live.channel_status import SignalFollower
from palpate.live.instruction_rules import (
    SILENT_S,
    LastTouch,
    PairRate,
    StatusInputs,
    StatusLine,
    slow,
    view_of,
)
from palpate.live.judged import JudgedChannels
from palpate.live.measurement import LiveMeasurement
from palpate.live.plan import TouchPlan
from palpate.live.protocol import Instruction, NextTouch, ShownLine, StatusState
from palpate.live.source_watch import SourceWatch
from palpate.live.touch_rows import TouchTable
from palpate.sources import Conditions, Gap, Source, TroubleBegan, TroubleEnded, TroubleKind
from palpate.stream import Listener, Stream, StreamCounters
from palpate.touch import Touch

GAP_S = 3.0  # a gap, or a wrong baseline, is shown for this time, and until the baseline is measured again
RATE_S = 2.0  # pairs a second are known from then on
LATE_S = 10.0  # they, and late pairs, are counted over this time
HOLD_S = 3.0  # a line whose cause may come and go stays for this time after it
SETTLED_S = 1.0  # what stays for this time is announced; a fault, and the end of a touch, at once
_LOOK_S = 0.1
_SETTLED_S = {"done": 0.0, "left out": 0.0, "after": 3.0}
_COMES_AND_GOES = {"silent", "wiring", "constant", "unwired", "range"}
_BEGINS = StatusState(
    Instruction("Wait", "the measurement begins"), ShownLine("quiet", "", "", None, "begins"), ""
)
_CONTACT = ("contact", "adapting")


def _no_doubt() -> str:
    """Return no doubt about a calibration."""
    return ""


class ConnectionState(Listener):
    """What to do, what is wrong, and what a screen reader reads, as of the last `look`.

    `clock`: seconds that only rise. `inputs`: what the last look found.
    """

    def __init__(
        self,
        measurement: LiveMeasurement,
        plan: TouchPlan,
        table: TouchTable,
        clock: Callable[[], float] = time.monotonic,
        watch: SourceWatch | None = None,
    ) -> None:
        self._measurement = measurement
        self._plan = plan
        self._table = table
        self._clock = clock
        self._watch = watch
        self.calibration_doubt: Callable[[], str] = _no_doubt
        # when the computer was found to be slow; -inf: that was understood, or is over
        self._slow_s = math.inf
        self._signal = SignalFollower(measurement, clock)
        self._judged = JudgedChannels(measurement, clock)
        self.inputs: StatusInputs = StatusInputs("baseline")
        self._status = _BEGINS
        measurement.listeners += [self._signal, self._judged, self]

    def document(self) -> StatusState:
        """Return what to do, the line, the announcement, and the specimen of the running touch."""
        return self._status

    def look(self) -> bool:
        """Look at the measurement; return whether word, line or announcement are other ones than before."""
        inputs = self._inputs()
        if slow(inputs) and not inputs.slow_is_known:
            self._slow_s = self._clock()
        elif self._clock() - self._slow_s > HOLD_S:  # once
            self.understood()
        instruction, line = view_of(inputs)
        before = self._status
        shown = self._steady.show(instruction, line, inputs.result, self._clock())
        contact_s = self._signal.seen.contact_s
        on = None
        if contact_s:
            on = self._plan.progress.on(self._measurement.last_s - contact_s)
        self.inputs = inputs
        self._status = StatusState(shown.now, shown.line, shown.announce, on)
        return _key(self._status) != _key(before)

    def understood(self) -> None:
        """Do not show any more that the computer is slow."""
        self._slow_s = -math.inf

    def begun(self, stream: Stream) -> None:
        """Begin with the next measurement."""
        now_s = self._clock()
        self._awake_s = now_s
        self._looked_s = now_s
        self._steady = SteadyLine()
        self._period_s = float(stream.source.describe().get("period_s", math.nan))
        self._fastest_s = stream.source.fastest_period_s
        if math.isnan(self._fastest_s):
            self._fastest_s = self._period_s
        self._gap = ""
        self._gap_s = -math.inf
        self._retaken_s = -math.inf
        self._retaken = 0
        self._lost = 0
        self._cut = 0
        self._lost_before = 0
        self._troubles: dict[TroubleKind, str] = {}
        self.measured_conditions: list[Conditions] = []
        self._reads: deque[tuple[float, StreamCounters]] = deque()
        self._known: tuple[tuple[int, bool, str], LastTouch] | None = None

    def gap(self, gap: Gap) -> None:
        """Show a gap for a while."""
        self._gap = gap.text or "gap"
        self._gap_s = self._clock()

    def trouble_began(self, trouble: TroubleBegan) -> None:
        """Keep a trouble until it ends."""
        self._troubles[trouble.kind] = trouble.text

    def trouble_ended(self, trouble: TroubleEnded) -> None:
        """Forget a trouble."""
        self._troubles.pop(trouble.kind, None)

    def conditions(self, conditions: Conditions) -> None:
        """Keep measured conditions."""
        self.measured_conditions.append(conditions)

    def _inputs(self) -> StatusInputs:
        """Return what is known now, and follow what depends on the time."""
        at_s = self._clock()
        measurement = self._measurement
        stream = measurement.stream
        source = stream.source
        state = measurement.state
        counters = stream.counters
        troubles = dict(self._troubles)
        self._follow_gaps(state, troubles, counters, at_s)
        silent_s = self._silent_s(at_s)
        if not source.live or state == "ended":
            silent_s = 0.0
        found = StatusInputs(
            state,
            seen=self._signal.seen,
            silent_s=silent_s,
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
            error=measurement.error,
            forced=measurement.forced,
            result=self._result(),
            next=self._next(state),
            finished=self._plan.finished(),
            doubt=self.calibration_doubt(),
            slow_is_known=self._slow_s == -math.inf,
        )
        if self._watch:
            found = replace(found, uncalibrated=self._watch.refused)
        return self._with_recording(found)

    def _with_recording(self, inputs: StatusInputs) -> StatusInputs:
        """Return the inputs with what is known of the recording."""
        newest = self._measurement.newest_recorder
        if newest:
            error = str(newest.error or "")
            inputs = replace(inputs, recording_error=error, unrecorded=newest.dropped)
        recorder = self._measurement.recorder
        if recorder:
            inputs = replace(
                inputs,
                recording=recorder.path.name,
                rows_wait=recorder.rows_trouble,
                notes_wait=recorder.sidecar_trouble,
            )
        return inputs

    def _silent_s(self, at_s: float) -> float:
        """Return for how long no pair has come while this process ran, s."""
        seen_s = self._signal.seen.at_s
        if at_s - self._looked_s > SILENT_S and seen_s > self._awake_s:
            self._awake_s = at_s  # this process stood still, not the source; once, until there is a sample again
        self._looked_s = at_s
        if self._measurement.hand and self._measurement.hand.is_waiting:
            self._awake_s = at_s
        return at_s - max(self._awake_s, seen_s)

    def _next(self, state: str) -> NextTouch | None:
        """Return the next touch; in a touch: the one that it is."""
        begun_s = self._measurement.last_s - self._signal.seen.contact_s
        if state in _CONTACT and self._plan.progress.since_s > begun_s:
            # the list was changed during this touch, which is on what was next before
            return None
        following = self._plan.document.next
        if state in _CONTACT and following:
            touched = self._plan.progress.on(begun_s)
            if touched and touched != following.name:  # another one is pressed on the page
                return None
        return following

    def _follow_gaps(
        self, state: str, troubles: Mapping[TroubleKind, str], counters: StreamCounters, at_s: float
    ) -> None:
        """Note wrong baselines and what is lost at a gap, and forget those that are over."""
        if counters.retaken > self._retaken:
            self._retaken = counters.retaken
            self._retaken_s = at_s
        if TroubleKind.UNPLUGGED in troubles and state in _CONTACT:
            self._cut = self._cut or len(self._measurement.touches) + 1
        if self._gap:
            self._lost = counters.lost - self._lost_before
        elif not troubles and not counters.waiting:  # no gap is on its way
            self._lost_before = counters.lost
            self._cut = 0
        if state == "baseline":
            return
        if at_s - self._gap_s >= GAP_S:
            self._gap = ""
        if at_s - self._retaken_s >= GAP_S:
            self._retaken_s = -math.inf

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
        read = counters.read - before.read
        long_s = at_s - since_s
        # not by an error of the board
        refused = counters.refused - before.refused - (counters.errors - before.errors)
        used = 1 - max(refused, 0) / max(read, 1)
        per_s = math.nan
        if long_s >= RATE_S:
            per_s = read / long_s * used
        nominal_per_s = 1 / self._fastest_s
        dropped = counters.dropped - before.dropped
        return PairRate(per_s, nominal_per_s, nominal_per_s * long_s, dropped)

    def _result(self) -> LastTouch | None:
        """Return the last touch that ended; made anew only if it, or what is thought of it, has changed."""
        touches = self._measurement.touches
        rows = self._plan.rows
        number = min(len(touches), len(rows))  # the plan may lack the newest one yet
        if not number:
            return None
        touch = touches[number - 1]
        why = rows[number - 1].why
        key = (number, touch.revised, why)
        if self._known is None or self._known[0] != key:
            self._known = (key, self._last_touch(number, touch, why))
        return self._known[1]

    def _last_touch(self, number: int, touch: Touch, why: str) -> LastTouch:
        texts = {each.flag: each.text for each in advice(touch)}
        against = self._plan.progress.objections(touch)
        late = ""
        if Flag.LATE in touch.flags:
            seconds = self._measurement.tracker.settings.get("seconds")
            of = ""
            if seconds and self._period_s > 0:
                wanted = round(seconds / self._period_s)
                of = f" of {max(wanted, touch.samples)}"
            late = f"late: {touch.samples}{of} pairs"
        return LastTouch(
            number,
            self._table.result(touch),
            why,
            tuple(each for each in against if isinstance(each, Flag)),
            texts.get(Suspicion.SWAPPED, ""),
            touch.revised,
            late,
            self._table.known(touch),
        )


class SteadyLine:
    """Keeps the line and the announcement of one measurement: no flicker, and only what has settled is announced."""

    def __init__(self) -> None:
        self._line: StatusLine | None = None
        self._began_s = 0.0
        self._caused_s = 0.0
        # of a screen reader: the word, the line, the last result
        self._announced = ("", "", "")
        self._pending = ("", "", "")
        self._since_s = -math.inf
        self._announce = ""

    def show(
        self, instruction: Instruction, line: StatusLine, result: LastTouch | None, at_s: float
    ) -> StatusState:
        """Return instruction, line and announcement at a time, s, that only rises."""
        line = self._steady(line, at_s)
        self._settle(instruction, line, result, at_s)
        since_s = None
        if line.level != "quiet":
            since_s = round(at_s - self._began_s, 1)
        return StatusState(instruction, line.shown(since_s), self._announce)

    def _steady(self, line: StatusLine, at_s: float) -> StatusLine:
        """Return this line, or the one before if its cause comes and goes and nothing else is wrong."""
        held = self._line
        calm = line.level in ("quiet", "note")
        if held and held.what == line.what:
            self._caused_s = at_s
        elif held and held.what in _COMES_AND_GOES and calm and at_s - self._caused_s < HOLD_S:
            return held
        else:
            self._began_s = at_s
            self._caused_s = at_s
        self._line = line
        return line

    def _settle(
        self, instruction: Instruction, line: StatusLine, result: LastTouch | None, at_s: float
    ) -> None:
        """Announce what has settled and is new."""
        ended = ""
        if result and not result.why:
            ended = f"{result.number}: {result.text}"
        present = (instruction.word, line.what, ended)
        if present != self._pending:
            self._pending = present
            self._since_s = at_s
        least_s = 0.0
        if line.level != "fault":
            least_s = _SETTLED_S.get(line.what, SETTLED_S)
        if present == self._announced or at_s - self._since_s < least_s:
            return
        word, what, before = self._announced
        sentences = []
        if result and ended not in ("", before):
            revised = ", revised" if result.revised else ""
            sentences.append(f"Touch {result.number}{revised}: {result.text}.")
        if instruction.word != word:
            sentences.append(f"{instruction.word}.")
        if line.what != what:
            sentences.append(f"{line.title} {line.spoken or line.text}")
        self._announce = " ".join(" ".join(sentences).split()) or self._announce
        self._announced = present


def can_centre(source: Source) -> bool:
    """Return whether a source can set its range again."""
    return type(source).centre is not Source.centre


def _key(status: StatusState) -> tuple[str, str, str]:
    return (status.now.word, status.line.what, status.announce)
