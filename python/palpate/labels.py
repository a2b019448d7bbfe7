"""Labels of the rows of signals: signals whose rows have different labels are refused."""

from __future__ import annotations

from itertools import zip_longest

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable
    from typing import Any


def require_same_index(names: Iterable[str], signals: Iterable[Any]) -> None:
    """Check that all signals with an index, as columns of pandas, have the same one.

    palpate pairs values by position. Of different indices, or of one index in another order, it
    would pair values that do not belong together. A signal without an index, as an array, is
    allowed with any other signal.

    Parameters
    ----------
    names : iterable of str
        Name of each signal, for the message.
    signals : iterable

    Raises
    ------
    ValueError
        The labels of the rows differ; or two data frames have the same columns in another order.

    Examples
    --------
    >>> require_same_index(["output", "regressor"], [[1.0, 2.0], [3.0, 4.0]])
    """
    first_name = ""
    first: Any = None
    for name, signal in zip(names, signals, strict=True):
        if not _has_index(signal):
            continue
        if first is None:
            first_name = name
            first = signal
            continue
        if not signal.index.equals(first.index):
            raise ValueError(_unlike_index(name, signal, first_name, first))
        if _has_columns(signal) and _has_columns(first):
            _require_same_order(name, signal.columns, first_name, first.columns)


def _has_index(signal: object) -> bool:
    """Return whether a signal has labels of its rows: the method `index` of a list is none."""
    return hasattr(getattr(signal, "index", None), "equals")


def _has_columns(signal: object) -> bool:
    """Return whether a signal is a data frame."""
    return hasattr(getattr(signal, "columns", None), "equals")


def _unlike_index(name: str, signal: Any, first_name: str, first: Any) -> str:
    differs = _first_difference("row", signal.index, first.index)
    moved = first_name
    other = name
    axis = ""
    if _has_columns(signal) or _has_columns(first):
        axis = ", axis=0"
        if not _has_columns(first):  # a column cannot be aligned with a data frame
            moved = name
            other = first_name
    aligned = f'{moved}, {other} = {moved}.align({other}, join="inner"{axis})'
    by_position = f"{name}.to_numpy() pairs by position"
    return (
        f"{name}: got another index than that of {first_name} ({differs}), "
        f"allowed: the same index; write {aligned}; {by_position}"
    )


def _first_difference(kind: str, found: Iterable[Any], expected: Iterable[Any]) -> str:
    """Return the first label that differs, of a "row" or a "column", and the expected one."""
    for place, (label, other) in enumerate(zip_longest(found, expected, fillvalue="none")):
        if str(label) != str(other):  # NA is equal to nothing
            return f"{kind} {place}: {label}, not {other}"
    return "labels of another type"


def _require_same_order(name: str, columns: Any, first_name: str, first_columns: Any) -> None:
    """Refuse the same columns in another order; other columns are signals of other names."""
    if columns.equals(first_columns) or set(columns) != set(first_columns):
        return
    raise ValueError(
        f"{name}: got the columns of {first_name} in another order "
        f"({_first_difference('column', columns, first_columns)}), allowed: one order; "
        f"write {name}[{first_name}.columns]"
    )
