"""The word that says what to do, and the line that says what is wrong: a table of rules, the most urgent one first."""

from palpate.live.desk import faults, touching
from palpate.live.desk.facts import Facts
from palpate.live.desk.words import Line, Now, Rule

URGENT: tuple[Rule, ...] = (
    faults.failed,
    faults.unplugged,
    faults.wiring,
    faults.silent,
    faults.recording_failed,
    faults.unwired,
    faults.outside,
    touching.saturated,
    touching.below,
    touching.gap,
    touching.retaken,
    touching.endless,
    faults.slow,
    touching.swapped,
    touching.left_out,
    faults.hint,
)
"""What may be wrong, the most urgent first."""


def view_of(facts: Facts) -> tuple[Now, Line]:
    """Return what to do, and the most urgent line.

    Examples
    --------
    >>> now, line = view_of(Facts("no contact", troubles={"unplugged": "The board is gone: plug it in again."}))
    >>> now.word, now.tone, line.level, line.title
    ('Stop', 'fault', 'fault', 'Unplugged.')
    """
    now, line = touching.calm(facts)
    urgent = next((found for rule in URGENT if (found := rule(facts))), None)
    return (urgent.now or now, urgent.line) if urgent else (now, line)


DAMAGED = {"changed": "This recording was changed.", "not complete": "This recording is not complete."}
"""What `Verification.verdict` says of a recording that is not as it was made."""


def of_file(name: str, verdict: str, text: str) -> tuple[Now, Line]:
    """Return word and line of a recording that is looked at.

    Parameters
    ----------
    name : str
        Of the file.
    verdict : str
        As `Verification.verdict`: whole or not, its end.
    text : str
        Its rows.
    """
    title = DAMAGED.get(verdict, "")
    line = Line(
        "file", "caution" if title else "quiet", title, f"A recording: {verdict}, {text}. Nothing is being measured."
    )
    return Now("File", name), line
