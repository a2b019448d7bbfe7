"""What to do, and what is wrong: rules from the facts of a moment to a word and a line, the most urgent rule first."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import chain
from typing import Any, NamedTuple

from palpate import number_format
from palpate.flags import Flag
from palpate.judgements import Judgement
from palpate.live.feed import Document
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


class Now(NamedTuple):
    """What to do now: Touch, Hold, Lift, Repeat, Stop, Tare or Wait; File: nothing is measured."""

    word: str
    sub: str
    tone: str = "idle"  # idle, busy, good, caution or fault
    share: float | None = None  # part of the touch that is measured


class StatusLine(NamedTuple):
    """What there is to know; `said`: for a screen reader, in place of a text whose numbers run."""

    what: str  # a key
    level: str  # quiet, note, caution or fault
    title: str
    text: str
    said: str = ""

    def as_dict(self, since_s: float | None) -> Document:
        """Return what the page gets; `since_s`: for how long it is shown."""
        return {
            "level": self.level,
            "title": self.title,
            "text": self.text,
            "since_s": since_s,
            "what": self.what,
        }


View = tuple[StatusLine, Now | None]  # a line, and what to do; None: what one would do without it


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
class Facts:
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
    next: Mapping[str, Any] | None = None  # the next touch: name of its specimen, nth, of
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


def view_of(facts: Facts) -> tuple[Now, StatusLine]:
    """Return what to do, and the most urgent line.

    Examples
    --------
    >>> now, line = view_of(Facts("no contact", troubles={"unplugged": "The board is gone: plug it in again."}))
    >>> now.word, now.tone, line.level, line.title
    ('Stop', 'fault', 'fault', 'Unplugged.')
    """
    now, line = demo(facts, facts.hand) if facts.hand else calm(facts)
    # the hand obeys no order
    found = (view for view in urgent(facts) if not facts.hand or view[0].level == "fault")
    line, do = next(found, (line, None))
    return do or now, line


def urgent(facts: Facts) -> Iterator[View]:
    """Return what is wrong, the most urgent first."""
    faults = _device_faults(facts)
    return (
        faults
        if facts.state == "ended"
        else chain(faults, _signal_faults(facts), _touch_doubts(facts))
    )


def file_state(file: Mapping[str, Any]) -> Document:
    """Return word and line of a recording that is shown, as the message `state` has them."""
    title = DAMAGED.get(file["end"], "")
    useless = f", {file['refused']} without a value" if file["refused"] else ""
    counts = f"{file['rows']} rows, {file['missing']} missing{useless}"
    text = f"A recording: {file['end']}, {counts}. Nothing is being measured."
    line = StatusLine("file", "caution" if title else "quiet", title, text)
    return {
        "now": Now("File", file["name"])._asdict(),
        "line": line.as_dict(None),
        "announce": text,
    }


def _device_faults(facts: Facts) -> Iterator[View]:
    """Yield what is wrong with the measurement, the device and the recording, the most urgent first."""
    missing = f" {_count(facts.unrecorded, 'pair')} not recorded." if facts.unrecorded else ""
    again, ended = "Measure again begins a new measurement.", "the measurement has ended"
    if facts.error:
        text = f"{_sentence(facts.error)}{missing} {again}"
        yield (
            StatusLine("ended", "fault", "The measurement ended with an error.", text),
            Now("Stop", ended, "fault"),
        )
    elif facts.state == "ended" and not facts.finished:
        yield (
            StatusLine("ended", "note", "Ended.", f"The source has no more samples. {again}"),
            Now("Stop", ended),
        )
    if text := facts.troubles.get("unplugged", ""):
        text = f"{_sentence(text)}{facts.cut_text}{' The recording goes on.' if facts.recording else ''}"
        now = Now("Stop", "no board: plug it in, it goes on by itself", "fault")
        yield StatusLine("unplugged", "fault", "Unplugged.", text), now
    shared = facts.troubles.get("shared", "")
    if shared:
        yield (
            StatusLine("shared", "fault", "Lines are lost.", _sentence(shared)),
            Now("Stop", "close the other program", "fault"),
        )
    if text := facts.troubles.get("wiring", ""):
        yield (
            StatusLine("wiring", "fault", "Look at the wires.", _sentence(text)),
            Now("Stop", "a wire is off", "fault"),
        )
    if facts.silent_s > max(
        SILENT_S, SILENT_PERIODS * (0 if math.isnan(facts.period_s) else facts.period_s)
    ):
        text = "The source sends nothing. Look at its plug, its cable and its supply."
        yield StatusLine("silent", "fault", "No data.", text), Now("Wait", "no data comes", "fault")
    yield from _recording_faults(facts, missing)


def _recording_faults(facts: Facts, missing: str) -> Iterator[View]:
    """Yield what is wrong with the recording; `missing`: how many pairs it lacks, a sentence or nothing."""
    if text := facts.recording_error:
        text = (
            f"{_sentence(text)}{missing} The measurement goes on; record to another name or disk."
        )
        yield StatusLine("recording", "fault", "The recording failed.", text), None
    elif facts.rows_wait and facts.unrecorded:
        text = f"{_sentence(facts.rows_wait)} Make room on the disk: it resumes by itself."
        yield StatusLine("rows lost", "fault", "The recording loses rows.", text), None
    elif facts.rows_wait:
        text = f"{_sentence(facts.rows_wait)} Make room on the disk; nothing is lost yet."
        yield StatusLine("rows wait", "caution", "The recording waits.", text), None
    if facts.notes_wait:
        yield StatusLine("notes wait", "caution", "Notes wait.", _sentence(facts.notes_wait)), None


def _signal_faults(facts: Facts) -> Iterator[View]:
    """Yield what is wrong with the signal and its baseline, the most urgent first."""
    channels = facts.seen.channels
    wait = Now("Wait", "do not touch anything", "caution") if facts.state == "baseline" else None
    yield from _constant_or_falling(facts)
    if text := facts.seen.touching:
        text = f"Something touches: {text}. No baseline is taken from it."
        yield (
            StatusLine("touched", "caution", "Lift the probe.", text),
            Now("Lift", "and hold it in the air", "caution"),
        )
    if facts.outside:
        do = (
            "lift the probe, then press Centre"
            if facts.can_centre
            else "set the range of the source again"
        )
        text = f"The {_subject(facts.outside)} outside the range of the converter without a touch. {_sentence(do)}"
        yield StatusLine("range", "fault", "Out of range.", text), Now("Stop", do, "fault")
    if facts.pressed and (limited := [one for one in channels if one.limit_s >= LIMIT_S]):
        limit = f", {facts.full_scale_pF:.3f} pF" if math.isfinite(facts.full_scale_pF) else ""
        said = f"The {_subject([one.name for one in limited])} at the limit"
        long_s = max(one.limit_s for one in limited)
        text = (
            f"{said}{limit}, for {long_s:.1f} s of this touch. Press less: half of this is enough."
        )
        line = StatusLine("saturated", "caution", "Saturated.", text, f"{said}. Press less.")
        yield line, Now("Repeat", "lift, then press less", "caution")
    yield from _at_its_end(facts)
    if facts.state == "no contact" and (low := [one for one in channels if one.below_s >= BELOW_S]):
        who, deep = _subject([one.name for one in low]), max(one.below_pF for one in low)
        text = f"The {who} {deep:.2f} pF below the baseline: something was touched while taring, or it jumped."
        line = StatusLine(
            "baseline", "fault", "Baseline lost.", text, f"The {who} below the baseline."
        )
        yield line, Now("Tare", "lift the probe, then press T", "fault")
    if facts.gap:
        lost = f": {_count(facts.lost, 'pair')} lost" if facts.lost else ""
        text = f"{_sentence(facts.gap + lost)}{facts.cut_text} The baseline is measured again."
        yield StatusLine("gap", "caution", "It goes on after a gap.", text), wait
    if facts.retaken:
        why = "The channels fell far below it: it had been measured in contact, or it jumped."
        text = f"{why} It is measured again; a touch before may be wrong, and is flagged."
        yield StatusLine("baseline", "caution", "Baseline lost.", text), wait
    if facts.news:
        title = _NEWS.get(facts.news.name, "Look at the signal.")
        yield StatusLine("news", "caution", title, _sentence(facts.news.text)), None


_NEWS = {
    "jumped": "A jump.",
    "was_touch": "It was a touch.",
    "step": "A step.",
    "still": "It stands still.",
}


def _constant_or_falling(facts: Facts) -> Iterator[View]:
    """Yield what is wrong with channels as a whole: they do not change, or fall when pressed."""
    constant = [one for one in facts.seen.channels if one.constant_s >= CONSTANT_S]
    if constant and not _judged(facts, "saturated"):
        yield _constant(constant, _judged(facts, "frozen"))
    if text := _judged(facts, "falling"):
        now = Now(
            "Stop", "exchange the wires and press T, or begin again with --falling", "caution"
        )
        yield StatusLine("falling", "caution", "It falls when pressed.", text), now


def _at_its_end(facts: Facts) -> Iterator[View]:
    """Yield that channels are at the end of their range; in contact the press may be too deep."""
    text = _judged(facts, "saturated")
    if text and facts.pressed:
        now = Now("Repeat", "lift, then press less, or set the range", "caution")
        yield StatusLine("at its end", "caution", "Saturated.", text), now
    elif text:
        now = Now("Stop", "look at the wires, and set the range", "fault")
        yield StatusLine("at its end", "fault", "Saturated.", text), now


def _judged(facts: Facts, name: str) -> str:
    """Return the sentences of the judgements of this name that hold; "": none."""
    return " ".join(_sentence(each.text) for each in facts.judged if each.name == name)


def _constant(channels: Sequence[ChannelSeen], frozen: str) -> View:
    """Say that channels always have the same value: nothing is wired, or the source does not measure.

    `frozen`: the sentences about it, if it was judged.
    """
    if len(channels) == 2 and not any(one.reading for one in channels):
        text = "Both channels read 0.000 pF. Wire the hard gauge and the soft one to their inputs."
        now = Now("Stop", "nothing is wired to the inputs", "fault")
        return StatusLine("unwired", "fault", "Nothing wired.", text), now
    now = Now("Stop", "look at the wires", "caution")
    if frozen:
        return StatusLine("constant", "caution", "Nothing changes.", frozen), now
    who = f"The {channels[0].name} channel reads" if len(channels) == 1 else "Both channels read"
    read = " and ".join(f"{one.reading:.3f}" for one in channels)
    text = f"{who} the same value all the time, {read} pF: no converter does. Look at wires and source."
    return StatusLine("constant", "caution", "Nothing changes.", text), now


def _touch_doubts(facts: Facts) -> Iterator[View]:
    """Yield what is doubtful about touches, the pace and the wiring, the most urgent first."""
    result, between = facts.result, facts.state not in ("contact", "adapting")
    if result and result.swapped and between:
        line = StatusLine("swapped", "caution", "Inputs exchanged?", _sentence(result.swapped))
        yield line, Now("Stop", "look at the two wires", "caution")
    if result and result.why and between:
        lift, name = (
            "lift, " if facts.pressed else "",
            f" {(facts.next or {}).get('name') or ''}".rstrip(),
        )
        hints = [flag.meaning.hint for flag in result.flags if flag.meaning.hint]
        how = f"{hints[0]}, " if hints else ""
        line = StatusLine(
            "left out", "caution", f"Touch {result.number} is left out.", _sentence(result.why)
        )
        yield (
            line,
            Now(
                "Repeat", f"{lift}{how}touch{name} again", "caution", 1.0 if facts.pressed else None
            ),
        )
    if not result and facts.state == "no contact" and (text := facts.troubles.get("hint", "")):
        yield StatusLine("hint", "note", "Wiring.", _sentence(text)), None
    if (told := slow(facts)) and not facts.slow_told:
        yield told, None
    if facts.uncalibrated:  # last: it lasts, and would hide the others
        text = _sentence(facts.uncalibrated)
        yield StatusLine("calibration", "caution", "The calibration is not used.", text), None


def slow(facts: Facts) -> StatusLine | None:
    """Say that the computer is too slow for the pairs, and what that costs."""
    pace = facts.pace
    few = pace.read >= FEWEST and pace.per_s < SLOW_SHARE * pace.nominal_per_s
    if not (few or pace.dropped):
        return None
    told = [f"{pace.per_s:.0f} of {pace.nominal_per_s:.0f} pairs a second arrive."] if few else []
    told += (
        [f"{pace.dropped} pairs were not estimated; a recording has them."] if pace.dropped else []
    )
    cost = "What it costs is known after a touch."
    if facts.result and (known := facts.result.known) and math.isfinite(known.uncertainty):
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


def calm(facts: Facts) -> tuple[Now, StatusLine]:
    """Return what to do if nothing is wrong, and what goes on."""
    seen, kept, following = facts.seen, _kept(facts), _next(facts)
    if facts.state == "done":
        return _complete(facts, following)
    if facts.pressed:
        sub = f"{seen.contact_s:.0f} s so far" if seen.contact_s else "measuring"
        if math.isfinite(seen.left_s):
            sub = f"{seen.left_s:.1f} s more"
        about = f" {_sentence(following)}" if facts.next else ""
        return Now("Hold", sub, "busy", seen.share), StatusLine(
            "contact", "quiet", "", f"Measuring.{about}"
        )
    if facts.state != "baseline":
        if facts.finished:
            title, text, sub = facts.finished
            return Now("Done", sub, "good"), StatusLine("finished", "note", title, text)
        noise = max(one.noise_pF for one in seen.channels)
        told = f"Noise {number_format.error(1e3 * noise)} fF." if math.isfinite(noise) else ""
        doubt = (
            ", if nothing was touched at Tare anyway; else lift the probe, and press Tare"
            if facts.forced
            else ""
        )
        text = " ".join(part for part in (f"Ready{doubt}.", kept, told) if part)
        sub = f"{following}: press, and hold" if facts.next else "press, and hold"
        return Now("Touch", sub), StatusLine("ready", "quiet", "", text, f"Ready{doubt}.")
    if facts.result and not facts.result.revised:
        text = f"{kept} Its result is revised when the baseline after it is known."
        return Now("Wait", "a second without touching"), StatusLine(
            "after", "quiet", "", text.strip()
        )
    line = StatusLine("first baseline", "quiet", "", "The baseline is being measured.")
    return Now("Wait", "do not touch anything"), line


def _complete(facts: Facts, following: str) -> tuple[Now, StatusLine]:
    kept = _kept(facts) or "The touch is complete."
    sub = f"kept; then {following}" if facts.next else "the touch is complete"
    if facts.result and facts.result.late:
        sub = f"touch {facts.result.number} counts · {facts.result.late}"
    now = Now("Lift", sub, "good", 1.0)
    if facts.seen.done_s > LONG_S:
        text = f"{kept} The next touch needs a new contact."
        return now, StatusLine("left in contact", "note", "Lift the probe.", text)
    return now, StatusLine("done", "quiet", "", kept, "Complete.")


def demo(facts: Facts, hand: tuple[str, str]) -> tuple[Now, StatusLine]:
    """Return what the simulated hand does, in words for someone without a probe."""
    on, then = hand
    text = "A simulated hand touches four specimens, round after round. With your board: `palpate doctor`"
    line = StatusLine("demo", "note", "Simulation.", text)
    if facts.state == "done":
        return Now("Lifting", f"the touch on {on} is complete", "good", 1.0), line
    if facts.pressed:
        left = f": {facts.seen.left_s:.1f} s more" if math.isfinite(facts.seen.left_s) else ""
        return Now("Holding", f"the hand presses on {on}{left}", "busy", facts.seen.share), line
    if facts.state == "baseline" and not facts.result:
        return Now("Waiting", "the baseline is being measured"), line
    return Now(
        "Lifted", f"next, the hand touches {then}" if then else "the next round follows"
    ), line


def _kept(facts: Facts) -> str:
    return f"Touch {facts.result.number} is kept." if facts.result and not facts.result.why else ""


def _next(facts: Facts) -> str:
    given = facts.next or {}
    counted = f"touch {given['nth']} of {given['of']}" if given.get("of") else "the next touch"
    return f"{given['name']}, {counted}" if given.get("name") else counted


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
