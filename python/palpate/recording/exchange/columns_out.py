"""Writes the rows of a recording as columns: Parquet, or an Arrow file, with the sidecar in the metadata."""

from pathlib import Path
from typing import Any, BinaryIO, Self

import numpy as np

from palpate.extras import need
from palpate.recording import sidecar
from palpate.samples import DTYPE, Block

KEY = "palpate"
"""The key of the sidecar in the metadata."""

_UNITS = {"t_hard_ns": "ns", "t_soft_ns": "ns", "hard_raw": "code", "soft_raw": "code", "hard": "pF", "soft": "pF"}
_UNITS |= {"t_uncertainty_us": "us"}
_MEANT = {
    "seq": "number of the sample; missing numbers are lost samples",
    "t_hard_ns": "middle of the hard channel's conversion",
    "t_soft_ns": "middle of the soft channel's conversion",
    "hard_raw": "24-bit code, -1: none",
    "soft_raw": "24-bit code, -1: none",
    "hard": "capacitance, hard channel",
    "soft": "capacitance, soft channel",
    "status": "0 good; sum of 1 hard saturated, 2 soft saturated, 4 excitation; 8 lost",
    "t_uncertainty_us": "largest possible error of the difference of the two times; -1: unknown",
}
NAMES: dict[str, str] = {name: f"{name}_pF" if _UNITS.get(name) == "pF" else name for name in DTYPE.names or ()}
"""The names of the columns, by field of a sample."""


def schema() -> Any:
    """Return the Arrow schema of the rows, with the unit and the meaning of each column.

    Raises
    ------
    MissingExtra
        pyarrow is not installed.
    """
    arrow = need("pyarrow", "export")
    fields = []
    for field, name in NAMES.items():
        metadata = {"description": _MEANT[field], **({"unit": _UNITS[field]} if field in _UNITS else {})}
        fields.append(arrow.field(name, arrow.from_numpy_dtype(DTYPE[field]), nullable=False, metadata=metadata))
    return arrow.schema(fields)


class ParquetWriter:
    """Writes Parquet; the sidecar is JSON under the key `palpate`.

    Parameters
    ----------
    file : binary file
    _target : pathlib.Path
        Not used: everything is in one file.
    """

    def __init__(self, file: BinaryIO, _target: Path) -> None:
        self._schema = schema()
        self._writer = need("pyarrow.parquet", "export").ParquetWriter(file, self._schema)

    def __enter__(self) -> Self:
        """Return the writer."""
        return self

    def __exit__(self, *_: object) -> None:
        """End the file."""
        self._writer.close()

    def write(self, block: Block, _text: bytes) -> None:
        """Write some rows."""
        self._writer.write_table(_table(block, self._schema))

    def finish(self, document: dict[str, Any]) -> None:
        """Write the sidecar."""
        self._writer.add_key_value_metadata({KEY: sidecar.text_of(document)})


class ArrowWriter:
    """Writes an Arrow file. Its metadata is at its beginning, and known at the end: the rows wait in a temporary file.

    Parameters
    ----------
    file : binary file
    _target : pathlib.Path
        Not used: everything is in one file.
    """

    def __init__(self, file: BinaryIO, _target: Path) -> None:
        import tempfile

        self._file, self._schema, self._ipc = file, schema(), need("pyarrow.ipc", "export")
        self._waiting = tempfile.TemporaryFile()  # noqa: SIM115 (closed in __exit__)
        self._writer = self._ipc.new_stream(self._waiting, self._schema)

    def __enter__(self) -> Self:
        """Return the writer."""
        return self

    def __exit__(self, *_: object) -> None:
        """Remove the temporary file."""
        self._writer.close()
        self._waiting.close()

    def write(self, block: Block, _text: bytes) -> None:
        """Write some rows."""
        self._writer.write_table(_table(block, self._schema))

    def finish(self, document: dict[str, Any]) -> None:
        """Write the sidecar, and the rows after it."""
        self._writer.close()
        self._waiting.seek(0)
        complete = self._schema.with_metadata({KEY: sidecar.text_of(document)})
        with self._ipc.new_file(self._file, complete) as whole:
            for batch in self._ipc.open_stream(self._waiting):
                whole.write_batch(batch.replace_schema_metadata(complete.metadata))


def _table(block: Block, columns: Any) -> Any:
    return need("pyarrow", "export").table([np.ascontiguousarray(block[name]) for name in NAMES], schema=columns)
