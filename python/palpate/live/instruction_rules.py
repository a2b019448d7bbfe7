"""What to do, and what is wrong: rules from the inputs of a moment to a word and a line, the most urgent rule first."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

from palpate import number_format
from palpate.flags import Flag
from palpate.judgements import Judgement
from palpate.live.channel_status import ChannelSeen, SignalSeen
from palpate.live.protocol import Instruction, NextTouch, ReviewedFile, ShownLine, StatusState
from palpate.uncertainty import Uncertainty

RELEASED_S = 0.3  # a channel shows no press for this time while the other one is at its limit
LIMIT_S = 0.1  # in contact a channel may be at its limit for this time
BELOW_S = 1.0  # a channel is far below its baseline for this time before the page says it
LONG_S = 10.0  # the probe is left in contact after a touch for this time before the page says it
# without a pair for this time, and for so many periods, a measurement is silent
SILENT_S = 1.0
SILENT_PERIODS = 10
CONSTANT_S = 1.0  # a channel has the same value for this time before the page says it
SLOW_SHARE = 0.9  # too slow: below this part of the rate
FEWEST = 50  # pairs, to know the rate
DAMAGED = {
    "changed": "This recording was changed.",
    "not complete": "This recording is not complete.",
}
"""What `Verification.verdict` says of a recording that is not as it was made."""


class StatusLine(NamedTuple):
    """The status line. Screen readers get `spoken` instead of changing numbers."""

    what: str  # a key
    level: str  # quiet, note, caution or fault
    title: str
    text: str
    spoken: str = ""

    def shown(self, since_s: float | None) -> ShownLine:
        """Return what the page gets; `since_s`: for how long it is shown."""
        return ShownLine(self.level, self.title, self.text, since_s, self.what)


View = tuple[
    StatusLine, Instruction | None
]  # a line, and what to do; None: what one would do without it


@dataclass(frozen=True)
class LastTouch:
    """The last touch that ended."""

    number: int  # from 1
    text: str  # ratio with its uncertainty; with a calibration the modulus, too
    why: str = ""  # it is left out; empty: it is kept
    flags: tuple[Flag, ...] = ()  # that exclude it
    swapped: str = ""  # the sentence if the inputs seem to be exchanged
    revised: bool = False
    late: str = ""  # how many of its pairs came, where the computer lost many
    known: Uncertainty | None = None


@dataclass(frozen=True)
class PairRate:
    """How many pairs arrive that can be used, a second, now and on a computer that is never late; counts of the last seconds."""

    per_s: float = math.nan
    nominal_per_s: float = math.nan
    expected: float = 0.0
    dropped: int = 0


@dataclass(frozen=True)
class StatusInputs:
    """What is known of a measurement at one moment."""

    state: str  # of the page: baseline, no contact, contact, adapting, done or ended
    seen: SignalSeen = field(default_factory=SignalSeen)
    silent_s: float = 0.0  # since the last pair
    period_s: float = math.nan
    troubles: Mapping[str, str] = field(default_factory=dict)  # of the source: kind -> sentence
    judged: tuple[Judgement, ...] = ()  # of the channels, and it still holds
    news: Judgement | None = None  # what was judged a short time ago
    outside: tuple[str, ...] = ()  # channels outside the range of the converter without a touch
    can_centre: bool = False  # the source can set its range
    full_scale_pF: float = math.inf
    retaken: bool = False  # the baseline was found to be wrong a short time ago
    gap: str = ""  # what happened at a gap a short time ago
    lost: int = 0  # pairs at it
    cut: int = 0  # number of the touch that it cut
    pace: PairRate = field(default_factory=PairRate)
    slow_is_known: bool = False  # the user knows that the computer is slow
    recording: str = ""  # name of the recording that runs
    recording_error: str = ""
    rows_wait: str = ""  # why rows are not written now
    notes_wait: str = ""  # why notes, marks and session are not on the disk
    unrecorded: int = 0  # pairs that the recording does not have
    error: str = ""  # that ended the measurement
    uncalibrated: str = ""  # why the calibration is not used
    forced: bool = False  # the baseline is by Tare anyway, and no touch has begun since
    result: LastTouch | None = None
    next: NextTouch | None = None
    # all specimens are done: title and text of the line, what was done
    finished: tuple[str, str, str] | None = None
    doubt: str = ""  # why the calibration of the finished specimens is not good

    @property
    def pressed(self) -> bool:
        """Whether the probe is in contact."""
        return self.state in ("contact", "adapting", "done")

    @property
    def is_silent(self) -> bool:
        """Whether no pair has come for too long."""
        limit_s = SILENT_S
        if not math.isnan(self.period_s):
            limit_s = max(SILENT_S, SILENT_PERIODS * self.period_s)
        return self.silent_s > limit_s

    @property
    def cut_text(self) -> str:
        """The sentence about the touch that was cut."""
        if not self.cut:
            return ""
        return f" Touch {self.cut} is cut: repeat it."


def view_of(inputs: StatusInputs) -> tuple[Instruction, StatusLine]:
    """Return what to do, and the most urgent line.

    Examples
    --------
    >>> now, line = view_of(StatusInputs("no contact", troubles={"unplugged": "The board is gone: plug it in again."}))
    >>> now.word, now.tone, line.level, line.title
    ('Stop', 'fault', 'fault', 'Unplugged.')
    """
    instruction, line = calm(inputs)
    for urgent_line, urgent_instruction in urgent(inputs):
        return urgent_instruction or instruction, urgent_line
    return instruction, line


def urgent(inputs: StatusInputs) -> Iterator[View]:
    """Yield what is wrong, the most urgent first."""
    yield from _device_faults(inputs)
    if inputs.state != "ended":
        yield from _signal_faults(inputs)
        yield from _touch_doubts(inputs)


def file_state(file: ReviewedFile) -> StatusState:
    """Return word and line of a recording that is shown."""
    title = DAMAGED.get(file.end, "")
    counts = f"{file.rows} rows, {file.missing} missing"
    if file.refused:
        counts += f", {file.refused} without a value"
    text = f"A recording: {file.end}, {counts}. Nothing is being measured."
    level = "caution" if title else "quiet"
    line = StatusLine("file", level, title, text)
    return StatusState(Instruction("File", file.name), line.shown(None), text)


def _device_faults(inputs: StatusInputs) -> Iterator[View]:
    """Yield what is wrong with the measurement, the device and the recording, the most urgent first."""
    missing = ""
    if inputs.unrecorded:
        missing = f" {_count(inputs.unrecorded, 'pair')} not recorded."
    yield from _ends(inputs, missing)
    unplugged = inputs.troubles.get("unplugged", "")
    if unplugged:
        text = _sentence(unplugged) + inputs.cut_text
        if inputs.recording:
            text += " The recording goes on."
        line = StatusLine("unplugged", "fault", "Unplugged.", text)
        yield line, Instruction("Stop", "no board: plug it in, it goes on by itself", "fault")
    shared = inputs.troubles.get("shared", "")
    if shared:
        line = StatusLine("shared", "fault", "Lines are lost.", _sentence(shared))
        yield line, Instruction("Stop", "close the other program", "fault")
    wiring = inputs.troubles.get("wiring", "")
    if wiring:
        line = StatusLine("wiring", "fault", "Look at the wires.", _sentence(wiring))
        yield line, Instruction("Stop", "connect the wire again", "fault")
    if inputs.is_silent:
        text = "The source sends nothing. Look at its plug, its cable and its supply."
        line = StatusLine("silent", "fault", "No data.", text)
        yield line, Instruction("Wait", "no data comes", "fault")
    yield from _recording_faults(inputs, missing)


def _ends(inputs: StatusInputs, missing: str) -> Iterator[View]:
    """Yield that the measurement has ended; `missing`: how many pairs the recording lacks."""
    again = "Measure again begins a new measurement."
    remedy = "press Measure again"
    if inputs.error:
        text = f"{_sentence(inputs.error)}{missing} {again}"
        line = StatusLine("ended", "fault", "The measurement ended with an error.", text)
        yield line, Instruction("Stop", remedy, "fault")
    elif inputs.state == "ended" and not inputs.finished:
        line = StatusLine("ended", "note", "Ended.", f"The source has no more samples. {again}")
        yield line, Instruction("Ended", remedy)


def _recording_faults(inputs: StatusInputs, missing: str) -> Iterator[View]:
    """Yield what is wrong with the recording; `missing`: how many pairs it lacks, a sentence or nothing."""
    if inputs.recording_error:
        error = _sentence(inputs.recording_error)
        text = f"{error}{missing} The measurement goes on; record to another name or disk."
        yield StatusLine("recording", "fault", "The recording failed.", text), None
    elif inputs.rows_wait and inputs.unrecorded:
        text = f"{_sentence(inputs.rows_wait)} Make room on the disk: it resumes by itself."
        yield StatusLine("rows lost", "fault", "The recording loses rows.", text), None
    elif inputs.rows_wait:
        text = f"{_sentence(inputs.rows_wait)} Make room on the disk; nothing is lost yet."
        yield StatusLine("rows wait", "caution", "The recording waits.", text), None
    if inputs.notes_wait:
        text = _sentence(inputs.notes_wait)
        yield StatusLine("notes wait", "caution", "Notes wait.", text), None


def _signal_faults(inputs: StatusInputs) -> Iterator[View]:
    """Yield what is wrong with the signal and its baseline, the most urgent first."""
    yield from _constant_or_falling(inputs)
    touching = inputs.seen.touching
    if touching:
        text = f"Something touches: {touching}. No baseline is taken from it."
        line = StatusLine("touched", "caution", "Lift the probe.", text)
        yield line, Instruction("Lift", "and hold it in the air", "caution")
    yield from _wire_off(inputs)
    yield from _out_of_range(inputs)
    yield from _at_its_end(inputs)
    yield from _below_baseline(inputs)
    wait = None
    if inputs.state == "baseline":
        wait = Instruction("Wait", "do not touch anything", "caution")
    if inputs.gap:
        text = inputs.gap
        if inputs.lost:
            text += f": {_count(inputs.lost, 'pair')} lost"
        text = f"{_sentence(text)}{inputs.cut_text} The baseline is measured again."
        yield StatusLine("gap", "caution", "It goes on after a gap.", text), wait
    if inputs.retaken:
        text = (
            "The channels fell far below it: it had been measured in contact, or it jumped. "
            "It is measured again; a touch before may be wrong, and is flagged."
        )
        yield StatusLine("baseline", "caution", "Baseline lost.", text), wait
    if inputs.news:
        title = _NEWS.get(inputs.news.name, "Look at the signal.")
        yield StatusLine("news", "caution", title, _sentence(inputs.news.text)), None


_NEWS = {
    "jumped": "A jump.",
    "was_touch": "It was a touch.",
    "step": "A step.",
    "still": "It stands still.",
}


def _out_of_range(inputs: StatusInputs) -> Iterator[View]:
    """Yield that channels are outside the range of the converter, or at its limit in contact."""
    if inputs.outside:
        remedy = "set the range of the source again"
        if inputs.can_centre:
            remedy = "lift the probe, then press Centre"
        subject = _subject(inputs.outside)
        text = (
            f"The {subject} outside the range of the converter without a touch. {_sentence(remedy)}"
        )
        line = StatusLine("range", "fault", "Out of range.", text)
        yield line, Instruction("Stop", remedy, "fault")
    limited = [one for one in inputs.seen.channels if one.limit_s >= LIMIT_S]
    if limited and inputs.pressed:
        spoken = f"The {_subject([one.name for one in limited])} at the limit"
        text = spoken
        if math.isfinite(inputs.full_scale_pF):
            text += f", {inputs.full_scale_pF:.3f} pF"
        long_s = max(one.limit_s for one in limited)
        text += f", for {long_s:.1f} s of this touch. Press less: half of this is enough."
        line = StatusLine("saturated", "caution", "Saturated.", text, f"{spoken}. Press less.")
        yield line, Instruction("Repeat", "lift, then press less", "caution")


def _wire_off(inputs: StatusInputs) -> Iterator[View]:
    """Yield that a channel is at its limit although the other one shows no press."""
    at_end = {each.channel for each in inputs.judged if each.name == "saturated"}
    at_end |= {one.name for one in inputs.seen.channels if one.limit_s >= LIMIT_S}
    idle = {one.name for one in inputs.seen.channels if one.idle_s >= RELEASED_S}
    if not (inputs.pressed and at_end and idle - at_end):
        return
    name = min(at_end)
    text = (
        f"The {name} channel is at its limit, and the other one shows no press: "
        f"a wire of the {name} gauge is off, or shorted."
    )
    line = StatusLine("wire off", "fault", "Look at the wires.", text)
    yield line, Instruction("Stop", f"look at the wires of the {name} gauge", "fault")


def _below_baseline(inputs: StatusInputs) -> Iterator[View]:
    """Yield that channels are far below their baseline."""
    low = [one for one in inputs.seen.channels if one.below_s >= BELOW_S]
    if not low or inputs.state != "no contact":
        return
    subject = _subject([one.name for one in low])
    deep_pF = max(one.below_pF for one in low)
    text = (
        f"The {subject} {deep_pF:.2f} pF below the baseline: something was touched while taring, "
        "or it jumped."
    )
    spoken = f"The {subject} below the baseline."
    line = StatusLine("baseline", "fault", "Baseline lost.", text, spoken)
    yield line, Instruction("Tare", "lift the probe, then press T", "fault")


def _constant_or_falling(inputs: StatusInputs) -> Iterator[View]:
    """Yield what is wrong with channels as a whole: they do not change, or fall when pressed."""
    constant = [one for one in inputs.seen.channels if one.constant_s >= CONSTANT_S]
    if constant and not _judged(inputs, "saturated"):
        yield _constant(constant, _judged(inputs, "frozen"))
    falling = _judged(inputs, "falling")
    if falling:
        line = StatusLine("falling", "caution", "It falls when pressed.", falling)
        remedy = "exchange the wires and press T, or begin again with --falling"
        yield line, Instruction("Stop", remedy, "caution")


def _at_its_end(inputs: StatusInputs) -> Iterator[View]:
    """Yield that channels are at the end of their range; in contact the press may be too deep."""
    text = _judged(inputs, "saturated")
    if text and inputs.pressed:
        line = StatusLine("at its end", "caution", "Saturated.", text)
        yield line, Instruction("Repeat", "lift, then press less, or set the range", "caution")
    elif text:
        line = StatusLine("at its end", "fault", "Saturated.", text)
        yield line, Instruction("Stop", "look at the wires, and set the range", "fault")


def _judged(inputs: StatusInputs, name: str) -> str:
    """Return the sentences of the judgements of this name that hold; "": none."""
    return " ".join(_sentence(each.text) for each in inputs.judged if each.name == name)


def _constant(channels: Sequence[ChannelSeen], frozen: str) -> View:
    """Return that channels always have the same value: nothing is wired, or the source does not measure.

    `frozen`: the sentences about it, if it was judged.
    """
    if len(channels) == 2 and not any(one.reading for one in channels):
        text = "Both channels read 0.000 pF. Wire the hard gauge and the soft one to their inputs."
        line = StatusLine("unwired", "fault", "Nothing wired.", text)
        return line, Instruction("Stop", "nothing is wired to the inputs", "fault")
    text = frozen
    if not frozen:
        subject = "Both channels read"
        if len(channels) == 1:
            subject = f"The {channels[0].name} channel reads"
        values = " and ".join(f"{one.reading:.3f}" for one in channels)
        text = (
            f"{subject} the same value all the time, {values} pF: no converter does. Look at wires "
            "and source."
        )
    line = StatusLine("constant", "caution", "Nothing changes.", text)
    return line, Instruction("Stop", "look at the wires", "caution")


def _touch_doubts(inputs: StatusInputs) -> Iterator[View]:
    """Yield what is doubtful about touches, the pace and the wiring, the most urgent first."""
    result = inputs.result
    if result and inputs.state not in ("contact", "adapting"):
        if result.swapped:
            line = StatusLine("swapped", "caution", "Inputs exchanged?", _sentence(result.swapped))
            yield line, Instruction("Stop", "look at the two wires", "caution")
        if result.why:
            yield _left_out(inputs, result)
    hint = inputs.troubles.get("hint", "")
    if hint and not result and inputs.state == "no contact":
        yield StatusLine("hint", "note", "Wiring.", _sentence(hint)), None
    slow_line = slow(inputs)
    if slow_line and not inputs.slow_is_known:
        yield slow_line, None
    if inputs.uncalibrated:  # last: it lasts, and would hide the others
        text = _sentence(inputs.uncalibrated)
        yield StatusLine("calibration", "caution", "The calibration is not used.", text), None


def _left_out(inputs: StatusInputs, result: LastTouch) -> View:
    """Return that the last touch is left out, and how to repeat it."""
    title = f"Touch {result.number} is left out."
    line = StatusLine("left out", "caution", title, _sentence(result.why))
    steps = []
    share = None
    if inputs.pressed:
        steps.append("lift")
        share = 1.0
    hints = [flag.meaning.hint for flag in result.flags if flag.meaning.hint]
    steps += hints[:1]
    if inputs.next:
        steps.append(f"touch {inputs.next.name} again")
    else:
        steps.append("touch again")
    return line, Instruction("Repeat", ", ".join(steps), "caution", share)


def slow(inputs: StatusInputs) -> StatusLine | None:
    """Return that the computer is too slow for the pairs, and what that costs; None: it is not."""
    pace = inputs.pace
    is_late = pace.expected >= FEWEST and pace.per_s < SLOW_SHARE * pace.nominal_per_s
    if not (is_late or pace.dropped):
        return None
    sentences = []
    share = 1.0
    if is_late:
        sentences.append(f"{pace.per_s:.0f} of {pace.nominal_per_s:.0f} pairs a second arrive.")
        share = min(pace.per_s / pace.nominal_per_s, 1.0)
    if pace.dropped:
        sentences.append(f"{pace.dropped} pairs were not estimated; a recording has them.")
    sentences.append(_cost(inputs.result, share))
    text = " ".join(sentences)
    return StatusLine("slow", "note", "Slow computer.", text, "The computer is slow.")


def _cost(result: LastTouch | None, share: float) -> str:
    """Return how the uncertainty of the last touch grows if only this share of the pairs comes."""
    known = None
    if result:
        known = result.known
    if known is None or not math.isfinite(known.uncertainty):
        return "What it costs is known after a touch."
    with_all = replace(known, noise=known.noise * share**0.5)
    before = number_format.error(with_all.uncertainty)
    now = number_format.error(known.uncertainty)
    if now == before:
        return f"It costs nothing here: ± {now} stays ± {now}."
    return f"± {before} becomes ± {now}."


def calm(inputs: StatusInputs) -> tuple[Instruction, StatusLine]:
    """Return what to do if nothing is wrong, and what goes on."""
    if inputs.state == "done":
        return _complete(inputs)
    if inputs.pressed:
        return _holding(inputs)
    if inputs.state == "baseline":
        return _measuring_baseline(inputs)
    if inputs.finished:
        title, text, sub = inputs.finished
        if inputs.doubt:
            line = StatusLine("look", "caution", "Not good yet.", inputs.doubt)
            return Instruction("Look", "touch again, or correct the list", "caution"), line
        return Instruction("Done", sub, "good"), StatusLine("finished", "note", title, text)
    return _ready(inputs)


def _complete(inputs: StatusInputs) -> tuple[Instruction, StatusLine]:
    kept = _kept(inputs) or "The touch is complete."
    sub = "the touch is complete"
    if inputs.next:
        sub = f"kept; then {_next(inputs)}"
    if inputs.result and inputs.result.late:
        sub = f"touch {inputs.result.number} counts · {inputs.result.late}"
    reason = "the touch is kept" if _kept(inputs) else "complete"
    instruction = Instruction("Lift", sub, "good", 1.0, reason)
    if inputs.seen.done_s > LONG_S:
        text = f"{kept} The next touch needs a new contact."
        return instruction, StatusLine("left in contact", "note", "Lift the probe.", text)
    return instruction, StatusLine("done", "quiet", "", kept, "Complete.")


def _holding(inputs: StatusInputs) -> tuple[Instruction, StatusLine]:
    seen = inputs.seen
    sub = "measuring"
    if math.isfinite(seen.left_s):
        sub = f"{seen.left_s:.1f} s more"
    elif seen.contact_s:
        sub = f"{seen.contact_s:.0f} s so far"
    text = "Measuring."
    if inputs.next:
        text += f" {_sentence(_next(inputs))}"
    instruction = Instruction("Hold", sub, "busy", seen.share)
    return instruction, StatusLine("contact", "quiet", "", text)


def _measuring_baseline(inputs: StatusInputs) -> tuple[Instruction, StatusLine]:
    if inputs.result and not inputs.result.revised:
        text = f"{_kept(inputs)} Its result is final when the baseline after it is known."
        line = StatusLine("after", "quiet", "", text.strip())
        return Instruction("Wait", "a second without touching"), line
    line = StatusLine("first baseline", "quiet", "", "The baseline is being measured.")
    return Instruction("Wait", "do not touch anything"), line


def _ready(inputs: StatusInputs) -> tuple[Instruction, StatusLine]:
    ready = "Ready."
    if inputs.forced:
        ready = "Ready, if nothing was touched at Tare anyway; else lift the probe, and press Tare."
    parts = [ready, _kept(inputs)]
    text = " ".join(filter(None, parts))
    sub = "press, and hold"
    if inputs.next:
        sub = f"{_next(inputs)}: press, and hold"
    instruction = Instruction("Touch", sub, reason="press and hold")
    return instruction, StatusLine("ready", "quiet", "", text, ready)


def _kept(inputs: StatusInputs) -> str:
    """Return that the last touch is kept; "": it is not."""
    if inputs.result and not inputs.result.why:
        return f"Touch {inputs.result.number} is kept."
    return ""


def _next(inputs: StatusInputs) -> str:
    following = inputs.next
    if not following:
        return "the next touch"
    return f"{following.name}, touch {following.nth} of {following.of}"


def _subject(names: Sequence[str]) -> str:
    """Return the subject of a sentence about channels, with its verb."""
    return f"{names[0]} channel is" if len(names) == 1 else "channels are"


def _count(number: int, noun: str) -> str:
    """Return so many of something, with the verb."""
    return f"1 {noun} is" if number == 1 else f"{number} {noun}s are"


def _sentence(text: str) -> str:
    """Return a text as a sentence: with a capital, unless it begins with the name of a file or a device; a full stop."""
    text = text.strip()
    first = text.partition(" ")[0].rstrip(".")
    if not set(first) & set("./\\"):
        text = text[:1].upper() + text[1:]
    if not text.endswith((".", "!", "?")):
        text += "."
    return text
