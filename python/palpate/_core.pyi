# The compiled module as type checkers see it; tests/binding/test_stub.py compares it with the module.
# Classes with an underscore only share declarations; the module does not have them.
from collections.abc import Sequence
from typing import (
    Any,
    ClassVar,
    Final,
    Generic,
    Literal,
    Self,
    SupportsIndex,
    TypeAlias,
    TypedDict,
    TypeVar,
    Unpack,
    overload,
)

import numpy as np
from numpy.typing import ArrayLike, NDArray

from palpate.judgements import Judgement
from palpate.touch import Touch

__version__: str
scenes: tuple[str, ...]

_Scene: TypeAlias = Literal["fixed", "paper", "handheld", "sliding"]
_Real = TypeVar("_Real", np.float64, np.float32)

class _Common(TypedDict, total=False):
    samples: int | None
    seconds: float | None
    full_scale: float
    initial_ratio: float

class _Prior(_Common, total=False):
    initial_covariance: float
    max_covariance: float

class _FixedSettings(_Prior, total=False):
    forgetting: float

class _Gated(_Common, total=False):
    release: float
    falling: bool

class _PaperSettings(_Prior, _Gated, total=False):
    steady: float
    alarmed: float
    drift: float
    threshold: float
    clear_level: float

class _SlidingSettings(_Gated, total=False):
    baseline: Literal["measured", "zero"] | tuple[float, float] | tuple[float, float, float, float]
    host_stamps: bool
    soft_later: float
    period: float
    averaged: float
    false_alarm_interval: float
    smallest_shift: float
    clip: float
    smoothing: float
    guard: float

class _HandheldSettings(_Prior, _SlidingSettings, total=False):
    confirmed: float
    contact_exponent: float
    age: float
    steady: float

class _AnySettings(_FixedSettings, _PaperSettings, _HandheldSettings): ...

class _State:
    __hash__: ClassVar[None]  # type: ignore[assignment]
    def __eq__(self, other: object, /) -> bool: ...

class _Resettable(_State):
    def reset(self) -> None: ...
    def copy(self) -> Self: ...
    settings: Final[dict[str, float]]

class _Counting(_Resettable):
    innovation: Final[float]
    statistic: Final[float]
    alarm: Final[bool]
    threshold: Final[float]
    samples: Final[int]
    rejected: Final[int]

class _Estimator(_Counting, Generic[_Real]):
    def update(self, output: float, regressor: float, /) -> float: ...
    def process(
        self, output: ArrayLike, regressor: ArrayLike, out: NDArray[_Real] | None = None
    ) -> NDArray[_Real]: ...
    def trace(
        self, output: ArrayLike, regressor: ArrayLike, out: NDArray[np.void] | None = None
    ) -> NDArray[np.void]: ...
    ratio: Final[float]
    covariance: Final[float]

class _Rls(_Estimator[_Real]):
    def __init__(
        self,
        *,
        forgetting: float = 0.995,
        initial_ratio: float = 1.0,
        initial_covariance: float = 1000000000000.0,
        max_covariance: float = 1000000000000.0,
    ) -> None: ...

class Rls(_Rls[np.float64]): ...
class Rls32(_Rls[np.float32]): ...

class _AdaptiveRls(_Estimator[_Real]):
    def __init__(
        self,
        *,
        steady: float = 0.995,
        alarmed: float = 0.9,
        drift: float = 0.01,
        threshold: float = 0.05,
        clear_level: float = 0.0,
        initial_ratio: float = 1.0,
        initial_covariance: float = 1000000000000.0,
        max_covariance: float = 1000000000000.0,
    ) -> None: ...

class AdaptiveRls(_AdaptiveRls[np.float64]): ...
class AdaptiveRls32(_AdaptiveRls[np.float32]): ...

class _HandoverRls(_Estimator[_Real]):
    def __init__(
        self,
        *,
        false_alarm_interval: float = 10000000.0,
        smallest_shift: float = 1.5,
        clip: float = 3.0,
        smoothing: float = 0.0625,
        guard: float = 0.0,
        initial_ratio: float = 1.0,
    ) -> None: ...
    standard_error: Final[float]
    noise: Final[float]
    change_at: Final[int | None]
    def predict(self, regressor: float, /) -> tuple[float, float]: ...

class HandoverRls(_HandoverRls[np.float64]): ...
class HandoverRls32(_HandoverRls[np.float32]): ...

