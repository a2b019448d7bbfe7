"""What is shown: interfaces of classes in the layers above."""

from collections.abc import Sequence
from datetime import timedelta
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from palpate._core import Touch, Tracker
from palpate.elasticity import Elasticity

Array = NDArray[np.float64]


class Estimator(Protocol):
    """An estimator of the core; one with a standard error has that, too."""

    @property
    def settings(self) -> dict[str, float]: ...  # noqa: D102
    @property
    def ratio(self) -> float: ...  # noqa: D102
    @property
    def covariance(self) -> float: ...  # noqa: D102
    @property
    def statistic(self) -> float: ...  # noqa: D102
    @property
    def alarm(self) -> bool: ...  # noqa: D102
    @property
    def samples(self) -> int: ...  # noqa: D102
    @property
    def rejected(self) -> int: ...  # noqa: D102


class Pairs(Protocol):
    """A recording in memory."""

    @property
    def t_hard_s(self) -> Array: ...  # noqa: D102
    @property
    def t_soft_s(self) -> Array: ...  # noqa: D102
    @property
    def hard(self) -> Array: ...  # noqa: D102
    @property
    def soft(self) -> Array: ...  # noqa: D102
    @property
    def duration(self) -> timedelta: ...  # noqa: D102
    @property
    def notes(self) -> Sequence[str]: ...  # noqa: D102
    @property
    def understood(self) -> str: ...  # noqa: D102
    @property
    def doubts(self) -> Sequence[str]: ...  # noqa: D102
    @property
    def marks(self) -> Sequence[tuple[float, str]]: ...  # noqa: D102
    @property
    def gap_rows(self) -> Sequence[int]: ...  # noqa: D102


class Curve(Protocol):
    """A calibration."""

    @property
    def fitted(self) -> Any: ...  # noqa: D102
    @property
    def probe(self) -> Elasticity: ...  # noqa: D102
    @property
    def ratios(self) -> Array: ...  # noqa: D102
    @property
    def moduli(self) -> Array: ...  # noqa: D102
    @property
    def range(self) -> tuple[float, float]: ...  # noqa: D102
    @property
    def scatter(self) -> str: ...  # noqa: D102
    @property
    def verdict(self) -> str: ...  # noqa: D102


class Measurement(Protocol):
    """A stream."""

    @property
    def tracker(self) -> Tracker: ...  # noqa: D102
    @property
    def source(self) -> object: ...  # noqa: D102
    @property
    def counters(self) -> Any: ...  # noqa: D102
    @property
    def touches(self) -> Sequence[Touch]: ...  # noqa: D102
