"""Reference of the windows of `adaptive_window`: which samples are read, which are cut, and how uncertain their ratio is.

The core keeps only sums of blocks, about a ratio that it holds; this keeps the samples, and adds up those of each block.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from palpate.reference.decisions import Decisions

LEVELS = 14  # sizes of blocks: 4, 8, 16, ... samples
BASE = 4  # samples of the smallest block
SHORTEST = 8  # smallest blocks in a window that is tested
MEMORY = 32  # contrasts learned for each level
KEPT = 16  # of them after a cut
ENOUGH = 7  # degrees of freedom before finer levels must agree to join
FEWEST = 4  # degrees of freedom for a test and a standard error
READ_SQUARE = 3  # square of the normal deviate of the intervals of the windows
# square of 1.5: of two noises that agree, in standard deviations of their ratio
AGREE_SQUARE = 2.25
NEWEST = 4  # fewest blocks of the newest half of a window


class Sample(NamedTuple):
    """Weight w, output y and regressor x."""

    weight: Any
    output: Any
    regressor: Any


class Sums(NamedTuple):
    """Sums over samples: of w y, and of w x."""

    moment: Any
    information: Any

    @property
    def ratio(self) -> Any:
        """Ratio of the samples."""
        return self.moment / self.information

    def with_(self, other: "Sums") -> "Sums":
        """Return the sums over the samples of both."""
        return Sums(self.moment + other.moment, self.information + other.information)


class Contrast(NamedTuple):
    """The squared difference of two ratios, over 1 / R1 + 1 / R2; and 1 / (1 / R1 + 1 / R2)."""

    noise: Any
    weight: Any


def contrast(one: Sums, other: Sums) -> Contrast | None:
    """Return the contrast of two sums; None if one has no information."""
    if not (one.information > 0 and other.information > 0):
        return None
    weight = 1 / (1 / one.information + 1 / other.information)
    return Contrast((one.ratio - other.ratio) ** 2 * weight, weight)


class Learned(NamedTuple):
    """Contrasts of the blocks of one size: sums of weight times noise, of the weight, and of its square."""

    total: Any
    weight: Any
    squares: Any

    @property
    def noise(self) -> Any:
        """Mean of the contrasts by their weights: the variance of a ratio, times its information."""
        return self.total / self.weight

    @property
    def count(self) -> Any:
        """Number of contrasts of equal weight that would have an equally certain mean."""
        return self.weight**2 / self.squares if self.weight > 0 else self.weight

    def with_(self, one: Contrast | None) -> "Learned":
        """Return it with one more contrast."""
        if one is None:
            return self
        total = self.total + one.weight * one.noise
        return Learned(total, self.weight + one.weight, self.squares + one.weight**2)

    def times(self, share: Any) -> "Learned":
        """Return it with this share of each contrast."""
        return Learned(share * self.total, share * self.weight, share * self.squares)


class Pooled(NamedTuple):
    """Sum of the noises of some levels times their counts, and of the counts."""

    total: Any
    freedom: Any

    @property
    def noise(self) -> Any:
        """Variance of a ratio, times its information."""
        return self.total / self.freedom

    def with_(self, level: Learned) -> "Pooled":
        """Return it with one more level."""
        if not level.weight > 0:
            return self
        return Pooled(self.total + level.noise * level.count, self.freedom + level.count)


class Interval(NamedTuple):
    """Middle and half width of an interval of ratios."""

    middle: Any
    half: Any


@dataclass
class Block:
    """Samples in a row, their sums, and the interval of the window that begins with them and ends now; None: it has none."""

    samples: list[Sample]
    sums: Sums
    interval: Interval | None = None


class Limits(NamedTuple):
    """Limits of the square of a difference of ratios, times its information: of an interval, and of a cut."""

    read: Any
    cut: Any


class Border(NamedTuple):
    """A border between blocks: a level, and a number of its oldest blocks."""

    level: int
    oldest: int


class Variance(NamedTuple):
    """Variance of a ratio: of the noise, with its degrees of freedom; and the square of how far it may have moved."""

    noise: Any
    freedom: Any
    moved: Any


def root(value: Any) -> Any:
    """Return the square root, of the same type."""
    return value.sqrt() if hasattr(value, "sqrt") else np.sqrt(value)


def student_square(normal_square: Any, freedom: Any) -> Any:
    """Return the square of the Student statistic that is as rare as a normal deviate (Wallace 1959)."""
    exponent = ((8 * freedom + 3) / (8 * freedom + 1)) ** 2 * normal_square / freedom
    return freedom * (exponent.exp() - 1 if hasattr(exponent, "exp") else np.expm1(exponent))


@dataclass
class Windows:
    """The samples since the last cut, in blocks of 4, 8, 16, ... samples.

    Of four blocks of a size the two oldest become one of the next size, and what they differ by is learned: what noise does
    at this scale. Windows end with the newest block. When a level got a block, its windows and those of all finer levels are
    tested, and what is older than the newest window that differs from it is cut; and their intervals are found. The window
    that is read is the longest one whose interval, and those of all shorter ones, have a ratio in common.

    Attributes
    ----------
    number : callable
        Type of all calculations.
    decisions : Decisions
    levels : list of list of Block
        The blocks of each size, the oldest first.
    learned : list of Learned
        Of each size.
    filling : list of Sample
        The block that is not complete.
    filled : int
        The samples that it counts as.
    read : list of Block
        Of the window that is read, the newest first, without the one that is not complete.
    slope, moves_until : number
        How fast the ratio moved at the last cut, per information; the information until which it may go on.
    """

    number: Callable[[Any], Any]
    decisions: Decisions
    levels: list[list[Block]] = field(default_factory=lambda: [[] for _ in range(LEVELS)])
    learned: list[Learned] = field(default_factory=list)
    filling: list[Sample] = field(default_factory=list)
    filled: int = 0
    read: list[Block] = field(default_factory=list)
    slope: Any = 0
    moves_until: Any = 0

    def __post_init__(self) -> None:
        """Nothing is learned yet."""
        self.learned = [self.nothing()] * LEVELS

    def nothing(self) -> Learned:
        """Return what is learned at first."""
        return Learned(self.number(0), self.number(0), self.number(0))

    def sums(self, samples: Iterable[Sample]) -> Sums:
        """Return the sums over samples."""
        moment = information = self.number(0)
        for weight, output, regressor in samples:
            moment += weight * output
            information += weight * regressor
        return Sums(moment, information)

    def of_blocks(self, blocks: Iterable[Block]) -> Sums:
        """Return the sums over the samples of blocks."""
        total = self.sums([])
        for block in blocks:
            total = total.with_(block.sums)
        return total

    def all(self) -> Sums:
        """Return the sums over the window that is read, with the newest samples."""
        return self.of_blocks(self.read).with_(self.sums(self.filling))

    def add(self, sample: Sample, *, learns: bool, cut_square: Any) -> bool:
        """Add a sample; return whether older ones were cut.

        Parameters
        ----------
        sample : Sample
        learns : bool
            Whether contrasts are learned.
        cut_square : number
            Square of the normal deviate by which what is cut differs.

        Returns
        -------
        bool
        """
        self.filling.append(sample)
        self.filled += 1
        if self.filled < BASE or not self.sums(self.filling).information > 0:
            return False
        highest = self._push(learns=learns)
        border = self._judge(highest, cut_square)
        if border is not None:
            self._cut(border)
        self._choose()
        return border is not None

    def restart(self, samples: Sequence[Sample]) -> None:
        """Keep only these samples; they count as a block that needs one more."""
        before = self.all()
        after = self.sums(samples)
        change = self.number(0)
        if before.information > 0:
            change = after.ratio - before.ratio
        self._expect_motion(change, before.information + after.information, after.information)
        for level in self.levels:
            level.clear()
        self._shorten()
        self.filling = list(samples)
        self.filled = BASE - 1
        self.read = []

    def variance(self) -> Variance | None:
        """Return the variance of the ratio; None if too few contrasts show the noise."""
        pooled = self._noise_of_all()
        if not pooled.freedom > 0 or self.decisions.above(FEWEST, pooled.freedom):
            return None
        information = self.all().information
        moving = self.slope * information / 2 if self.moves() else self.number(0)
        moved = moving**2 + self._moved_square(pooled.noise)
        return Variance(pooled.noise / information, pooled.freedom, moved)

    def moves(self) -> bool:
        """Return whether the ratio may still move as it did at the last change."""
        return self.decisions.above(self.moves_until, self.all().information)

    def _newest_first(self) -> Iterator[tuple[int, int, Block]]:
        """Yield the level, the place in it, and each block."""
        for k, level in enumerate(self.levels):
            for j in reversed(range(len(level))):
                yield k, j, level[j]

    def _blocks(self) -> list[Block]:
        """Return the blocks, the newest first."""
        return [block for _, _, block in self._newest_first()]

    def _push(self, *, learns: bool) -> int:
        """Complete a block; return the highest level that got one."""
        block = Block(self.filling, self.sums(self.filling))
        self.filling = []
        self.filled = 0
        for k, level in enumerate(self.levels):
            level.append(block)
            if len(level) < 4:
                return k
            first, second = level[:2]
            if learns:
                self._learn(k, contrast(first.sums, second.sums))
            samples = [*first.samples, *second.samples]
            block = Block(samples, self.sums(samples))
            del level[:2]
        return LEVELS - 1

    def _learn(self, k: int, one: Contrast | None) -> None:
        """Learn a contrast of a level; with as many as the memory has, the earlier ones count less."""
        learned = self.learned[k]
        if not self.decisions.above(MEMORY, learned.count):
            learned = learned.times(1 - 1 / self.number(MEMORY))
        self.learned[k] = learned.with_(one)

    def _shorten(self) -> None:
        """After a cut: what was learned counts as if it were few contrasts."""
        for k, learned in enumerate(self.learned):
            if learned.count > KEPT:
                self.learned[k] = learned.times(KEPT / learned.count)

    def _joins(self, pooled: Pooled, finer: Learned) -> bool:
        """Return whether the noise of a finer level is the same, as far as so few contrasts show."""
        if not finer.weight > 0 or not pooled.freedom > 0:
            return True
        if self.decisions.above(ENOUGH, pooled.freedom):
            return True
        difference = finer.noise - pooled.noise
        variance = (2 / pooled.freedom + 2 / finer.count) * pooled.noise**2
        return not self.decisions.above(difference**2, self.number(AGREE_SQUARE) * variance)

    def _noise_of(self, k: int) -> Pooled:
        """Return the noise of this level and all coarser ones, and of finer ones up to the first one that differs."""
        pooled = Pooled(self.number(0), self.number(0))
        for learned in self.learned[k:]:
            pooled = pooled.with_(learned)
        for learned in reversed(self.learned[:k]):
            if not self._joins(pooled, learned):
                break
            pooled = pooled.with_(learned)
        return pooled

    def _noise_of_all(self) -> Pooled:
        """Return the noise of the mean of all samples: with the contrast of each block and all that are older."""
        pooled = Pooled(self.number(0), self.number(0))
        older = self.sums([])
        for level, learned in zip(reversed(self.levels), reversed(self.learned), strict=True):
            seen = learned
            for block in level:
                seen = seen.with_(contrast(older, block.sums))
                older = older.with_(block.sums)
            if not self._joins(pooled, seen):
                break
            pooled = pooled.with_(seen)
        return pooled

    def _judge(self, highest: int, cut_square: Any) -> Border | None:
        """Find the intervals of the windows up to this level; return the newest border of a change."""
        blocks = self._blocks()
        border = None
        length = 0
        for place, (k, j, block) in enumerate(self._newest_first()):
            if k > highest:
                break
            length += 2**k
            block.interval = None
            limits = self._limits(blocks[: place + 1], k, cut_square)
            if limits is None or length < SHORTEST:
                continue
            newer = self.of_blocks(blocks[: place + 1])
            older = self.of_blocks(blocks[place + 1 :])
            block.interval = Interval(newer.ratio, root(limits.read / newer.information))
            change = contrast(newer, older)
            if change is None or border is not None:
                continue
            if self.decisions.above(change.noise, limits.cut):
                border = Border(k, j)
        return border

    def _limits(self, window: list[Block], k: int, cut_square: Any) -> Limits | None:
        """Return the limits of a window whose oldest block is of level k; None if too few contrasts show the noise."""
        pooled = self._noise_of(k)
        if not pooled.freedom > 0 or self.decisions.above(FEWEST, pooled.freedom):
            return None
        if not pooled.total > 0:
            return None
        noise = max(pooled.noise, self._scatter(window))
        read_square = student_square(self.number(READ_SQUARE), pooled.freedom)
        return Limits(noise * read_square, noise * student_square(cut_square, pooled.freedom))

    def _scatter(self, window: list[Block]) -> Any:
        """Return the mean contrast of each block of a window and all newer ones; 0 for two blocks."""
        if len(window) < 3:
            return self.number(0)
        total = self.number(0)
        newer = self.sums([])
        for block in window:
            one = contrast(newer, block.sums)
            total += self.number(0) if one is None else one.noise
            newer = newer.with_(block.sums)
        return total / (len(window) - 1)

    def _cut(self, border: Border) -> None:
        """Drop all blocks that are older than a border, and find the intervals of those that are left."""
        gone = self.levels[border.level][: border.oldest]
        del self.levels[border.level][: border.oldest]
        for level in self.levels[border.level + 1 :]:
            gone += level
            level.clear()
        self._shorten()
        old = self.of_blocks(gone)
        left = self.of_blocks(self._blocks())
        change = left.ratio - old.ratio
        self._expect_motion(change, left.information + old.information, left.information)
        self._judge(border.level, self.number("inf"))

    def _expect_motion(self, change: Any, information: Any, left: Any) -> None:
        """After a change the ratio may move on as fast as it did: by the change in half of the information."""
        self.slope = 2 * abs(change) / information
        self.moves_until = 4 * left

    def _choose(self) -> None:
        """Read the longest window whose interval, and those of all shorter ones, have a ratio in common."""
        self.read = []
        low = self.number("-inf")
        high = self.number("inf")
        for block in self._blocks():
            if block.interval is not None:
                middle, half = block.interval
                low = max(low, middle - half)
                high = min(high, middle + half)
                if self.decisions.above(low, high, half):
                    return
            self.read.append(block)

    def _moved_square(self, noise: Any) -> Any:
        """Return the square of how far the ratio may have moved within the window.

        The newest half of a straight line is half as far from its mean as its end is. Of the contrast of the newest half
        and the rest, noise explains as much as itself.
        """
        half = self._newest_half()
        newest = self.of_blocks(self.read[:half])
        rest = self.of_blocks(self.read[half:])
        change = contrast(newest, rest)
        if change is None:
            return self.number(0)
        excess = max(change.noise - noise, self.number(0))
        information = newest.information + rest.information
        return 4 * excess * (1 / newest.information - 1 / information)

    def _newest_half(self) -> int:
        """Return how many of the newest blocks have half of the information of the window; at least four."""
        for count in range(NEWEST, len(self.read)):
            newest = self.of_blocks(self.read[:count])
            rest = self.of_blocks(self.read[count:])
            if not self.decisions.above(rest.information, newest.information):
                return count
        return len(self.read)
