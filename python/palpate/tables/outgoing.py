"""What palpate has found, as data frames of other libraries."""

from typing import Any

from palpate.extras import need


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
        need("pandas", "")
        table = self.to_arrow()
        frame = table.to_pandas(split_blocks=True)
        frame.attrs["units"] = {
            field.name: field.metadata[b"unit"].decode() for field in table.schema if b"unit" in (field.metadata or {})
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
