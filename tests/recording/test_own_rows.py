"""The rows that the core reads and writes, against the reader in Python and the format in words."""

import math
import random

import numpy as np
import pytest
from effort import draws, random_of
from palpate._core import OwnRows
from palpate.recording.codes import Codes
from palpate.recording.rows import COLUMNS, EARLIER, RowError, format_rows, parse_any_rows, parse_rows
from palpate.samples import DTYPE, Block
from tally import Tally

SCALES = (Codes(), None, Codes(zero=-5, per_pF=700_000_001 / 3, largest=2**31 - 1), Codes(0, 1000, 65535))
PIECES = [b" ", b"+", b"-", b"1e5", b".", b",", b",,", b"_", b"inf", b"nan", b"NAN", b"\t", b"\x0b", b"\0", b"\r", b"\n",
          b"\r\n", b"99999999999", b"0000000000", b"e", b"E-3", b"1" * 20, b"\x1c", b"-1", b"9", b"", b"\xb2",
          b"9223372036.854775807", b"2147483648", b"0.0000000001"]  # fmt: skip


def drawn(rng: random.Random, count: int) -> Block:
    """Return samples of every kind: with codes and without, late and early, with short and long numbers."""
    block = np.zeros(count, DTYPE)
    late = rng.choice([10**3, 10**9, 10**13, 2**62])
    for row in block:
        for name in ("t_hard_ns", "t_soft_ns"):
            row[name] = rng.choice([rng.randrange(late), -rng.randrange(late), 26_000_000 * rng.randrange(10**6)])
        for name in ("hard", "soft"):
            code = row[f"{name}_raw"] = rng.choice([-1, rng.randrange(2**24), rng.randrange(2**31)])
            value = [
                rng.gauss(0, 10.0 ** rng.randint(-30, 30)),
                round(rng.uniform(-9, 9), 6),
                math.nan,
                0.0,
                -0.0,
                1e16,
            ]
            row[name] = Codes().pF(code) if 0 <= code < 2**24 else rng.choice([*value, math.inf, 5e-324])
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


def outcome(read: object, data: bytes, columns: tuple[str, ...], scale: Codes | None) -> bytes | tuple[int, str]:
    """Return the bytes of the samples, padding and all, or the line and the message."""
    assert callable(read)
    try:
        return bytes(read(data, columns, scale).tobytes())
    except RowError as error:
        return error.number, str(error)


def test_the_bytes_of_rows(tally: Tally) -> None:
    rng = random_of("bytes of rows")
    for _ in range(draws(200)):
        block = drawn(rng, rng.randint(0, 20))
        tally.count("blocks of rows, written")
        assert format_rows(block) == written(block)
    ends = np.zeros(2, DTYPE)
    for name in ("seq", "t_hard_ns", "t_soft_ns", "hard_raw", "soft_raw", "t_uncertainty_us", "status"):
        ends[name] = np.iinfo(DTYPE[name]).min, np.iinfo(DTYPE[name]).max
    ends["hard"], ends["soft"] = [-1.7976931348623157e308, -math.inf], [-5e-324, math.nan]
    assert format_rows(ends) == written(ends)
    strided = drawn(rng, 9)[::2]
    assert format_rows(strided) == written(strided)


def test_a_block_is_read_as_python_reads_it(tally: Tally) -> None:
    """Damaged or not: the same samples to the last byte, or the same line and message."""
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
            data = data[:at] + rng.choice([*PIECES, rng.randbytes(1)]) + data[at + rng.choice([0, 0, 1, 1, 2, 5]) :]
        scale = rng.choice(SCALES)
        expected = outcome(parse_any_rows, data, columns, scale)
        tally.count("blocks of rows, damaged or not")
        refused += isinstance(expected, tuple)
        assert outcome(parse_rows, data, columns, scale) == expected, (data, columns, scale)
    assert 0.25 * count < refused < 0.95 * count


