"""Rules about touches and their baseline: what to do with the probe."""

import math
from collections.abc import Callable

from palpate.live.desk.facts import Facts
from palpate.live.desk.watching import CHANNELS
from palpate.live.desk.words import Line, Now, View, count, sentence, subject, which

LIMIT_S = 0.1
"""In contact a channel may be at its limit for this time."""
BELOW_S = 1.0
"""A channel is far below its baseline for this time before that is told."""
LONG_S = 10.0
"""The probe is left in contact after a touch for this time before that is told."""
ENDLESS_S = 60.0
"""A contact after a touch that lasts longer is likely none."""


def saturated(facts: Facts) -> View | None:
    """Tell that a channel was at its limit in this contact."""
    found = which(facts.seen.limit_s, LIMIT_S)
    if not (facts.pressed and found):
        return None
    limit = f", {facts.full_scale_pF:.3f} pF" if math.isfinite(facts.full_scale_pF) else ""
    long_s = max(facts.seen.limit_s)
    text = f"The {subject(found)} at the limit{limit}, for {long_s:.1f} s of this touch. Press less: half of this is enough."
    line = Line("saturated", "caution", "Saturated.", text, f"The {subject(found)} at the limit. Press less.")
    return View(line, Now("Repeat", "lift, then press less", "caution"))


def below(facts: Facts) -> View | None:
    """Tell that a channel is far below its baseline."""
    found = which(facts.seen.below_s, BELOW_S)
    if facts.state != "no contact" or not found:
        return None
    deep = max(facts.seen.below_pF[CHANNELS.index(name)] for name in found)
    text = f"The {subject(found)} {deep:.2f} pF below the baseline: something was touched while taring, or it jumped."
    line = Line("baseline", "fault", "Baseline lost.", text, f"The {subject(found)} below the baseline.")
    return View(line, Now("Tare", "lift the probe, then press T", "fault"))


def gap(facts: Facts) -> View | None:
    """Tell that the measurement goes on after a gap."""
    if math.isinf(facts.gap_s):
        return None
    lost = f": {count(facts.lost, 'pair')} lost" if facts.lost else ""
    text = f"{sentence(facts.gap + lost)}{facts.cut_text} The baseline is measured again."
    return View(Line("gap", "caution", "It goes on after a gap.", text), _wait(facts))


def retaken(facts: Facts) -> View | None:
    """Tell that the baseline was wrong, and is measured again."""
    if math.isinf(facts.retaken_s):
        return None
    text = (
        "The channels fell far below it: it had been measured in contact, or it jumped. It is measured again; a touch "
        "before may be wrong, and is flagged."
    )
    return View(Line("baseline", "caution", "Baseline lost.", text), _wait(facts))


def _wait(facts: Facts) -> Now | None:
    return Now("Wait", "do not touch anything", "caution") if facts.state == "baseline" else None


def left_out(facts: Facts) -> View | None:
    """Tell why the last touch is left out."""
    result = facts.result
    if not (result and result.why) or facts.state in ("contact", "adapting"):
        return None
    lift = "lift, " if facts.pressed else ""
    name = f" {facts.next['name']}" if facts.next and facts.next.get("name") else ""
    how = next((f"{HOW[flag]}, " for flag in result.flags if flag in HOW), "")
    line = Line("left out", "caution", f"Touch {result.number} is left out.", sentence(result.why))
    return View(line, Now("Repeat", f"{lift}{how}touch{name} again", "caution", 1.0 if facts.pressed else None))


HOW = {
    "offset": "hold upright",
    "short": "hold longer",
    "unsettled": "hold longer",
    "saturated": "press less",
    "curve": "press less",
    "unexcited": "press deeper",
    "lag": "press slowly",
    "drift": "hold still",
    "creep": "wait longer",
}
"""What to do better, in two words, by flag."""


def swapped(facts: Facts) -> View | None:
    """Tell that the two inputs seem to be exchanged."""
    if not (facts.result and facts.result.swapped) or facts.state in ("contact", "adapting"):
        return None
    line = Line("swapped", "caution", "Inputs exchanged?", sentence(facts.result.swapped))
    return View(line, Now("Stop", "look at the two wires", "caution"))


def endless(facts: Facts) -> View | None:
    """Tell that a contact lasts so long that it is likely none."""
    if facts.state != "done" or not facts.seen.done_s > ENDLESS_S:
        return None
    text = "Contact has lasted for a minute after the touch. If nothing is touched, the baseline jumped: press Tare anyway."
    return View(Line("endless", "caution", "Still in contact.", text), Now("Lift", "or Tare anyway", "caution", 1.0))


def calm(facts: Facts) -> tuple[Now, Line]:
    """Return what to do if nothing is wrong, and what goes on."""
    return _CALM.get(facts.state, _ready)(facts)


def _done(facts: Facts) -> tuple[Now, Line]:
    kept = _kept(facts) or "The touch is complete."
    now = Now("Lift", f"kept; then {_next(facts)}" if facts.next else "the touch is complete", "good", 1.0)
    if facts.seen.done_s > LONG_S:
        return now, Line("left in contact", "note", "Lift the probe.", f"{kept} The next touch needs a new contact.")
    return now, Line("done", "quiet", "", kept, "Complete.")


def _measuring(facts: Facts) -> tuple[Now, Line]:
    seen, about = facts.seen, f" {sentence(_next(facts))}" if facts.next else ""
    sub = f"{seen.contact_s:.0f} s so far" if math.isfinite(seen.contact_s) else "measuring"
    if math.isfinite(seen.left_s):
        sub = f"{seen.left_s:.1f} s more"
    return Now("Hold", sub, "busy", seen.share), Line("contact", "quiet", "", f"Measuring.{about}")


def _waiting(facts: Facts) -> tuple[Now, Line]:
    if facts.result and not facts.result.revised:
        text = f"{_kept(facts)} Its result is revised when the baseline after it is known."
        return Now("Wait", "a second without touching"), Line("after", "quiet", "", text.strip())
    line = Line("first baseline", "quiet", "", "The baseline is being measured.")
    return Now("Wait", "do not touch anything"), line


def _ready(facts: Facts) -> tuple[Now, Line]:
    noise = max(facts.seen.noise_pF)
    told = f"Noise {1e3 * noise:.2g} fF." if math.isfinite(noise) else ""
    text = " ".join(part for part in ("Ready.", _kept(facts), told, facts.about) if part)
    sub = f"{_next(facts)}: press, and hold" if facts.next else "press, and hold"
    return Now("Touch", sub), Line("ready", "quiet", "", text, "Ready.")


_CALM: dict[str, Callable[[Facts], tuple[Now, Line]]] = {
    "done": _done,
    "contact": _measuring,
    "adapting": _measuring,
    "baseline": _waiting,
    "no contact": _ready,
}


def _kept(facts: Facts) -> str:
    return f"Touch {facts.result.number} is kept." if facts.result and not facts.result.why else ""


def _next(facts: Facts) -> str:
    given = facts.next or {}
    counted = f"touch {given['nth']} of {given['of']}" if given.get("of") else "the next touch"
    return f"{given['name']}, {counted}" if given.get("name") else counted
