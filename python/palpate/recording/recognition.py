"""Whether a file is a recording made by palpate."""

from pathlib import Path

from palpate.errors import RecordingError
from palpate.recording import sidecar
from palpate.recording.lines import begin_of
from palpate.recording.rows import COLUMNS, EARLIER, columns_of

_BEGIN = 1 << 16  # bytes
_HEADERS = [",".join(columns).encode() for columns in (COLUMNS, EARLIER)]


def is_own(path: Path) -> bool:
    """Return whether a file is a recording made by palpate.

    Its first line is the header. If it has a sidecar, the header may be damaged, as long as there are rows; or it was
    stopped before its first row.
    """
    begin = begin_of(path, _BEGIN)
    first, *others = begin.split(b"\n")
    if first.removesuffix(b"\r") in _HEADERS:
        return True
    try:
        if sidecar.load(path) is None:
            return False
    except RecordingError:
        return False
    stopped = any(header.startswith(begin.rstrip(b"\0")) for header in _HEADERS)
    return stopped or columns_of([b"", *others]) is not None
