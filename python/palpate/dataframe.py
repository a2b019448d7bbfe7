"""Data frames of other libraries: what is one, and what palpate has found as one."""

import sys
from collections.abc import Mapping, Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from palpate.errors import need


class ArrowStream(Protocol):
    """Interface of a data frame, for example of pandas, polars or pyarrow."""

    def __arrow_c_stream__(self, requested_schema: Any = None) -> Any: ...  # noqa: D105


Frame = ArrowStream | Mapping[str, Any] | NDArray[np.void]
"""A data frame, a dict of arrays, or a structured array."""


def is_frame(source: object) -> bool:
    """Return whether a value is a data frame, a dict of arrays, or a structured array.

    Examples
    --------
    >>> is_frame({"hard": [1.0], "soft": [2.0]}), is_frame("bench.csv")
    (True, False)
    """
    if isinstance(source, np.ndarray):
        return bool(source.dtype.names)
    return isinstance(source, Mapping) or hasattr(source, "__arrow_c_stream__")


def is_a(library: str, name: str, source: object) -> bool:
    """Return whether a value is of a class of a library, which is not imported for it."""
    kind = getattr(sys.modules.get(library), name, None)
    return kind is not None and isinstance(source, kind)


class Framed:
    """A thing with columns: as Arrow, pandas and polars data."""

    def to_arrow(self) -> Any:
        """Return a pyarrow.Table; the unit of a column is in the metadata of its field.

        Raises
        ------
        MissingExtra
            pyarrow is not installed.
        """
        raise NotImplementedError

    def to_pandas(self) -> Any:
        """Return a pandas.DataFrame; the units of its columns are in `attrs["units"]`.

        Raises
        ------
        MissingExtra
            pyarrow or pandas is not installed.
        """
        need("pandas", "tables")
        table = self.to_arrow()
        frame = table.to_pandas(split_blocks=True)
        frame.attrs["units"] = {
            field.name: field.metadata[b"unit"].decode()
            for field in table.schema
            if b"unit" in (field.metadata or {})
        }
        return frame

    def to_polars(self) -> Any:
        """Return a polars.DataFrame.

        Raises
        ------
        MissingExtra
            pyarrow or polars is not installed.
        """
        return need("polars", "").from_arrow(self.to_arrow())

    def __arrow_c_stream__(self, requested_schema: Any = None) -> Any:
        """Return the columns as an Arrow stream, for any library that takes one."""
        return self.to_arrow().__arrow_c_stream__(requested_schema)


_EFFECTS = ("offset", "drift", "lag", "curve", "tilt", "shift")
_TOUCH = {
    "start": "int64",
    "start_s": "double",
    "samples": "int64",
    "ratio": "double",
    "covariance": "double",
}
_TOUCH |= {
    "standard_error": "double",
    "revised": "bool",
    "first_ratio": "double",
    "first_standard_error": "double",
}
_LEVEL = ["level_ratio", "level_standard_error", "contact_exponent", "age_s"]
_LEVEL += ["ratio_before", "before_standard_error", "ratio_after", "after_standard_error"]
_OFFSET = ["offset_ratio", "offset_standard_error"]
_TOUCH |= dict.fromkeys([*_LEVEL, *_OFFSET, *(f"effect_{name}" for name in _EFFECTS)], "double")
_TOUCH |= {"alarm_share": "double", "saturated": "int64", "refused": "int64", "flags": "string"}
_UNITS = {"start_s": "s", "age_s": "s", "covariance": "1/pF2", "effect_lag": "ms"}


def arrow_of_touches(records: Sequence[Mapping[str, Any]]) -> Any:
    """Return touches as a pyarrow.Table with plain columns, so that any format can hold them.

    Parameters
    ----------
    records : sequence of mapping
        From `Touch.as_dict`. The flags become one text, separated by blanks; each of the effects becomes a column.

    Examples
    --------
    >>> arrow_of_touches([]).column_names[:3]
    ['start', 'start_s', 'samples']
    """
    arrow = need("pyarrow", "tables")
    effects = [
        {f"effect_{name}": record["effects"].get(name) for name in _EFFECTS} for record in records
    ]
    rows = [
        {**one, **more, "flags": " ".join(one["flags"])}
        for one, more in zip(records, effects, strict=True)
    ]
    fields = [
        arrow.field(
            name,
            arrow.type_for_alias(kind),
            metadata={"unit": _UNITS[name]} if name in _UNITS else None,
        )
        for name, kind in _TOUCH.items()
    ]
    return arrow.table(
        [[row[name] for row in rows] for name in _TOUCH], schema=arrow.schema(fields)
    )
