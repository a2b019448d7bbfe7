"""What calls of estimators take and refuse; `update` bypasses pybind11's dispatcher."""

import subprocess
import sys
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

    y = [0.5, 0.6]
    x = [0.25, 0.25]
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
    y = np.ones(8)
    x = np.ones(8)
    out = np.empty(8)
    estimator = palpate.AdaptiveRls()
    calls: list[Any] = [(y, x, out), (y[::2], x[::2], out[::2]), (y, x, None)]
    before = [sys.getrefcount(a) for a in (y, x, out, None)]
    for _ in range(1000):
        for arguments in calls:
            estimator.process(*arguments)
    after = [sys.getrefcount(a) for a in (y, x, out, None)]
    assert all(abs(b - a) < 100 for a, b in zip(before, after, strict=True))


@pytest.mark.parametrize("convert", [tuple, list, np.array, lambda values: np.array(values)[::-1]])
def test_regressors_of_any_kind_give_the_same_bits(convert: Any) -> None:
    taken = palpate.VectorRls(2)
    expected = palpate.VectorRls(2)
    values = [0.25, 3.0]
    order = values[::-1] if convert(values)[0] == 3.0 else values
    for output in (2.0, 3.5, 1.25):
        assert taken.update(output, convert(values)) == expected.update(output, tuple(order))
    assert taken == expected


@pytest.mark.parametrize("kind", [tuple, list])
@pytest.mark.parametrize(
    ("values", "error", "message"),
    [
        ((1.0,), ValueError, r"regressors: got shape \(1,\), allowed: \(2,\)"),
        ((1.0, 2.0, 3.0), ValueError, r"regressors: got shape \(3,\), allowed: \(2,\)"),
        ((1.0, "2"), TypeError, "regressors: got '2', allowed: a number"),
        ((1.0, None), TypeError, "regressors: got None, allowed: a number"),
    ],
)
def test_what_regressors_are_refused(
    kind: Any, values: Any, error: type[Exception], message: str
) -> None:
    estimator = palpate.VectorRls(2)
    with pytest.raises(error, match=message):
        estimator.update(1.0, kind(values))
    assert estimator == palpate.VectorRls(2)


def test_a_list_that_becomes_shorter_while_it_is_read_is_refused() -> None:
    values: list[Any] = []

    class Emptying:
        def __float__(self) -> float:
            values.clear()
            return 1.0

    values += [Emptying(), 2.0]
    estimator = palpate.VectorRls(2)
    with pytest.raises(ValueError, match=r"regressors: got shape \(0,\)"):
        estimator.update(1.0, values)
    assert estimator == palpate.VectorRls(2)


def test_neither_a_list_nor_an_attribute_takes_the_long_way() -> None:
    """An array would be made by numpy, and a property would be called by pybind11: 10 and 2 times the time."""
    program = (
        "import palpate, sys; palpate.VectorRls(2).update(1.0, [1.0, 2.0]); print(*sys.modules)"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    assert "palpate" in done.stdout.split()
    assert "numpy" not in done.stdout.split()
    for kind in (palpate.Rls, palpate.VectorRls, palpate.Tracker, palpate.Bank, palpate.SampleRing):
        names = [name for name, value in vars(kind).items() if isinstance(value, property)]
        assert names == []


@every
def test_attributes_are_read_only_and_checked(kind: Any) -> None:
    with pytest.raises(AttributeError, match="samples"):
        kind().samples = 3
    with pytest.raises(TypeError, match=r"__init__\(\) has not been called"):
        _ = kind.__new__(kind).samples
    with pytest.raises(TypeError, match="descriptor"):
        vars(kind)["samples"].__get__(palpate.Tracker())
