"""Reference of the levels of both channels: jumps at rest, steps within a press, a channel that does not follow.

A hand trembles, and a level that jumped has the idle noise. The core does the same frame by frame, with numbers in place of
the frames that this keeps.
"""

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from palpate.reference.judgement import Judgement

# of a new level
STILL_S = 0.8
STILL_FRAMES = 5
# noises, or code steps: a channel is off its level
LIMIT = 12.0
CODES = 2.5
COARSEST = 0.02  # pF: a larger change is no code step
NOISE_OF_CODE = 0.3  # of a code step: its rounding
SLOW_NOISE = 32  # times it is followed, in which the noise may double
RARELY = 8  # frames, until the levels are followed again
LEAST_JUMP = (
    256  # of the last press: this part of it; a smaller change of the level is the revision's
)
DRIFTED = 0.05  # share of a press that its baselines may drift
ALONE = 30.0  # no probe has such a ratio
EARLY_S = 0.3  # so long before a press a jump is none of the press
# the longest still press of a stage
PENDING_S = 10.0
PENDING_FRAMES = 300
# noises; frames
TREMBLES = 8.0
SETTLED_FRAMES = 16
ROUGH_FRAMES = 8
HIGH = 0.8  # share of the press: not in its rise or fall
ALIGNED_S = 0.04  # frames further apart show another part of the tremor
OTHER = 3.0  # noises
OWN = 4.0  # its own change
ROUNDED = 0.5  # code steps
# of the CUSUM, in noises
MOST = 3.0
STUCK = 12.0
ASKED = 2  # still presses with equal values


class Known(NamedTuple):
    """The state of the tracker after a frame, as the levels use it.

    Attributes
    ----------
    ready, idle : bool
        Whether the baselines are measured; whether the gate is idle.
    levels, noises, codes : (float, float), pF
        Of the hard and the soft channel: baseline, noise of a frame, step of codes that are coarser than the noise, or 0.

    Examples
    --------
    >>> Known(True, True, (9.0, 8.0), (4e-5, 4e-5)).codes
    (0.0, 0.0)
    """

    ready: bool
    idle: bool
    levels: tuple[float, float]
    noises: tuple[float, float]
    codes: tuple[float, float] = (0.0, 0.0)


@dataclass
class _Side:
    """One channel."""

    name: str
    rest: float = 0.0
    noise: float = 0.0
    last: float = np.nan
    change: float = 0.0
    now: float = 0.0  # from the level
    code: float = 0.0
    height: float = 0.0  # of the press
    least: float = 0.0  # of a jump
    stuck: float = 0.0
    equal: int = 0
    stands: int = 0
    left: int = 0
    near: bool = True
    reported: bool = False
    run: list[float] = field(default_factory=list)

    @property
    def limit(self) -> float:
        return max(LIMIT * self.noise, CODES * self.code)

    @property
    def off(self) -> float:
        return float(np.mean(self.run)) - self.rest

    @property
    def is_out(self) -> bool:
        return abs(self.now) > self.limit

    @property
    def is_high(self) -> bool:
        return self.now > HIGH * self.height

    def differs(self, change: float = 0.0) -> bool:
        """Return whether the level has changed by another amount."""
        return abs(self.off - change) > self.limit + DRIFTED * self.height + self.least

    def is_alone(self, other: "_Side") -> bool:
        return self.differs() and ALONE * abs(other.off) < abs(self.off)

    def strays(self) -> bool:
        """Return whether the last value does not belong to the run."""
        return bool(self.run) and abs(self.last - float(np.mean(self.run))) > self.limit / 2

    def read(self, time: int, value: float, known_code: float) -> None:
        """Take the value of a frame."""
        self.change = value - self.last
        size = abs(self.change)
        if known_code > 0:
            self.code = known_code
        elif 0 < size < COARSEST:
            self.code = min(self.code or np.inf, size)
        self.equal = self.equal + 1 if self.change == 0 else 0
        self.last = value
        self.now = value - self.rest
        self.left = time if self.near else self.left
        self.near = abs(self.now) <= self.limit / 2

    def follow(self, level: float, noise: float) -> None:
        """Take the level and the noise of the tracker."""
        self.rest = level
        self.noise = self.noise * (1 + 1 / SLOW_NOISE) if 0 < self.noise < noise else noise
        self.noise = max(self.noise, NOISE_OF_CODE * self.code)

    def press(self, other: "_Side", *, aligned: bool) -> bool:
        """Take a frame of a press; return whether this channel has not followed the other one."""
        self.height = max(self.height, abs(self.now))
        if aligned:
            due = max(abs(other.change) - OTHER * other.noise, 0.0) * (self.now / other.now)
        else:
            due = 0.0
        own = self.noise if 0 < 2 * self.code < self.noise else 0.0
        missing = (due + own - OWN * abs(self.change) - ROUNDED * self.code) / (
            self.noise + self.code
        )
        if self.now > self.height - self.limit:
            self.stuck = max(self.stuck + min(missing, MOST), 0.0)
        else:
            self.stuck = 0.0
        found = self.stuck > STUCK and not self.reported
        self.reported = self.reported or found
        return found

    def close(self) -> None:
        """End a press."""
        self.least = self.height / LEAST_JUMP if self.height > 0 else self.least
        self.height = 0.0
        self.stuck = 0.0
        self.reported = False


