"""The text of a recording: the format in words, the same bits back, no line that is half a row, one reader in C++ and Python."""

import math
import random
from decimal import Decimal

import numpy as np
import pytest
from effort import Tally, draws, random_of
from hypothesis import given
from hypothesis import strategies as st
from palpate.recording.rows import COLUMNS, EARLIER, Codes, format_rows, parse_rows, unreadable
from palpate.samples import DTYPE, Block, samples_of

SEEDS = st.integers(0, 2**32)
ODD = [math.nan, 0.0, -0.0, 1e16, math.inf, 5e-324]
PIECES = [b" ", b"+", b"-", b"1e5", b".", b",", b",,", b"_", b"inf", b"nan", b"NAN", b"\t", b"\x0b", b"\0", b"\r", b"\n",
          b"\r\n", b"99999999999", b"0000000000", b"e", b"E-3", b"1" * 20, b"\x1c", b"-1", b"9", b"", b"\xb2",
          b"9223372036.854775807", b"2147483648", b"0.0000000001"]  # fmt: skip


def drawn(rng: random.Random, count: int) -> Block:
    """Return samples of every kind: with codes and without, late and early, with short and long numbers."""
    block = np.zeros(count, DTYPE)
    late = rng.choice([10**3, 10**9, 10**13, 2**62])
    for row in block:
        for name in ("t_hard_ns", "t_soft_ns"):
            row[name] = rng.choice(
                [rng.randrange(late), -rng.randrange(late), 26_000_000 * rng.randrange(10**6)]
            )
        for name in ("hard", "soft"):
            code = row[f"{name}_raw"] = rng.choice([-1, rng.randrange(2**24), rng.randrange(2**31)])
            value = rng.choice(
                [rng.gauss(0, 10.0 ** rng.randint(-30, 30)), round(rng.uniform(-9, 9), 6), *ODD]
            )
            row[name] = Codes().pF(code) if 0 <= code < 2**24 else value
        row["seq"], row["status"] = rng.randrange(10 ** rng.randint(1, 18)), rng.randrange(9)
        row["t_uncertainty_us"] = rng.choice([-1, rng.randrange(1000), rng.randrange(2**31)])
    return block


def seconds(ns: int) -> str:
    return f"{'-' if ns < 0 else ''}{abs(ns) // 10**9}.{abs(ns) % 10**9:09d}"


def written(block: Block) -> bytes:
    """Return the rows as the format says."""
    return "".join(
        f"{seq},{seconds(t_hard)},{seconds(t_soft)},{hard_raw},{soft_raw},{hard!r},{soft!r},{uncertainty},{status}\n"
        for seq, t_hard, t_soft, hard_raw, soft_raw, hard, soft, status, uncertainty in block.tolist()
    ).encode()


def by_python(line: bytes, columns: tuple[str, ...]) -> list[float]:
    """Return the cells of a row, times in ns, as Python reads them."""
    cells = dict(zip(columns, line.decode().split(","), strict=True))
    real = {name: float(cells[name] or math.nan) for name in ("hard_pF", "soft_pF")}
    times = [int(Decimal(cells[name]).scaleb(9)) for name in ("t_hard_s", "t_soft_s")]
    codes = [int(cells[name]) for name in ("hard_raw", "soft_raw")]
    rest = [int(cells["status"]), int(cells.get("t_uncertainty_us", -1))]
    return [int(cells["seq"]), *times, *codes, *real.values(), *rest]


def test_the_bytes_of_rows(tally: Tally) -> None:
    rng = random_of("bytes of rows")
    for _ in range(draws(200)):
        block = drawn(rng, rng.randint(0, 20))
        tally.count("blocks of rows, written")
        assert format_rows(block) == written(block)
        for name in ("hard", "soft"):
            block[name][np.isinf(block[name])] = math.nan
        again = parse_rows(format_rows(block), COLUMNS, None)  # the values as they are written
        assert all(
            again[name].tobytes() == block[name].tobytes()
            for name in again.dtype.names or ()
            if "raw" not in name
        )
    ends = np.zeros(2, DTYPE)
    for name in (
        "seq",
        "t_hard_ns",
        "t_soft_ns",
        "hard_raw",
        "soft_raw",
        "t_uncertainty_us",
        "status",
    ):
        ends[name] = np.iinfo(DTYPE[name]).min, np.iinfo(DTYPE[name]).max
    ends["hard"], ends["soft"] = [-1.7976931348623157e308, -math.inf], [-5e-324, math.nan]
    assert format_rows(ends) == written(ends)
    strided = drawn(rng, 9)[::2]
    assert format_rows(strided) == written(strided)


