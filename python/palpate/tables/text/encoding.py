"""The characters of a text file: finds how they are encoded."""

from pathlib import Path

from palpate.errors import RecordingError

_ENCODINGS = ("utf-8-sig", "cp1252", "latin-1")
_LOOKED_AT = 2000  # bytes


def decoded(path: Path, raw: bytes) -> str:
    """Return the text of a file.

    Raises
    ------
    RecordingError
        Not a text file.
    """
    encodings = _utf_16(raw) or _ENCODINGS
    problem: Exception | None = None
    for encoding in encodings:
        try:
            text = raw.decode(encoding)
        except UnicodeDecodeError as error:
            problem = error
        else:
            if "\0" in text:
                line = text[: text.index("\0")].count("\n") + 1
                raise RecordingError(path, "not a recording: a zero byte, so this is not a text file", line)
            return text.rstrip("\x1a")  # the end of a file of DOS
    raise RecordingError(path, f"not text: {problem}", 1)


def _utf_16(raw: bytes) -> tuple[str, ...]:
    """Return the encoding of a text with two bytes a character: by its mark, or by zeros as every second byte."""
    if raw.startswith((b"\xff\xfe", b"\xfe\xff")):
        return ("utf-16",)
    first, second = (raw[start:_LOOKED_AT:2] for start in (0, 1))
    for encoding, high, low in (("utf-16-le", second, first), ("utf-16-be", first, second)):
        if 2 * high.count(0) > len(high) and not low.count(0):
            return (encoding,)
    return ()
