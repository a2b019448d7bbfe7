"""Intel HEX: what is read, and what is refused."""

import contextlib
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from palpate.ad7746.evalkit.firmware import RAM_BYTES, parse_hex, read_hex
from palpate.errors import ProtocolError

END = ":00000001FF"
START = ":03000000020100FA"


def record(address: int, data: bytes, kind: int = 0) -> str:
    raw = bytes([len(data), *address.to_bytes(2, "big"), kind]) + data
    return ":" + (raw + bytes([-sum(raw) & 0xFF])).hex().upper()


@given(st.binary(min_size=1, max_size=4000), st.integers(1, 255))
def test_any_image_comes_back(image: bytes, chunk: int) -> None:
    lines = [record(start, image[start : start + chunk]) for start in range(0, len(image), chunk)]
    assert b"".join(parse_hex("\n".join([*lines, END])).values()) == image


@pytest.mark.parametrize(
    ("lines", "text"),
    [
        ([START], "no end record"),
        ([END], "no data at address 0"),
        ([START, END, START], "line 3: got a record after the end"),
        ([START[:-2] + "FB", END], "line 1: checksum: got 0xFB, allowed: 0xFA"),
        ([START[1:], END], "a colon"),
        ([START[:-1], END], "the number of hex digits"),
        ([START + "00", END], "the number of hex digits"),
        ([":zz", END], "a colon"),
        ([START, record(0, b"\0\0", 4), END], "record type: got 4"),
        ([START, START, END], "a second time"),
        ([START, record(RAM_BYTES - 1, b"ab"), END], "allowed: 0 to 0x3FFF"),
        ([], "no end record"),
    ],
)
def test_what_is_refused(lines: list[str], text: str, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=text):
        parse_hex("\n".join(lines))
    path = tmp_path / "image.hex"
    path.write_text("\n".join(lines))
    with pytest.raises(ProtocolError, match=text):
        read_hex(path)


@given(st.text(max_size=200))
def test_any_text_is_an_image_or_a_value_error(text: str) -> None:
    with contextlib.suppress(ValueError):
        parse_hex(text)


def test_a_path_that_is_no_file(tmp_path: Path) -> None:
    with pytest.raises(ProtocolError, match="No such file or directory: check the path"):
        read_hex(tmp_path / "none.hex")
    (tmp_path / "binary.hex").write_bytes(b"\xff\x00")
    with pytest.raises(ProtocolError, match="not a text"):
        read_hex(tmp_path / "binary.hex")
