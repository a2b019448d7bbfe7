"""Data frames of other libraries: what palpate takes as one, and touches and recordings as one."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from palpate.errors import need


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


class _Field(NamedTuple):
    """A column of touches: its name, its type in Arrow, and its unit."""

    name: str
    type: str = "double"
    unit: str = ""


_EFFECTS = ("offset", "drift", "lag", "curve", "tilt", "shift")
_TOUCH_FIELDS = (
    _Field("start", "int64"),
    _Field("start_s", unit="s"),
    _Field("samples", "int64"),
    _Field("ratio"),
    _Field("covariance", unit="1/pF2"),
    _Field("standard_error"),
    _Field("revised", "bool"),
    _Field("first_ratio"),
    _Field("first_standard_error"),
    _Field("level_ratio"),
    _Field("level_standard_error"),
    _Field("contact_exponent"),
    _Field("age_s", unit="s"),
    _Field("ratio_before"),
    _Field("before_standard_error"),
    _Field("ratio_after"),
    _Field("after_standard_error"),
    _Field("offset_ratio"),
    _Field("offset_standard_error"),
    _Field("effect_offset"),
    _Field("effect_drift"),
    _Field("effect_lag", unit="ms"),
    _Field("effect_curve"),
    _Field("effect_tilt"),
    _Field("effect_shift"),
    _Field("alarm_share"),
    _Field("saturated", "int64"),
    _Field("refused", "int64"),
    _Field("flags", "string"),
)


def arrow_of_touches(records: Sequence[Mapping[str, Any]]) -> Any:
    """Return touches as a pyarrow.Table with plain columns, which any format can store.

    Parameters
    ----------
    records : sequence of mapping
        From `Touch.as_dict`. The flags become one text, separated by blanks; each of the effects
        becomes a column.

    Examples
    --------
    >>> arrow_of_touches([]).column_names[:3]
    ['start', 'start_s', 'samples']
    """
    arrow = need("pyarrow", "tables")
    rows = []
    for record in records:
        row = {**record, "flags": " ".join(record["flags"])}
        for effect in _EFFECTS:
            row[f"effect_{effect}"] = record["effects"].get(effect)
        rows.append(row)
    fields = []
    for field in _TOUCH_FIELDS:
        metadata = {"unit": field.unit} if field.unit else None
        fields.append(arrow.field(field.name, arrow.type_for_alias(field.type), metadata=metadata))
    columns = [[row[field.name] for row in rows] for field in _TOUCH_FIELDS]
    return arrow.table(columns, schema=arrow.schema(fields))