def test_every_cell_is_read_as_python_reads_it() -> None:
    cells = ["", "-", "+", ".", "-.", "--1", "- ", "-1", "-01", "-0", "+1", "-2", "5.", ".5", "-.5", "1e", "1e+", "e5", "-1e5",
             "nan", "-nan", "inf", "-inf", "1e999", "0x1", "1_0", "2147483647", "2147483648", "4294967295", "1" * 10, "1" * 18,
             "1" * 19, "1" * 20, "9223372036854775807", "9223372036854775808", "18446744073709551616", "0" * 26 + "1",
             "1.5x", "-1.234567890123", "1.23456789012x", "1.2345678x0123", "1,5", "9223372036.854775807",
             "9223372036.854775808", "-9223372036.854775808", "-9223372036.854775809", "9999999999.999999999",
             "00000000000.123456789", "1.1234567890", "1.12345678x", "x.123456789"]  # fmt: skip
    for code in ("8388608", "-1"):
        for place in range(len(COLUMNS)):
            for cell in cells:
                row = ["7", "0.5", "0.6", code, code, "0.0", "0.5", "150", "0"]
                row[place] = cell
                data = ",".join(row).encode()
                expected = outcome(parse_any_rows, data, COLUMNS, Codes())
                assert outcome(parse_rows, data, COLUMNS, Codes()) == expected, data


def test_what_palpate_writes_never_waits_for_python(monkeypatch: pytest.MonkeyPatch) -> None:
    """All but infinite values and times beyond 2**63 ns: these are read in Python."""
    rng = random_of("plain rows")
    monkeypatch.setattr("palpate.recording.rows.parse_any_rows", None)
    for _ in range(draws(100)):
        block = drawn(rng, 5)
        for name in ("hard", "soft"):
            block[name][~(np.abs(block[name]) < 1e300) | (np.abs(block[name]) < 1e-300)] = math.nan
        for scale in SCALES:
            assert len(parse_rows(written(block), COLUMNS, scale)) == 5
        assert len(parse_rows(written(block).replace(b"\n", b"\r\n").replace(b"nan", b""))) == 5


def test_lines_of_a_piece_however_it_is_cut() -> None:
    """A number at the end of the memory is read as one in the middle."""
    data = b"7,0.5,0.6,8388608,-1,-0.25,12345678.12345678,150,8"
    for length in range(len(data) + 1):
        expected = outcome(parse_any_rows, data[:length], COLUMNS, Codes())
        assert outcome(parse_rows, data[:length], COLUMNS, Codes()) == expected


def test_rows_of_every_length_follow_each_other(monkeypatch: pytest.MonkeyPatch) -> None:
    """The core reads a block in parts, which end anywhere in a row, and one row that is not plain anywhere in it."""
    monkeypatch.setattr("palpate.recording.rows.parse_any_rows", lambda *_: None)
    rng = random_of("long blocks")
    for _ in range(draws(40)):
        block = drawn(rng, rng.randint(100, 300))
        for name in ("hard", "soft"):
            block[name] = np.round(rng.uniform(-9, 9), rng.randint(1, 16))
        for end in (b"\n", b"\r\n"):
            data = written(block).replace(b"\n", end)
            assert parse_rows(data, COLUMNS, None).tolist() == uncoded(block).tolist()
            at = rng.randrange(len(data) - 1)
            changed = data[:at] + b"\0" + data[at + 1 :]
            assert OwnRows(None).parse(changed) is None


def uncoded(block: Block) -> Block:
    """Return samples without codes."""
    found = block.copy()
    found["hard_raw"] = found["soft_raw"] = -1
    return found


def test_lines_are_counted() -> None:
    for size in (0, 1, 254, 255, 256, 1000):
        data = bytes(random.Random(size).choices(b"\n\r9", k=size))
        assert OwnRows().count_lines(data) == data.count(b"\n")
    with pytest.raises(TypeError, match="text: got <class 'str'>, allowed: bytes"):
        OwnRows().count_lines("9")  # type: ignore[arg-type]
