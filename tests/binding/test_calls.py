"""The calls that bypass pybind11's dispatcher: the same arguments, errors and signatures as any other."""

import inspect
import math
from fractions import Fraction
from typing import Any

import numpy as np
import palpate
import pytest

ESTIMATORS = [palpate.Rls, palpate.AdaptiveRls, palpate.HandoverRls, palpate.Rls32, palpate.AdaptiveRls32]


@pytest.mark.parametrize("make", ESTIMATORS)
def test_whatever_float_takes_is_taken(make: Any) -> None:
    expected = make().update(2.0, 1.0)
    for output in (2, True + 1, np.float64(2), np.float32(2), np.int16(2), np.array(2.0), Fraction(2)):
        assert make().update(output, 1) == expected


@pytest.mark.parametrize("make", ESTIMATORS)
@pytest.mark.parametrize(
    ("arguments", "kind", "message"),
    [
        ((), TypeError, r"takes exactly 2 numbers \(0 given\)"),
        ((1.0,), TypeError, r"takes exactly 2 numbers \(1 given\)"),
        ((1.0, 2.0, 3.0), TypeError, r"takes exactly 2 numbers \(3 given\)"),
        (("1", 2.0), TypeError, "must be real number, not str"),
        ((1.0, None), TypeError, "must be real number, not NoneType"),
        ((1j, 1.0), TypeError, "must be real number, not complex"),
        (([1.0], 1.0), TypeError, "must be real number, not list"),
        ((10**400, 1.0), ValueError, "got an integer beyond the range of a float"),
        ((1.0, -(10**400)), ValueError, "got an integer beyond the range of a float"),
    ],
)
def test_what_update_refuses(make: Any, arguments: Any, kind: type[Exception], message: str) -> None:
    estimator = make()
    with pytest.raises(kind, match=message):
        estimator.update(*arguments)
    assert estimator == make()


def test_an_error_in_float_comes_through() -> None:
    class Broken:
        def __float__(self) -> float:
            raise ZeroDivisionError("mine")

    with pytest.raises(ZeroDivisionError, match="mine"):
        palpate.Rls().update(Broken(), 1.0)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="keyword"):
        palpate.Rls().update(output=1.0, regressor=1.0)  # type: ignore[call-arg]


@pytest.mark.parametrize("make", ESTIMATORS)
@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_what_is_not_finite_is_refused_and_counted(make: Any, bad: float) -> None:
    estimator = make()
    estimator.update(0.5, 0.25)
    before = estimator.ratio
    assert estimator.update(bad, 0.25) == estimator.update(0.5, bad) == before
    assert (estimator.samples, estimator.rejected) == (1, 2)


@pytest.mark.parametrize("make", ESTIMATORS)
def test_self_is_checked(make: Any) -> None:
    for method, arguments in (("update", (1.0, 1.0)), ("process", ([1.0], [1.0])), ("trace", ([1.0], [1.0]))):
        for wrong in (object(), 3, None, palpate.Tracker()):
            with pytest.raises(TypeError, match="descriptor"):
                getattr(make, method)(wrong, *arguments)
        bare = make.__new__(make)
        with pytest.raises(TypeError, match=r"__init__\(\) has not been called"):
            getattr(bare, method)(*arguments)


def test_self_of_a_subclass() -> None:
    class Forgetful(palpate.AdaptiveRls):
        def __init__(self) -> None:
            """Forget the base."""

    class Both(palpate.AdaptiveRls, palpate.SampleRing):
        def __init__(self) -> None:
            palpate.AdaptiveRls.__init__(self, drift=0.02)
            palpate.SampleRing.__init__(self, 8)

    class Half(palpate.AdaptiveRls, palpate.SampleRing):
        def __init__(self) -> None:
            palpate.SampleRing.__init__(self, 8)

    for make in (Forgetful, Half):
        with pytest.raises(TypeError, match="__init__"):
            make()
        with pytest.raises(TypeError, match="__init__"):
            make.__new__(make).update(1.0, 1.0)
    both = Both()
    assert both.update(0.5, 0.25) == palpate.AdaptiveRls(drift=0.02).update(0.5, 0.25)
    assert both.process([0.5], [0.25]).shape == (1,)
    assert both.push_many(np.zeros(3, both.dtype)) == 3


@pytest.mark.parametrize("name", ["process", "trace"])
def test_arguments_of_a_block(name: str) -> None:
    def call(*arguments: Any, **named: Any) -> Any:
        return getattr(palpate.AdaptiveRls(), name)(*arguments, **named)

    y, x = [0.5, 0.6], [0.25, 0.25]
    expected = call(y, x)
    for found in (call(y, regressor=x), call(regressor=x, output=y), call(y, x, None), call(y, x, out=None)):
        assert found.tobytes() == expected.tobytes()
    out = np.empty_like(expected)
    assert call(regressor=x, out=out, output=y) is out
    for arguments, named, message in [
        ((y,), {}, "missing required argument: 'regressor'"),
        ((), {"regressor": x}, "missing required argument: 'output'"),
        ((y, x), {"output": y}, "multiple values for argument 'output'"),
        ((y, x), {"into": out}, "unexpected keyword argument 'into'"),
        ((y, x, out, 1), {}, "takes at most 3 arguments"),
    ]:
        with pytest.raises(TypeError, match=message):
            call(*arguments, **named)


def test_signatures_can_be_asked_for() -> None:
    assert str(inspect.signature(palpate.Rls.update)) == "(self, output, regressor, /)"
    assert str(inspect.signature(palpate.Rls.process)) == "(self, /, output, regressor, out=None)"
    assert str(inspect.signature(palpate.Tracker.feed)) == "(self, t_hard, t_soft, hard, soft, /)"


def test_feed_checks_as_update_does() -> None:
    tracker = palpate.Tracker()
    with pytest.raises(TypeError, match="takes exactly 4 numbers"):
        tracker.feed(1.0, 2.0)  # type: ignore[call-arg]
    with pytest.raises(TypeError, match="must be real number"):
        tracker.feed(0.0, 0.0, "1", 1.0)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="t_hard"):
        tracker.feed(math.nan, 0.0, 1.0, 1.0)
    assert tracker.readings == 0


def test_the_references_of_arguments_and_results_balance() -> None:
    """A block by the short way and by the long one gives back every reference that it took."""
    import sys

    y, x, out = np.ones(8), np.ones(8), np.empty(8)
    estimator = palpate.AdaptiveRls()
    calls: list[Any] = [(y, x, out), (y[::2], x[::2], out[::2]), (y, x, None)]
    before = [sys.getrefcount(a) for a in (y, x, out, None)]
    for _ in range(1000):
        for arguments in calls:
            estimator.process(*arguments)
    after = [sys.getrefcount(a) for a in (y, x, out, None)]
    assert all(abs(b - a) < 100 for a, b in zip(before, after, strict=True))