@dataclass
class _Press:
    """Frames in which both channels are off their levels."""

    together: int  # the first one
    sharp: int  # the one with the largest change of direction
    rises: bool
    frames: int = 0
    turn: float = 0.0
    rough: float = 0.0  # mean change of the hard channel
    calm: float = 1.0  # its least share


@dataclass
class Levels:
    """The levels of both channels, frame by frame.

    Attributes
    ----------
    judgements : list of Judgement
    moved_to : (float, float, int)
        After a change: the levels of both channels, pF, and from how many frames they are known.

    Examples
    --------
    A channel jumps, and after 0.8 s it is at its new level:

    >>> levels, at_rest = Levels(), Known(True, True, (9.0, 8.0), (1e-4, 1e-4))
    >>> in_contact = at_rest._replace(idle=False)
    >>> _ = [levels.take(t, 9.0, 8.0, at_rest, begun=False) for t in (0, 50_000_000)]
    >>> [levels.take(100_000_000 * k, 9.5, 8.0, in_contact, begun=k == 4) for k in range(1, 11)][-2:]
    ['dropped', '']
    >>> levels.judgements
    [Judgement(what='jumped', channel='hard', time=100000000, size=0.5, soft_size=0.0)]
    """

    judgements: list[Judgement] = field(default_factory=list)
    moved_to: tuple[float, float, int] = (np.nan, np.nan, 0)
    _hard: _Side = field(default_factory=lambda: _Side("hard"))
    _soft: _Side = field(default_factory=lambda: _Side("soft"))
    _known: bool = False
    _frames: int = 0  # since the levels were followed
    _begin: int = 0  # of the run
    _last: int = 0
    _decided: bool = False
    _touched: bool = False
    _press: _Press | None = None
    _raised: bool = False
    _presses: int = 0
    _hand: float = 1.0
    _jump: tuple[float, float] = (0.0, 0.0)
    _jump_taken: bool = False
    _pending: bool = False
    _since: int = 0
    _waited: int = 0

    @property
    def noises(self) -> tuple[float, float]:
        """Noise of a frame of the hard and of the soft channel, pF."""
        return self._hard.noise, self._soft.noise

    def take(self, time: int, hard: float, soft: float, known: Known, *, begun: bool) -> str:
        """Take a frame, after the tracker; return what it changes.

        Parameters
        ----------
        time : int, ns
        hard, soft : float, pF
        known : Known
        begun : bool
            Whether a touch begins with it.

        Returns
        -------
        str
            "saturated": a channel does not follow in this touch. Or both baselines are new, and: "moved": no touch is
            concerned; "dropped": only a jump began the touch; "jumped": the touch was a jump; "stepped": a channel jumped
            within it; "returned": the touch that was a jump was one. "": nothing.
        """
        self._hard.read(time, hard, known.codes[0])
        self._soft.read(time, soft, known.codes[1])
        self._touched = self._touched or begun
        self._follow(known)
        if not self._known or (self._hard.near and self._soft.near):
            self._rest()
            return ""
        self._run(time)
        stuck = self._pressed(time)
        change = ""
        if known.ready and not self._decided and self._is_still(time):
            change = self._decide(time)
        if change:
            self.moved_to = (
                float(np.mean(self._hard.run)),
                float(np.mean(self._soft.run)),
                len(self._hard.run),
            )
            self._touched = False
        return change or ("saturated" if stuck and self._touched else "")

    def _is_still(self, time: int) -> bool:
        return len(self._hard.run) >= STILL_FRAMES and (time - self._begin) / 1e9 >= STILL_S

    def _follow(self, known: Known) -> None:
        """Take the levels of the tracker while nothing is touched, unless they have jumped."""
        sides = list(zip((self._hard, self._soft), known.levels, known.noises, strict=True))
        agrees = all(side.near and abs(level - side.rest) <= side.limit for side, level, _ in sides)
        self._frames = (self._frames + 1) % RARELY
        is_due = agrees and self._frames == 0
        if known.ready and known.idle and (is_due or not self._known):
            self._known = True
            for side, level, noise in sides:
                side.follow(level, noise)

    def _rest(self) -> None:
        """End the press and the run, as both channels are near their levels."""
        if self._hard.run:
            self._close()
        self._hard.run = []
        self._soft.run = []

    def _run(self, time: int) -> None:
        """Add a frame to the run, or begin another one with it."""
        sides = self._hard, self._soft
        if not self._hard.run or any(side.strays() for side in sides):
            self._hard.run = []
            self._soft.run = []
            self._begin = time
            self._decided = False
        for side in sides:
            side.run.append(side.last)

    def _pressed(self, time: int) -> bool:
        """Follow a press; return whether a channel has not followed the other one."""
        self._waited += 1
        hard = self._hard
        soft = self._soft
        if not (hard.is_out and soft.is_out):
            return False
        aligned = (time - self._last) / 1e9 <= ALIGNED_S
        self._last = time
        self._press = self._press or _Press(time, time, rises=hard.now > 0)
        press = self._press
        press.frames += 1
        press.rough += (abs(hard.change) - press.rough) / ROUGH_FRAMES
        if press.frames > SETTLED_FRAMES and press.rough < press.calm * hard.now:
            press.calm = press.rough / hard.now
        turn = abs(hard.change * soft.now - soft.change * hard.now)
        if (hard.is_high or soft.is_high) and turn > press.turn:
            press.turn = turn
            press.sharp = time
        found = False
        for side, other in ((hard, soft), (soft, hard)):
            if side.press(other, aligned=aligned):
                found = True
                self.judgements.append(Judgement("saturated", side.name, time, side.last))
        return found

    def _close(self) -> None:
        """End the press."""
        press = self._press
        self._press = None
        if press and press.frames >= STILL_FRAMES:
            self._raised = self._raised or press.rises
            self._presses += 1
            if self._presses == ASKED and not self._raised:
                sizes = -self._hard.height, -self._soft.height
                self.judgements.append(Judgement("falling", "both", press.together, *sizes))
            self._hand = min(self._hand, press.calm)
        self._hard.close()
        self._soft.close()
        self._touched = self._pending = False

    def _decide(self, time: int) -> str:
        """Decide about channels that are still: they are at their levels, or at new ones, or it is pending."""
        hard = self._hard
        soft = self._soft
        change = ""
        if hard.is_alone(soft):
            change = self._one(hard)
        elif soft.is_alone(hard):
            change = self._one(soft)
        elif hard.differs() or soft.differs():
            change = self._both(time)
            if self._pending:
                return ""
        self._close()
        for side in (hard, soft):
            side.rest = float(np.mean(side.run))
        self._decided = True
        return change

    def _one(self, side: _Side) -> str:
        """Judge one channel that is off its level, while the other one is not."""
        press = self._press if self._press and self._press.frames >= STILL_FRAMES else None
        is_step = press is not None and (press.together - side.left) / 1e9 < EARLY_S
        time = press.sharp if press and is_step else side.left
        self.judgements.append(
            Judgement("step" if is_step else "jumped", side.name, time, side.off)
        )
        if not self._touched:
            return "moved"
        if is_step:
            return "stepped"
        return "jumped" if press else "dropped"

    def _both(self, time: int) -> str:
        """Judge both channels, which are off their levels."""
        hard = self._hard
        soft = self._soft
        offs = hard.off, soft.off
        if (
            self._jump_taken
            and not hard.differs(-self._jump[0])
            and not soft.differs(-self._jump[1])
        ):
            self.judgements.append(Judgement("was_touch", "both", hard.left, *offs))
            self._jump_taken = self._pending = False
            return "returned"
        if not self._raised and max(offs) < 0:  # the first level was measured in contact
            self._pending = False
            return ""
        if not self._pending or hard.differs(self._jump[0]) or soft.differs(self._jump[1]):
            self._jump = offs
            self._jump_taken = False
            self._since = hard.left
            self._waited = 0
            self._ask()
        is_no_hand = self._hand < 1 and self._hand * offs[0] > TREMBLES * hard.noise
        lasts = (time - self._since) / 1e9 >= PENDING_S and self._waited >= PENDING_FRAMES
        self._pending = not (offs[0] < 0 or is_no_hand or lasts)
        if not self._pending:
            self._jump_taken = True
            self.judgements.append(Judgement("jumped", "both", self._since, *offs))
        return "jumped" if self._touched else "moved"

    def _ask(self) -> None:
        """Ask about a channel whose values are all equal in the second still press: it may be saturated."""
        for side in (self._hard, self._soft):
            if side.equal + 1 >= len(side.run):
                side.stands += 1
                if side.stands == ASKED:
                    self.judgements.append(Judgement("still", side.name, self._begin, side.last))
