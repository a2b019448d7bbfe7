"""Rules about the device, the computer and the disk: what is wrong with the measurement itself."""

import math

from palpate.live.desk.facts import Facts
from palpate.live.desk.watching import CHANNELS
from palpate.live.desk.words import Line, Now, View, count, read_by, sentence, subject, which

SILENT_S, SILENT_PERIODS = 1.0, 10
"""Without a pair for this time, and for so many periods, a measurement is silent."""
CONSTANT_S = 1.0
"""A channel has the same value for this time before that is told."""
SLOW_SHARE, LATE_SHARE, FEWEST = 0.9, 0.05, 50
"""Too slow: fewer pairs than this part of those that should come; more late ones; of so many pairs at least."""


def failed(facts: Facts) -> View | None:
    """Tell that the measurement has ended, and why."""
    if facts.state != "ended":
        return None
    if not facts.error:
        text = "The source has no more samples. Measure again begins a new measurement."
        return View(Line("ended", "note", "Ended.", text), Now("Stop", "the measurement has ended"))
    text = f"{sentence(facts.error)}{_missing(facts)} Measure again begins a new measurement."
    line = Line("ended", "fault", "The measurement ended with an error.", text)
    return View(line, Now("Stop", "the measurement has ended", "fault"))


def recording_failed(facts: Facts) -> View | None:
    """Tell that the recording failed, and what is lost."""
    if not facts.recording_error:
        return None
    text = (
        f"{sentence(facts.recording_error)}{_missing(facts)} The measurement goes on; record to another name or disk."
    )
    return View(Line("recording", "fault", "The recording failed.", text))


def _missing(facts: Facts) -> str:
    return f" {count(facts.unrecorded, 'pair')} not recorded." if facts.unrecorded else ""


def unplugged(facts: Facts) -> View | None:
    """Tell that the device is gone."""
    text = facts.troubles.get("unplugged")
    if not text:
        return None
    goes_on = " The recording goes on." if facts.recording else ""
    line = Line("unplugged", "fault", "Unplugged.", f"{sentence(text)}{facts.cut_text}{goes_on}")
    return View(line, Now("Stop", "no board: plug it in, it goes on by itself", "fault"))


def wiring(facts: Facts) -> View | None:
    """Tell which wire is off, or which pin is shorted."""
    text = facts.troubles.get("wiring")
    if not text:
        return None
    return View(Line("wiring", "fault", "Look at the wires.", sentence(text)), Now("Stop", "a wire is off", "fault"))


def silent(facts: Facts) -> View | None:
    """Tell that the source sends nothing."""
    least_s = max(SILENT_S, SILENT_PERIODS * (0 if math.isnan(facts.period_s) else facts.period_s))
    if not facts.silent_s > least_s:
        return None
    text = "The source sends nothing. Look at its plug, its cable and its supply."
    return View(Line("silent", "fault", "No data.", text), Now("Wait", "no data comes", "fault"))


def unwired(facts: Facts) -> View | None:
    """Tell that channels always have the same value: nothing is wired, or the source does not measure."""
    constant = which(facts.seen.constant_s, CONSTANT_S)
    if not constant:
        return None
    values = [facts.seen.readings[CHANNELS.index(name)] for name in constant]
    if len(constant) == 2 and not any(values):
        text = "Both channels read 0.000 pF. Wire the hard gauge and the soft one to their inputs."
        line = Line("unwired", "fault", "Nothing wired.", text)
        return View(line, Now("Stop", "nothing is wired to the inputs", "fault"))
    read = " and ".join(f"{value:.3f}" for value in values)
    text = f"{read_by(constant)} the same value all the time, {read} pF: no converter does. Look at wires and source."
    return View(Line("constant", "caution", "Nothing changes.", text), Now("Stop", "look at the wires", "caution"))


def outside(facts: Facts) -> View | None:
    """Tell that a channel left the range of the converter without a touch."""
    if not facts.outside:
        return None
    do = "Lift the probe, then press Centre" if facts.can_centre else "Set the range of the source again"
    text = f"The {subject(facts.outside)} outside the range of the converter without a touch. {do}."
    now = Now("Stop", "lift the probe, then press Centre" if facts.can_centre else "set the range again", "fault")
    return View(Line("range", "fault", "Out of range.", text), now)


def slow(facts: Facts) -> View | None:
    """Tell that pairs come too slowly, too late, or have no room."""
    pace = facts.pace
    few = pace.read >= FEWEST and pace.per_s < SLOW_SHARE * pace.nominal_per_s
    late = pace.read >= FEWEST and pace.late > LATE_SHARE * pace.read
    if not (few or late or pace.dropped):
        return None
    told = [f"{pace.per_s:.0f} of {pace.nominal_per_s:.0f} pairs a second"] if few else []
    told += [f"{pace.late} of the last {pace.read} pairs came late"] if pace.late else []
    told += [f"{pace.dropped} were not estimated, but are recorded if a recording runs"] if pace.dropped else []
    text = f"{sentence('; '.join(told))} Close other programs. Ratios are less sure."
    said = "Pairs come too slowly or too late. Close other programs."
    return View(Line("slow", "caution", "Computer too slow.", text, said))


def hint(facts: Facts) -> View | None:
    """Tell a doubt about the wiring that does not prevent a measurement."""
    text = facts.troubles.get("hint")
    if not text or facts.result or facts.state != "no contact":
        return None
    return View(Line("hint", "note", "Wiring.", sentence(text)))