def test_a_block_is_read_as_python_reads_it_or_a_line_has_a_reason(tally: Tally) -> None:
    rng = random_of("blocks of rows")
    refused, count = 0, draws(1000)
    for _ in range(count):
        columns = rng.choice([COLUMNS, COLUMNS, EARLIER])
        lines = written(drawn(rng, rng.randint(1, 4))).split(b"\n")[:-1]
        if columns == EARLIER:
            lines = [b",".join((*line.split(b",")[:7], line.split(b",")[8])) for line in lines]
        data = b"\n".join(lines) + rng.choice([b"", b"\n", b"\r\n"])
        if rng.random() < 0.2:
            data = data.replace(b"\n", b"\r\n")
        for _ in range(rng.choice([0, 1, 1, 1, 2])):
            at = rng.randint(0, len(data))
            data = (
                data[:at]
                + rng.choice([*PIECES, rng.randbytes(1)])
                + data[at + rng.choice([0, 0, 1, 1, 2, 5]) :]
            )
        tally.count("blocks of rows, damaged or not")
        lines = (
            [line.removesuffix(b"\r") for line in data.removesuffix(b"\n").split(b"\n")]
            if data
            else []
        )
        wrong = [line for line in lines if unreadable(line, columns)]
        try:
            found = parse_rows(data, columns, None).tolist()
        except ValueError:
            refused += 1
            assert wrong, data
            continue
        assert not wrong
        for row, line in zip(found, lines, strict=True):
            seq, hard_ns, soft_ns, _, _, *rest = by_python(line.replace(b"inf", b"nan"), columns)
            assert np.array_equal(row, [seq, hard_ns, soft_ns, -1, -1, *rest], equal_nan=True), line
    assert 0.25 * count < refused < 0.95 * count


@given(SEEDS)
def test_rows_of_an_earlier_version(seed: int) -> None:
    """Without the column; cut anywhere, no row of one version is a row of the other."""
    block = drawn(random.Random(seed), 1)
    [sample] = samples_of(block)
    line = format_rows(block).rstrip(b"\n")
    cells = line.split(b",")
    earlier = b",".join(cells[:7] + cells[8:])
    [after] = samples_of(parse_rows(earlier, EARLIER))
    assert np.array_equal(after[:5], sample[:5])
    assert after[7:] == (sample.status, -1)
    assert None not in (
        unreadable(line, EARLIER),
        *(unreadable(line[:length]) for length in range(len(line))),
    )


@pytest.mark.parametrize(
    ("column", "cell"),
    [
        ("seq", "9223372036854775808"),
        ("t_hard_s", "nan"),
        ("soft_pF", "1,5"),
        ("t_uncertainty_us", "-2"),
        ("status", "9"),
    ],
)
def test_what_is_wrong_with_a_row(column: str, cell: str) -> None:
    cells = dict(
        zip(
            COLUMNS,
            ["7", "0.5", "0.6", "8388608", "8388608", "0.0", "0.0", "150", "0"],
            strict=True,
        )
    )
    good = ",".join(cells.values()).encode()
    bad = ",".join({**cells, column: cell}.values()).encode()
    with pytest.raises(ValueError, match="a line is not a row"):
        parse_rows(b"\n".join([good, bad, good]))
    said = f"'{cell}' is not a valid value for column {column}"
    assert (unreadable(good), unreadable(bad)) == (
        None,
        "got 10 cells, allowed: 9" if "," in cell else said,
    )