class VectorRls(_Counting):
    def __init__(
        self,
        size: int,
        *,
        intercept: bool = False,
        false_alarm_interval: float = 10000000.0,
        smallest_shift: float = 1.5,
        steady: float = 0.995,
        clip: float = 3.0,
        alarmed: float = 0.0,
        initial_covariance: float = 1e280,
        max_covariance: float = 1e280,
    ) -> None: ...
    def update(
        self, output: float, regressors: Sequence[float] | NDArray[np.floating[Any]], /
    ) -> float: ...
    def predict(
        self, regressors: Sequence[float] | NDArray[np.floating[Any]], /
    ) -> tuple[float, float]: ...
    def process(
        self, output: ArrayLike, regressors: ArrayLike, out: NDArray[np.float64] | None = None
    ) -> NDArray[np.float64]: ...
    def trace(
        self, output: ArrayLike, regressors: ArrayLike, out: NDArray[np.void] | None = None
    ) -> NDArray[np.void]: ...
    coefficients: Final[NDArray[np.float64]]
    covariance: Final[NDArray[np.float64]]
    standard_errors: Final[NDArray[np.float64]]
    degrees_of_freedom: Final[float]

_AnyEstimator: TypeAlias = (
    Rls | Rls32 | AdaptiveRls | AdaptiveRls32 | HandoverRls | HandoverRls32 | VectorRls
)

class Bank(_Resettable):
    def __init__(self, estimator: _AnyEstimator, streams: SupportsIndex) -> None: ...
    def update(
        self, output: ArrayLike, regressor: ArrayLike, out: NDArray[Any] | None = None
    ) -> NDArray[Any]: ...
    def process(
        self, output: ArrayLike, regressor: ArrayLike, out: NDArray[Any] | None = None
    ) -> NDArray[Any]: ...
    def __len__(self) -> int: ...
    def __getitem__(self, stream: SupportsIndex, /) -> Any: ...
    streams: Final[int]
    ratio: Final[NDArray[Any]]
    covariance: Final[NDArray[Any]]
    innovation: Final[NDArray[Any]]
    statistic: Final[NDArray[Any]]
    standard_error: Final[NDArray[Any]]
    coefficients: Final[NDArray[np.float64]]
    standard_errors: Final[NDArray[np.float64]]
    degrees_of_freedom: Final[NDArray[np.float64]]
    alarm: Final[NDArray[np.bool_]]
    samples: Final[NDArray[np.uint64]]
    rejected: Final[NDArray[np.uint64]]

class Tracker:
    @overload
    def __init__(
        self, scene: Literal["handheld"] = "handheld", **settings: Unpack[_HandheldSettings]
    ) -> None: ...
    @overload
    def __init__(self, scene: Literal["sliding"], **settings: Unpack[_SlidingSettings]) -> None: ...
    @overload
    def __init__(self, scene: Literal["fixed"], **settings: Unpack[_FixedSettings]) -> None: ...
    @overload
    def __init__(self, scene: Literal["paper"], **settings: Unpack[_PaperSettings]) -> None: ...
    def feed(self, t_hard: float, t_soft: float, hard: float, soft: float, /) -> Touch | None: ...
    def process(
        self, t_hard: ArrayLike, t_soft: ArrayLike, hard: ArrayLike, soft: ArrayLike
    ) -> NDArray[np.void]: ...
    def take(
        self, t_hard: ArrayLike, t_soft: ArrayLike, hard: ArrayLike, soft: ArrayLike
    ) -> None: ...
    def finish(self) -> Touch | None: ...
    def tare(self, force: bool = False) -> None: ...
    def gap(self) -> None: ...
    def touches_since(self, count: int, /) -> list[Touch]: ...
    def revisions_since(self, count: int, /) -> list[int]: ...
    def judgements_since(self, count: int, /) -> list[Judgement]: ...
    scene: Final[_Scene]
    settings: Final[dict[str, Any]]
    state: Final[Literal["baseline", "waiting", "contact", "done"]]
    ratio: Final[float]
    standard_error: Final[float]
    threshold: Final[float]
    readings: Final[int]
    judgements: Final[list[Judgement]]
    touches: Final[list[Touch]]
    touch_count: Final[int]
    revision_count: Final[int]
    retaken: Final[int]
    pressed_again: Final[int]

class SampleRing:
    def __init__(self, capacity: int = 1024) -> None: ...
    def push(self, sample: tuple[Any, ...], /) -> bool: ...
    def row(
        self, sample: tuple[Any, ...], /
    ) -> tuple[int, int, int, int, int, float, float, int, int]: ...
    def push_many(self, samples: NDArray[np.void], /) -> int: ...
    def pop_many(self, out: NDArray[np.void], /) -> int: ...
    def close(self) -> None: ...
    def __len__(self) -> int: ...
    dtype: Final[np.dtype[np.void]]
    capacity: Final[int]
    dropped: Final[int]
    first_dropped: Final[int | None]
    closed: Final[bool]

def cusum(
    false_alarm_interval: float, smallest_shift: float, clip: float, /
) -> tuple[float, float, float, float]: ...
def run_length(drift: float, threshold: float, shift: float, clip: float, /) -> float: ...
def parse_rows(
    text: bytes, scale: tuple[int, float] | None, uncertainty: bool, /
) -> NDArray[np.void] | None: ...
def format_rows(samples: NDArray[np.void], /) -> bytes: ...
