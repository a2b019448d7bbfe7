"""Which touch was on which specimen, which touches are kept, and what comes next."""

from collections import deque
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace
from math import inf, isfinite

from palpate._core import Touch
from palpate.recording.session import MOST_WANTED, Specimen
from palpate.sentences import advice
from palpate.several import objections

DISCARDED = "discarded"
_REMEMBERED = 1000  # changes of the next specimen within one touch
_MOST = 10_000  # touches of earlier measurements


@dataclass
class Done:
    """A touch that has ended.

    Attributes
    ----------
    number : int
        Within this measurement, from 1; of an earlier measurement, 0 and less.
    touch : Touch
    specimen : str or None
    wish : bool or None
        Whether the user wants to keep it; None: its flags decide.
    """

    number: int
    touch: Touch
    specimen: str | None
    wish: bool | None = None

    def why(self, accepted: Collection[str]) -> str:
        """Return why it is left out; nothing if it is kept. accepted: flags that do not exclude a touch."""
        if self.wish is not None:
            return "" if self.wish else DISCARDED
        flags = objections(self.touch, accepted)
        told = [sentence for sentence in advice(self.touch) if sentence.partition(":")[0] in flags]
        return (told or ["" if isfinite(self.touch.ratio) else "it has no ratio"])[0]


@dataclass
class Judged:
    """The touches on one specimen: each with whether it is kept, and the mean ratio of those."""

    touches: list[tuple[Done, bool]] = field(default_factory=list)

    @property
    def kept(self) -> int:
        """How many are kept."""
        return sum(kept for _, kept in self.touches)

    @property
    def mean(self) -> float | None:
        """Mean ratio of those that are kept; None without one."""
        ratios = [done.touch.ratio for done, kept in self.touches if kept]
        return sum(ratios) / len(ratios) if ratios else None


class Progress:
    """Specimens and the touches on them, in consecutive measurements.

    A touch is on the specimen that was the next one when it began. The next one is the one that the user has chosen, else
    the specimen of the last touch until as many touches of it are kept as are wanted, else the next one in the list that
    lacks touches.

    Attributes
    ----------
    specimens : list of Specimen
    present : list of Done
        The touches of this measurement.
    why : dict
        Number of a touch -> why it is left out; "": it is kept.
    judged : dict
        Name of a specimen -> its touches.
    """

    def __init__(self) -> None:
        self.specimens: list[Specimen] = []
        self.present: list[Done] = []
        self.why: dict[int, str] = {}
        self.judged: dict[str, Judged] = {}
        self._accepted: Collection[str] = ()
        self._earlier: deque[Done] = deque(maxlen=_MOST)
        self._chosen: tuple[float, str] | None = None  # when, s, and which
        self._nexts: deque[tuple[float, str | None]] = deque([(-inf, None)], maxlen=_REMEMBERED)

    def begin(self) -> None:
        """Begin a new measurement: times and numbers begin again; what was done stays."""
        count = len(self.present)
        self._earlier += self.present
        self.present = []
        for done in self._earlier:
            done.number -= count
        if self._chosen:
            self._chosen = (-inf, self._chosen[1])
        self._nexts.clear()
        self._nexts.append((-inf, None))
        self.settle(-inf, self._accepted)

    def take(self, touches: Sequence[Touch]) -> None:
        """Take all touches of this measurement: those that are new, and those that were revised since."""
        for done, touch in zip(self.present, touches, strict=False):
            done.touch = touch
        for touch in touches[len(self.present) :]:
            name = next((name for t_s, name in reversed(self._nexts) if not t_s > touch.start_s), None)
            self.present.append(Done(len(self.present) + 1, touch, name))
            if self._chosen and not self._chosen[0] > touch.start_s:
                self._chosen = None
            self.settle(touch.start_s, self._accepted)

    def settle(self, t_s: float, accepted: Collection[str]) -> None:
        """Judge each touch after a change at a time, s, and note what comes next from then on."""
        self._accepted = accepted
        self.judged = {one.name: Judged() for one in self.specimens}
        self.why = {}
        for done in [*self._earlier, *self.present]:
            self.why[done.number] = why = done.why(accepted)
            if done.specimen:
                self.judged.setdefault(done.specimen, Judged()).touches.append((done, not why))
        if (name := self.next) != self._nexts[-1][1]:
            self._nexts.append((t_s, name))

    def replace(self, specimens: Sequence[Specimen]) -> None:
        """Take another list; a touch stays with its specimen."""
        self.specimens = list(specimens)
        if self._chosen and not self.named(self._chosen[1]):
            self._chosen = None

    def choose(self, name: str, now_s: float) -> None:
        """Choose the specimen of the next touch; "": the list decides."""
        self._chosen = (now_s, name) if name else None

    def more(self) -> Specimen | None:
        """Want one touch more of the specimen of the last touch, else of the next one; None: there is none."""
        name = self._last or self.next
        specimen = self.named(name) if name else None
        if specimen is None or (wanted := max(specimen.wanted, self.judged[specimen.name].kept) + 1) > MOST_WANTED:
            return None
        longer = replace(specimen, wanted=wanted)
        self.specimens[self.specimens.index(specimen)] = longer
        self._chosen = None
        return longer

    @property
    def next(self) -> str | None:
        """Name of the specimen of the next touch; None: nothing is lacking."""
        if self._chosen:
            return self._chosen[1]
        last = self._last
        first = next((place for place, one in enumerate(self.specimens) if one.name == last), 0)
        in_turn = [*self.specimens[first:], *self.specimens[:first]]
        return next((one.name for one in in_turn if self.judged[one.name].kept < one.wanted), None)

    def named(self, name: str) -> Specimen | None:
        """Return the specimen with this name; None: it is not in the list."""
        return next((one for one in self.specimens if one.name == name), None)

    @property
    def _last(self) -> str | None:
        """The specimen of the last touch that was on one of the list."""
        newest_first = (done.specimen for part in (self.present, self._earlier) for done in reversed(part))
        return next((name for name in newest_first if name and self.named(name)), None)
