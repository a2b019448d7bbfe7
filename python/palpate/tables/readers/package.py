"""The zip file of an Office Open XML document, and the tags of its parts: ECMA-376 Part 2."""

import lzma
import posixpath
import struct
import zipfile
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import NamedTuple
from xml.parsers.expat import ExpatError, ParserCreate

from palpate.errors import RecordingError
from palpate.tables.packed import LARGEST

MOST_PARTS = 10_000
MOST_LEVELS = 64
"""Tags in others, at most; a workbook has 10."""

_CHUNK = 1 << 20
_DAMAGED = (zipfile.BadZipFile, zlib.error, lzma.LZMAError, struct.error, ExpatError, EOFError, OSError, LookupError,
            ValueError, RuntimeError, OverflowError)  # fmt: skip

Tags = list[str]
"""The tags around a place, without prefixes; the last one is the innermost."""
Begin = Callable[[Tags, dict[str, str]], None]
End = Callable[[Tags], None]
Add = Callable[[Tags, str], None]


class Part(NamedTuple):
    """A part to which another one refers: kind of the reference, name in the zip file."""

    kind: str
    name: str


@contextmanager
def damage(path: Path, what: str) -> Iterator[None]:
    """Turn what the readers of zip and XML raise into a RecordingError."""
    try:
        yield
    except _DAMAGED as error:
        said = " ".join(str(error).split())[:200] or type(error).__name__
        raise RecordingError(path, f"{what} that is damaged, or not complete: {said}") from error


class Package:
    """The parts of a document.

    Parameters
    ----------
    path : pathlib.Path
        For messages.
    data : bytes

    Raises
    ------
    RecordingError
        It is larger than `LARGEST` after decompression, or has more than `MOST_PARTS` parts.
    zipfile.BadZipFile
        Damaged; the other methods raise this and more: see `damage`.
    """

    def __init__(self, path: Path, data: bytes) -> None:
        self._zip = zipfile.ZipFile(BytesIO(data))
        parts = self._zip.infolist()
        size = sum(part.file_size for part in parts)  # zipfile never unpacks more of a part than it declares
        if size > LARGEST or len(parts) > MOST_PARTS:
            raise RecordingError(
                path,
                f"got {size:,} bytes in {len(parts):,} parts after decompression, allowed: {LARGEST:,} bytes in "
                f"{MOST_PARTS:,} parts",
            )
        self.names: list[str] = self._zip.namelist()

    def relations(self, name: str) -> dict[str, Part]:
        """Return the parts to which a part refers, by the id of the reference; "": those of the whole document."""
        folder, base = posixpath.split(name)
        found: dict[str, Part] = {}

        def begin(tags: Tags, given: dict[str, str]) -> None:
            if tags[-1] == "Relationship" and given.get("TargetMode") != "External":
                target = posixpath.normpath(posixpath.join("/", folder, given["Target"])).lstrip("/")
                found[given["Id"]] = Part(given["Type"].rpartition("/")[2], target)

        relations = posixpath.join(folder, "_rels", f"{base}.rels")
        if relations in self.names:
            self.parse(relations, begin)
        return found

    def parse(self, name: str, begin: Begin, end: End | None = None, add: Add | None = None) -> None:
        """Call the functions at the begin and at the end of each tag of a part, and for the text in it."""
        for _ in self.pieces(name, begin, end, add):
            pass

    def pieces(self, name: str, begin: Begin, end: End | None = None, add: Add | None = None) -> Iterator[None]:
        """Do the same, and yield after each piece of the part."""
        tags: Tags = []
        parser = ParserCreate()
        parser.buffer_text = True

        def start(tag: str, given: dict[str, str]) -> None:
            if len(tags) == MOST_LEVELS:
                raise ValueError(f"more than {MOST_LEVELS} tags in others")
            tags.append(tag.rpartition(":")[2] if ":" in tag else tag)
            begin(tags, given)

        def stop(_tag: str) -> None:
            if end:
                end(tags)
            tags.pop()

        parser.StartElementHandler, parser.EndElementHandler = start, stop
        if add:
            parser.CharacterDataHandler = lambda text: add(tags, text)
        with self._zip.open(name) as file:
            while piece := file.read(_CHUNK):
                parser.Parse(piece, False)
                yield
        parser.Parse(b"", True)
        yield
