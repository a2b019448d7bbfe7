"""Data frames of other libraries: what palpate takes as one, and touches and recordings as one."""

from collections.abc import Mapping, Sequence
from dataclasses import fields
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from palpate.errors import need
from palpate.touch import Touch


@runtime_checkable
class ArrowStream(Protocol):
    """Interface of a data frame, for example of pandas, polars or pyarrow."""

    def __arrow_c_stream__(self, requested_schema: Any = None) -> Any: ...  # noqa: D105


@runtime_checkable
class ToNumpy(Protocol):
    """Interface of a column of a data frame."""

    def to_numpy(self) -> NDArray[Any]: ...  # noqa: D102


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
    return isinstance(source, Mapping | ArrowStream)


class Framed:
    """Data with columns, which Arrow, pandas and polars take as a data frame."""

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
        units = {}
        for field in table.schema:
            if b"unit" in (field.metadata or {}):
                units[field.name] = field.metadata[b"unit"].decode()
        frame.attrs["units"] = units
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


_EFFECTS = ("offset", "drift", "lag", "curve", "tilt", "shift", "stiffening")
_ARROW_TYPES: dict[Any, str] = {int: "int64", float: "double", bool: "bool"}
_UNITS = {"start_s": "s", "age_s": "s", "covariance": "1/pF2", "effect_lag": "ms"}


def arrow_of_touches(touches: Sequence[Touch]) -> Any:
    """Return touches as a pyarrow.Table with plain columns, which any format can store.

    Its columns are the fields of a touch, but for `held`. The flags are one text, separated by
    blanks; each of the effects is a column.

    Examples
    --------
    >>> arrow_of_touches([]).column_names[:3]
    ['start', 'start_s', 'samples']
    """
    arrow = need("pyarrow", "tables")
    rows = []
    for touch in touches:
        row = touch.as_dict()
        row["flags"] = " ".join(row["flags"])
        for effect in _EFFECTS:
            row[f"effect_{effect}"] = row["effects"].get(effect)
        rows.append(row)
    columns = []
    schema = []
    for name, arrow_type in _touch_columns().items():
        schema.append(arrow_field(name, arrow.type_for_alias(arrow_type), _UNITS.get(name)))
        columns.append([row[name] for row in rows])
    return arrow.table(columns, schema=arrow.schema(schema))


def arrow_field(name: str, arrow_type: Any, unit: str | None) -> Any:
    """Return a pyarrow.Field with its unit in the metadata."""
    metadata = {"unit": unit} if unit else None
    return need("pyarrow", "tables").field(name, arrow_type, metadata=metadata)


def _touch_columns() -> dict[str, str]:
    """Return the names of the columns of touches, and their types in Arrow."""
    columns = {}
    for field in fields(Touch):
        if field.name == "effects":
            for effect in _EFFECTS:
                columns[f"effect_{effect}"] = "double"
        elif field.name == "flags":
            columns["flags"] = "string"
        elif field.name != "held":
            columns[field.name] = _ARROW_TYPES[field.type]
    return columns
