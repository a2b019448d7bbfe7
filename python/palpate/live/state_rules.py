"""What to do, and what is wrong: rules from the inputs of a moment to a word and a line, the most urgent rule first."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import chain
from typing import NamedTuple

from palpate import number_format
from palpate.flags import Flag
from palpate.judgements import Judgement
from palpate.live.protocol import Instruction, NextTouch, ReviewedFile, ShownLine, StatusState
from palpate.live.signal_state import ChannelSeen, SignalSeen
from palpate.uncertainty import Uncertainty

LIMIT_S = 0.1  # in contact a channel may be at its limit for this time
BELOW_S = 1.0  # a channel is far below its baseline for this time before the page says it
LONG_S = 10.0  # the probe is left in contact after a touch for this time before the page says it
# without a pair for this time, and for so many periods, a measurement is silent
SILENT_S, SILENT_PERIODS = (1.0, 10)
CONSTANT_S = 1.0  # a channel has the same value for this time before the page says it
SLOW_SHARE, FEWEST = 0.9, 50  # too slow: below this part of the rate; of so many pairs
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
    """How fast pairs arrive that can be used, a second, now and by the period of the source; counts of the last seconds."""

    per_s: float = math.nan
    nominal_per_s: float = math.nan
    read: int = 0
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
    slow_told: bool = False  # that the computer is slow was said before
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
    finished: tuple[str, str, str] | None = (
        None  # all specimens are done: title and text of the line, what was done
    )
    hand: tuple[str, str] | None = None  # of the demo: what is pressed, what comes next

    @property
    def pressed(self) -> bool:
        """Whether the probe is in contact."""
        return self.state in ("contact", "adapting", "done")

    @property
    def cut_text(self) -> str:
        """The sentence about the touch that was cut."""
        return f" Touch {self.cut} is cut: repeat it." if self.cut else ""


def view_of(inputs: StatusInputs) -> tuple[Instruction, StatusLine]:
    """Return what to do, and the most urgent line.

    Examples
    --------
    >>> now, line = view_of(StatusInputs("no contact", troubles={"unplugged": "The board is gone: plug it in again."}))
    >>> now.word, now.tone, line.level, line.title
    ('Stop', 'fault', 'fault', 'Unplugged.')
    """
    now, line = demo(inputs, inputs.hand) if inputs.hand else calm(inputs)
    # the hand obeys no order
    found = (view for view in urgent(inputs) if not inputs.hand or view[0].level == "fault")
    line, do = next(found, (line, None))
    return do or now, line


def urgent(inputs: StatusInputs) -> Iterator[View]:
    """Return what is wrong, the most urgent first."""
    faults = _device_faults(inputs)
    return (
        faults
        if inputs.state == "ended"
        else chain(faults, _signal_faults(inputs), _touch_doubts(inputs))
    )


def file_state(file: ReviewedFile) -> StatusState:
    """Return word and line of a recording that is shown."""
    title = DAMAGED.get(file.end, "")
    counts = f"{file.rows} rows, {file.missing} missing"
    if file.refused:
        counts += f", {file.refused} without a value"
    text = f"A recording: {file.end}, {counts}. Nothing is being measured."
    line = StatusLine("file", "caution" if title else "quiet", title, text)
    return StatusState(Instruction("File", file.name), line.shown(None), text)


def _device_faults(inputs: StatusInputs) -> Iterator[View]:
    """Yield what is wrong with the measurement, the device and the recording, the most urgent first."""
    missing = f" {_count(inputs.unrecorded, 'pair')} not recorded." if inputs.unrecorded else ""
    again, ended = "Measure again begins a new measurement.", "the measurement has ended"
    if inputs.error:
        text = f"{_sentence(inputs.error)}{missing} {again}"
        yield (
            StatusLine("ended", "fault", "The measurement ended with an error.", text),
            Instruction("Stop", ended, "fault"),
        )
    elif inputs.state == "ended" and not inputs.finished:
        yield (
            StatusLine("ended", "note", "Ended.", f"The source has no more samples. {again}"),
            Instruction("Stop", ended),
        )
    if text := inputs.troubles.get("unplugged", ""):
        text = f"{_sentence(text)}{inputs.cut_text}{' The recording goes on.' if inputs.recording else ''}"
        now = Instruction("Stop", "no board: plug it in, it goes on by itself", "fault")
        yield StatusLine("unplugged", "fault", "Unplugged.", text), now
    shared = inputs.troubles.get("shared", "")
    if shared:
        yield (
            StatusLine("shared", "fault", "Lines are lost.", _sentence(shared)),
            Instruction("Stop", "close the other program", "fault"),
        )
    if text := inputs.troubles.get("wiring", ""):
        yield (
            StatusLine("wiring", "fault", "Look at the wires.", _sentence(text)),
            Instruction("Stop", "a wire is off", "fault"),
        )
    if inputs.silent_s > max(
        SILENT_S, SILENT_PERIODS * (0 if math.isnan(inputs.period_s) else inputs.period_s)
    ):
        text = "The source sends nothing. Look at its plug, its cable and its supply."
        yield (
            StatusLine("silent", "fault", "No data.", text),
            Instruction("Wait", "no data comes", "fault"),
        )
    yield from _recording_faults(inputs, missing)


def _recording_faults(inputs: StatusInputs, missing: str) -> Iterator[View]:
    """Yield what is wrong with the recording; `missing`: how many pairs it lacks, a sentence or nothing."""
    if text := inputs.recording_error:
        text = (
            f"{_sentence(text)}{missing} The measurement goes on; record to another name or disk."
        )
        yield StatusLine("recording", "fault", "The recording failed.", text), None
    elif inputs.rows_wait and inputs.unrecorded:
        text = f"{_sentence(inputs.rows_wait)} Make room on the disk: it resumes by itself."
        yield StatusLine("rows lost", "fault", "The recording loses rows.", text), None
    elif inputs.rows_wait:
        text = f"{_sentence(inputs.rows_wait)} Make room on the disk; nothing is lost yet."
        yield StatusLine("rows wait", "caution", "The recording waits.", text), None
    if inputs.notes_wait:
        yield StatusLine("notes wait", "caution", "Notes wait.", _sentence(inputs.notes_wait)), None


def _signal_faults(inputs: StatusInputs) -> Iterator[View]:
    """Yield what is wrong with the signal and its baseline, the most urgent first."""
    channels = inputs.seen.channels
    wait = (
        Instruction("Wait", "do not touch anything", "caution")
        if inputs.state == "baseline"
        else None
    )
    yield from _constant_or_falling(inputs)
    if text := inputs.seen.touching:
        text = f"Something touches: {text}. No baseline is taken from it."
        yield (
            StatusLine("touched", "caution", "Lift the probe.", text),
            Instruction("Lift", "and hold it in the air", "caution"),
        )
    if inputs.outside:
        do = (
            "lift the probe, then press Centre"
            if inputs.can_centre
            else "set the range of the source again"
        )
        text = f"The {_subject(inputs.outside)} outside the range of the converter without a touch. {_sentence(do)}"
        yield StatusLine("range", "fault", "Out of range.", text), Instruction("Stop", do, "fault")
    if inputs.pressed and (limited := [one for one in channels if one.limit_s >= LIMIT_S]):
        limit = f", {inputs.full_scale_pF:.3f} pF" if math.isfinite(inputs.full_scale_pF) else ""
        said = f"The {_subject([one.name for one in limited])} at the limit"
        long_s = max(one.limit_s for one in limited)
        text = (
            f"{said}{limit}, for {long_s:.1f} s of this touch. Press less: half of this is enough."
        )
        line = StatusLine("saturated", "caution", "Saturated.", text, f"{said}. Press less.")
        yield line, Instruction("Repeat", "lift, then press less", "caution")
    yield from _at_its_end(inputs)
    if inputs.state == "no contact" and (
        low := [one for one in channels if one.below_s >= BELOW_S]
    ):
        who, deep = _subject([one.name for one in low]), max(one.below_pF for one in low)
        text = f"The {who} {deep:.2f} pF below the baseline: something was touched while taring, or it jumped."
        line = StatusLine(
            "baseline", "fault", "Baseline lost.", text, f"The {who} below the baseline."
        )
        yield line, Instruction("Tare", "lift the probe, then press T", "fault")
    if inputs.gap:
        lost = f": {_count(inputs.lost, 'pair')} lost" if inputs.lost else ""
        text = f"{_sentence(inputs.gap + lost)}{inputs.cut_text} The baseline is measured again."
        yield StatusLine("gap", "caution", "It goes on after a gap.", text), wait
    if inputs.retaken:
        why = "The channels fell far below it: it had been measured in contact, or it jumped."
        text = f"{why} It is measured again; a touch before may be wrong, and is flagged."
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


def _constant_or_falling(inputs: StatusInputs) -> Iterator[View]:
    """Yield what is wrong with channels as a whole: they do not change, or fall when pressed."""
    constant = [one for one in inputs.seen.channels if one.constant_s >= CONSTANT_S]
    if constant and not _judged(inputs, "saturated"):
        yield _constant(constant, _judged(inputs, "frozen"))
    if text := _judged(inputs, "falling"):
        now = Instruction(
            "Stop", "exchange the wires and press T, or begin again with --falling", "caution"
        )
        yield StatusLine("falling", "caution", "It falls when pressed.", text), now


def _at_its_end(inputs: StatusInputs) -> Iterator[View]:
    """Yield that channels are at the end of their range; in contact the press may be too deep."""
    text = _judged(inputs, "saturated")
    if text and inputs.pressed:
        now = Instruction("Repeat", "lift, then press less, or set the range", "caution")
        yield StatusLine("at its end", "caution", "Saturated.", text), now
    elif text:
        now = Instruction("Stop", "look at the wires, and set the range", "fault")
        yield StatusLine("at its end", "fault", "Saturated.", text), now


def _judged(inputs: StatusInputs, name: str) -> str:
    """Return the sentences of the judgements of this name that hold; "": none."""
    return " ".join(_sentence(each.text) for each in inputs.judged if each.name == name)


def _constant(channels: Sequence[ChannelSeen], frozen: str) -> View:
    """Say that channels always have the same value: nothing is wired, or the source does not measure.

    `frozen`: the sentences about it, if it was judged.
    """
    if len(channels) == 2 and not any(one.reading for one in channels):
        text = "Both channels read 0.000 pF. Wire the hard gauge and the soft one to their inputs."
        now = Instruction("Stop", "nothing is wired to the inputs", "fault")
        return StatusLine("unwired", "fault", "Nothing wired.", text), now
    now = Instruction("Stop", "look at the wires", "caution")
    if frozen:
        return StatusLine("constant", "caution", "Nothing changes.", frozen), now
    who = f"The {channels[0].name} channel reads" if len(channels) == 1 else "Both channels read"
    read = " and ".join(f"{one.reading:.3f}" for one in channels)
    text = f"{who} the same value all the time, {read} pF: no converter does. Look at wires and source."
    return StatusLine("constant", "caution", "Nothing changes.", text), now


def _touch_doubts(inputs: StatusInputs) -> Iterator[View]:
    """Yield what is doubtful about touches, the pace and the wiring, the most urgent first."""
    result, between = inputs.result, inputs.state not in ("contact", "adapting")
    if result and result.swapped and between:
        line = StatusLine("swapped", "caution", "Inputs exchanged?", _sentence(result.swapped))
        yield line, Instruction("Stop", "look at the two wires", "caution")
    if result and result.why and between:
        lift = "lift, " if inputs.pressed else ""
        name = f" {inputs.next.name}" if inputs.next else ""
        hints = [flag.meaning.hint for flag in result.flags if flag.meaning.hint]
        how = f"{hints[0]}, " if hints else ""
        line = StatusLine(
            "left out", "caution", f"Touch {result.number} is left out.", _sentence(result.why)
        )
        yield (
            line,
            Instruction(
                "Repeat",
                f"{lift}{how}touch{name} again",
                "caution",
                1.0 if inputs.pressed else None,
            ),
        )
    if not result and inputs.state == "no contact" and (text := inputs.troubles.get("hint", "")):
        yield StatusLine("hint", "note", "Wiring.", _sentence(text)), None
    if (told := slow(inputs)) and not inputs.slow_told:
        yield told, None
    if inputs.uncalibrated:  # last: it lasts, and would hide the others
        text = _sentence(inputs.uncalibrated)
        yield StatusLine("calibration", "caution", "The calibration is not used.", text), None


def slow(inputs: StatusInputs) -> StatusLine | None:
    """Say that the computer is too slow for the pairs, and what that costs."""
    pace = inputs.pace
    few = pace.read >= FEWEST and pace.per_s < SLOW_SHARE * pace.nominal_per_s
    if not (few or pace.dropped):
        return None
    told = [f"{pace.per_s:.0f} of {pace.nominal_per_s:.0f} pairs a second arrive."] if few else []
    told += (
        [f"{pace.dropped} pairs were not estimated; a recording has them."] if pace.dropped else []
    )
    cost = "What it costs is known after a touch."
    if inputs.result and (known := inputs.result.known) and math.isfinite(known.uncertainty):
        share = min(pace.per_s / pace.nominal_per_s, 1.0) if few else 1.0
        before, now = (
            number_format.error(one.uncertainty)
            for one in (replace(known, noise=known.noise * share**0.5), known)
        )
        cost = (
            f"It costs nothing here: ± {now} stays ± {now}."
            if now == before
            else f"± {before} becomes ± {now}."
        )
    return StatusLine(
        "slow", "note", "Slow computer.", " ".join([*told, cost]), "The computer is slow."
    )


def calm(inputs: StatusInputs) -> tuple[Instruction, StatusLine]:
    """Return what to do if nothing is wrong, and what goes on."""
    seen, kept, following = inputs.seen, _kept(inputs), _next(inputs)
    if inputs.state == "done":
        return _complete(inputs, following)
    if inputs.pressed:
        sub = f"{seen.contact_s:.0f} s so far" if seen.contact_s else "measuring"
        if math.isfinite(seen.left_s):
            sub = f"{seen.left_s:.1f} s more"
        about = f" {_sentence(following)}" if inputs.next else ""
        return Instruction("Hold", sub, "busy", seen.share), StatusLine(
            "contact", "quiet", "", f"Measuring.{about}"
        )
    if inputs.state != "baseline":
        if inputs.finished:
            title, text, sub = inputs.finished
            return Instruction("Done", sub, "good"), StatusLine("finished", "note", title, text)
        noise = max(one.noise_pF for one in seen.channels)
        told = f"Noise {1e3 * noise:.2g} fF." if math.isfinite(noise) else ""
        doubt = (
            ", if nothing was touched at Tare anyway; else lift the probe, and press Tare"
            if inputs.forced
            else ""
        )
        text = " ".join(part for part in (f"Ready{doubt}.", kept, told) if part)
        sub = f"{following}: press, and hold" if inputs.next else "press, and hold"
        return Instruction("Touch", sub), StatusLine("ready", "quiet", "", text, f"Ready{doubt}.")
    if inputs.result and not inputs.result.revised:
        text = f"{kept} Its result is revised when the baseline after it is known."
        return Instruction("Wait", "a second without touching"), StatusLine(
            "after", "quiet", "", text.strip()
        )
    line = StatusLine("first baseline", "quiet", "", "The baseline is being measured.")
    return Instruction("Wait", "do not touch anything"), line


def _complete(inputs: StatusInputs, following: str) -> tuple[Instruction, StatusLine]:
    kept = _kept(inputs) or "The touch is complete."
    sub = f"kept; then {following}" if inputs.next else "the touch is complete"
    if inputs.result and inputs.result.late:
        sub = f"touch {inputs.result.number} counts · {inputs.result.late}"
    now = Instruction("Lift", sub, "good", 1.0)
    if inputs.seen.done_s > LONG_S:
        text = f"{kept} The next touch needs a new contact."
        return now, StatusLine("left in contact", "note", "Lift the probe.", text)
    return now, StatusLine("done", "quiet", "", kept, "Complete.")


def demo(inputs: StatusInputs, hand: tuple[str, str]) -> tuple[Instruction, StatusLine]:
    """Return what the simulated hand does, in words for someone without a probe."""
    on, then = hand
    text = "A simulated hand touches four specimens, round after round. With your board: `palpate doctor`"
    line = StatusLine("demo", "note", "Simulation.", text)
    if inputs.state == "done":
        return Instruction("Lifting", f"the touch on {on} is complete", "good", 1.0), line
    if inputs.pressed:
        left = f": {inputs.seen.left_s:.1f} s more" if math.isfinite(inputs.seen.left_s) else ""
        return Instruction(
            "Holding", f"the hand presses on {on}{left}", "busy", inputs.seen.share
        ), line
    if inputs.state == "baseline" and not inputs.result:
        return Instruction("Waiting", "the baseline is being measured"), line
    return Instruction(
        "Lifted", f"next, the hand touches {then}" if then else "the next round follows"
    ), line


def _kept(inputs: StatusInputs) -> str:
    return (
        f"Touch {inputs.result.number} is kept." if inputs.result and not inputs.result.why else ""
    )


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
    begin = text[:1] if set(first) & set("./\\") else text[:1].upper()
    return begin + text[1:] + ("" if text.endswith((".", "!", "?")) else ".")
