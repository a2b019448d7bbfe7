"""References of UnsuspectedNoise and Influence: all samples that wait are kept, in Decimals."""

from dataclasses import dataclass, field
from decimal import Decimal
from typing import Any

from numpy.typing import NDArray

MEMORY = Decimal("0.995")
SHARE = Decimal("0.02")
FEWEST = 32
PATIENCE = 128
TRUST = 10
SPREAD = Decimal("1.2533141")
MOST = Decimal(FEWEST - 1) / (FEWEST + 1)
"""The largest correlation."""


def share_of(n: int) -> Decimal:
    """Return the share of the n-th magnitude in their mean."""
    return max(SHARE, 1 / Decimal(n))


@dataclass
class Products:
    """Sums of the products of values over 0 and over 1 samples, and of their weights."""

    lag0: Decimal = Decimal(0)
    lag1: Decimal = Decimal(0)
    count: Decimal = Decimal(0)

    def add(self, value: Decimal, before: Decimal) -> None:
        """Add a value."""
        self.lag0 = MEMORY * self.lag0 + value * value
        self.lag1 = MEMORY * self.lag1 + value * before
        self.count = MEMORY * self.count + 1

    def correlation(self) -> Decimal:
        """Return the correlation without Kendall's bias, 0 if there is nothing."""
        if self.lag0 == 0:
            return Decimal(0)
        estimate = self.lag1 / self.lag0
        return max(-MOST, min(MOST, estimate + (1 + 3 * estimate) / self.count))


@dataclass(frozen=True)
class Waiting:
    """A whitened innovation that is not learned yet."""

    limited: Decimal
    innovation: Decimal
    before: Decimal
    rise: bool
    outlier: bool


@dataclass
class Noise:
    """Scale and autocorrelation of innovations."""

    mean: Decimal = Decimal(0)
    products: Products = field(default_factory=Products)
    rho: Decimal = Decimal(0)
    before: Decimal = Decimal(0)
    until_forecast: int = 0
    waiting: list[Waiting] = field(default_factory=list)

    def scale(self) -> Decimal:
        """Return the standard deviation of the whitened innovations."""
        mean = self.mean
        if self.waiting:
            rises = sum(abs(w.limited) for w in self.waiting if w.rise)
            falls = sum(abs(w.limited) for w in self.waiting if not w.rise)
            both = (2 * min(rises, falls) + TRUST * mean) / (len(self.waiting) + TRUST)
            mean = max(mean, both)
        return SPREAD * mean

    def add(self, sample: Waiting, suspected: bool, n: int) -> None:
        """Learn the n-th innovation, or let it wait."""
        if suspected or self.waiting:
            self.waiting.append(sample)
            if not suspected or len(self.waiting) >= PATIENCE:
                self.accept(n)
        else:
            self.mean += share_of(n) * (abs(sample.limited) - self.mean)
            if not sample.outlier:
                self.products.add(sample.innovation, sample.before)
        self.until_forecast -= 1
        if self.until_forecast <= 0:
            self.until_forecast = 1 if n < FEWEST else 8
            self.rho = self.products.correlation()

    def accept(self, n: int) -> None:
        """Learn all that waits, at once."""
        size = len(self.waiting)
        if size == 0:
            return
        older = (1 - share_of(n)) ** size if n > size else Decimal(0)
        mean = sum((abs(w.limited) for w in self.waiting), Decimal(0)) / size
        self.mean += (1 - older) * (mean - self.mean)
        for each in self.waiting:
            if not each.outlier:
                self.products.add(each.innovation, each.before)
        self.waiting = []


class Influences:
    """The influences of samples on the coefficients."""

    def __init__(self, size: int) -> None:
        self.products = [Products() for _ in range(size)]
        self.last = [Decimal(0)] * size

    def add(self, influences: NDArray[Any]) -> None:
        """Add those of a sample."""
        for i, influence in enumerate(influences):
            self.products[i].add(influence, self.last[i])
            self.last[i] = influence

    def factors(self) -> list[Decimal]:
        """Return by how much the variances of the coefficients are larger."""
        factors = []
        for products in self.products:
            factor = Decimal(1)
            if products.lag1 > 0:
                estimate = products.lag1 / products.lag0
                real = estimate**2 / (estimate**2 + 1 / products.count)
                rho = min(MOST, estimate * real * (1 + 4 / (products.count + 4)))
                factor = (1 + rho) / (1 - rho)
            factors.append(factor)
        return factors
