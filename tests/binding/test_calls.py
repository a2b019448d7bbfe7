"""What calls of estimators take and refuse; `update` bypasses pybind11's dispatcher."""

from fractions import Fraction
from typing import Any

import numpy as np
import palpate
import pytest
from numeric import every


@every
def test_whatever_float_takes_is_taken(kind: Any) -> None:
    expected = kind().update(2.0, 1.0)
    for output in (
        2,
        True + 1,
        np.float64(2),
        np.float32(2),
        np.int16(2),
        np.array(2.0),
        Fraction(2),
    ):
        assert kind().update(output, 1) == expected


@every
@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        ((), TypeError, r"takes exactly 2 numbers \(0 given\)"),
        ((1.0, 2.0, 3.0), TypeError, r"takes exactly 2 numbers \(3 given\)"),
        ((1.0, "2"), TypeError, "regressor: got '2', allowed: a number"),
        (([1.0], 1.0), TypeError, r"output: got \[1.0\], allowed: a number"),
        ((10**400, 1.0), ValueError, "output: got an integer beyond the range of a float"),
    ],
)
def test_what_update_refuses(
    kind: Any, arguments: Any, error: type[Exception], message: str
) -> None:
    estimator = kind()
    with pytest.raises(error, match=message):
        estimator.update(*arguments)
    assert estimator == kind()


@every
def test_self_is_checked(kind: Any) -> None:
    for method, arguments in (
        ("update", (1.0, 1.0)),
        ("process", ([1.0], [1.0])),
        ("trace", ([1.0], [1.0])),
    ):
        for wrong in (object(), 3, None, palpate.Tracker()):
            with pytest.raises(TypeError, match=r"descriptor|incompatible function arguments"):
                getattr(kind, method)(wrong, *arguments)
        bare = kind.__new__(kind)
        with pytest.raises(TypeError, match=r"__init__\(\) has not been called"):
            getattr(bare, method)(*arguments)


@pytest.mark.parametrize("name", ["process", "trace"])
def test_arguments_of_a_block(name: str) -> None:
    def call(*arguments: Any, **named: Any) -> Any:
        return getattr(palpate.AdaptiveRls(), name)(*arguments, **named)

    y, x = [0.5, 0.6], [0.25, 0.25]
    expected = call(y, x)
    for found in (
        call(y, regressor=x),
        call(regressor=x, output=y),
        call(y, x, None),
        call(y, x, out=None),
    ):
        assert found.tobytes() == expected.tobytes()
    out = np.empty_like(expected)
    assert call(regressor=x, out=out, output=y) is out
    for arguments, named in [
        ((y,), {}),
        ((y, x), {"output": y}),
        ((y, x), {"into": out}),
        ((y, x, out, 1), {}),
    ]:
        with pytest.raises(
            TypeError, match=r"output: object, regressor: object, out: object = None"
        ):
            call(*arguments, **named)


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
