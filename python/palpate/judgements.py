"""What is judged of readings, beside the results of touches."""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from math import isnan, nan
from typing import Final, NamedTuple

from palpate.number_format import plain


class Judgement(NamedTuple):
    """One judgement of the readings of a channel, or of both.

    Attributes
    ----------
    time_s : float, s
        Time of the first reading that it is about; nan: the recording has no times.
    channel : str
        "hard", "soft" or "both".
    name : str
        "saturated": at the end of its range, or it does not follow the other channel; "frozen": it
        stands still to the last digit; "jumped": without contact, to a new level; "was_touch": what
        was taken for a jump of both channels; "step": within a touch; "falling": both channels,
        when pressed; "still": at its highest reading in several presses.
    size : float, pF
        Where the channel stands, or by how much it changed; of both: of the hard one.
    soft_size : float, pF
        Of both: of the soft one; else 0.

    Examples
    --------
    >>> print(Judgement(9.9, "hard", "jumped", 3.1).text)
    the hard channel jumped by +3.1 pF at 9.9 s
    """

    time_s: float
    channel: str
    name: str
    size: float
    soft_size: float = 0.0

    @property
    def text(self) -> str:
        """The judgement as a sentence."""
        return _TEXTS[self.name](self)

    def without_time(self) -> "Judgement":
        """Return the judgement of a recording without times."""
        return self._replace(time_s=nan)

    def as_dict(self) -> dict[str, object]:
        """Return plain numbers and text, for JSON."""
        return {**plain(self._asdict()), "text": self.text}

    def _when(self, text: str, decimals: int = 1) -> str:
        """Return a text about its time, which is put in the place of {}; "": it is unknown."""
        return "" if isnan(self.time_s) else text.format(f"{self.time_s:.{decimals}f} s")


_NOTHING = "nothing is connected, no excitation, or a CAPDAC that is too large"


_ENDS = (4.096, 8.192, 15.0)  # pF, of the converters; also below 0
_NEAR = 5e-4


def _saturated(judgement: Judgement) -> str:
    if not any(abs(abs(judgement.size) - end) < _NEAR for end in _ENDS):
        return (
            f"the {judgement.channel} channel stays at its highest reading, {judgement.size:.4g} "
            "pF, while the other one moves"
        )
    where = f"the {judgement.channel} channel is at the end of its range, {judgement.size:.4g} pF"
    cause = "no CAPDAC, or one that is too small" if judgement.size > 0 else _NOTHING
    return f"{where}{judgement._when(', from {} on')}: {cause}"


def _frozen(judgement: Judgement) -> str:
    channel, value = judgement.channel, judgement.size
    since = judgement._when(" from {} on")
    if value == 0:
        return f"the {channel} channel is exactly 0{since}: {_NOTHING}"
    return (
        f"the {channel} channel stands at {value:.6g} pF to the last digit{since}: "
        "a frozen program, a full range, or a stage that stopped there"
    )


def _jumped(judgement: Judgement) -> str:
    if judgement.channel == "both":
        sizes = f"{judgement.size:+.2g} and {judgement.soft_size:+.2g} pF"
        return f"both channels jumped, by {sizes}{judgement._when(', at {}')}"
    size = f"{judgement.size:+.2g} pF"
    return f"the {judgement.channel} channel jumped by {size}{judgement._when(' at {}')}"


def _was_touch(_: Judgement) -> str:
    return "both channels fell by what they had jumped: it was a touch"


def _step(judgement: Judgement) -> str:
    size = f"{judgement.size:+.2g} pF"
    when = judgement._when(" at {}", decimals=2)
    return f"the {judgement.channel} channel stepped by {size}{when}, within a press"


def _falling(judgement: Judgement) -> str:
    if judgement.size > 0:
        return "both channels rise when pressed, and the option falling is set: leave it out"
    return (
        "both channels fall when pressed: wired inversely, or mutual capacitance; option: falling"
    )


def _still(judgement: Judgement) -> str:
    return (
        f"the {judgement.channel} channel stays at {judgement.size:.4g} pF in several presses: did "
        "the stage stop there? If not, it is at the end of its range"
    )


_TEXTS: Final[dict[str, Callable[[Judgement], str]]] = {
    "saturated": _saturated,
    "frozen": _frozen,
    "jumped": _jumped,
    "was_touch": _was_touch,
    "step": _step,
    "falling": _falling,
    "still": _still,
}


MOST_ALIKE = 3
"""Judgements of one name and channel that are told one by one."""


_AT_ONCE_S = 1.0  # in which a channel that trembles reaches its end again


def without_repeats(judgements: Iterable[Judgement]) -> Iterator[Judgement]:
    """Yield judgements without those that repeat that a channel is at the end of its range.

    They are a channel that reaches its end again at once, as it trembles; and one that is frozen
    there.
    """
    last_s: dict[tuple[str, float], float] = {}
    for judgement in judgements:
        place = judgement.channel, judgement.size
        before_s = last_s.get(place)
        if judgement.name == "saturated":
            last_s[place] = judgement.time_s
            if before_s is not None and judgement.time_s - before_s < _AT_ONCE_S:
                continue
        if judgement.name != "frozen" or before_s is None:
            yield judgement


def judgement_notes(judgements: Iterable[Judgement]) -> Iterator[str]:
    """Yield a sentence for each judgement; where there are many of a kind, how many more there are."""
    kinds = Counter[tuple[str, str]]()
    for judgement in without_repeats(judgements):
        kind = judgement.channel, judgement.name
        kinds[kind] += 1
        if kinds[kind] <= MOST_ALIKE:
            yield judgement.text
    for (channel, name), count in kinds.items():
        if count > MOST_ALIKE:
            who = "both channels" if channel == "both" else f"the {channel} channel"
            times = "once" if count - MOST_ALIKE == 1 else f"{count - MOST_ALIKE} times"
            yield f"{who}: {name.replace('_', ' ')} {times} more"
