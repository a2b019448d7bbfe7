"""A sign too much anywhere in a table changes no number in silence."""

from pathlib import Path

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from palpate import RecordingError
from palpate.tables.cell.numbers import numbers
from palpate.tables.text.parsing import parse

ROWS = [[0.026 * row, 6.1234 + 0.0101 * row, 4.4321 - 0.0103 * row] for row in range(12)]
SIGNS = ",;\t .'\"#%!*xµ:/\n\r_<>~()=|\u00a0\u2009\ufeff"  # no e: 6.1e2 is a number


def without_minus(delimiter: str, point: str) -> str:
    rows = [delimiter.join(f"{value:.4f}".replace(".", point) for value in row) for row in ROWS]
    return "\n".join([delimiter.join(["time", "hard", "soft"]), *rows]) + "\n"


@given(st.sampled_from([",.", ";.", "\t.", "|.", " .", ";,", "\t,", " ,"]), st.sampled_from(SIGNS), st.integers(0, 400))
def test_a_sign_too_much_is_harmless_refused_or_noted(way: str, sign: str, place: int) -> None:
    text = without_minus(*way)
    at = place % len(text)
    try:
        table = parse(Path("t.csv"), (text[:at] + sign + text[at:]).encode())
        found = np.column_stack([numbers(table, column) for column in range(3)])
    except (RecordingError, ValueError):
        return
    if np.isnan(found[:, 0]).any():  # no column of times: refused there
        return
    kept = [row for row in found.tolist() if any(np.allclose(row, true, atol=1e-9) for true in ROWS)]
    assert len(kept) == len(table), "a number was changed"
    assert len(table) == len(ROWS) or table.notes
