"""Sources of a page: files are opened as a whole, or played; simulations run in real time."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from palpate import sources
from palpate.live.review import Review
from palpate.sources import Source
from palpate.sources.files import FileSource
from palpate.sources.options import split


def opener(source: str, given_beside: dict[str, Any]) -> Callable[..., Source]:
    """Return a function that opens the source; simulations and files run in real time unless `speed` is given.

    Keywords of that function take the place of options with the same names.
    """
    scheme, address, given = split(source)
    options = dict(given_beside)
    if "speed" not in given and (scheme in ("sim", "") or Path(source).exists()):
        options["speed"] = 1

    def opened(**changed: Any) -> Source:
        if not changed:
            return sources.open(source, **options)
        return sources.open(f"{scheme}:{address}", **{**given, **options, **changed})

    return opened


def is_file(source: str) -> bool:
    """Return whether a source is a file to open as a whole: `palpate live run.csv`, but not "run.csv?speed=1".

    Examples
    --------
    >>> is_file("run.csv"), is_file("run.csv?speed=1"), is_file("sim:tremor")
    (True, False, False)
    """
    scheme, _, given = split(source)
    return "speed" not in given and (scheme == "" or Path(source).exists())


def review(source: str, given_beside: dict[str, Any], how: dict[str, Any], tell: Callable[[str], object]) -> Review:
    """Return a file as a recording to look at.

    Raises
    ------
    ValueError, PalpateError
        As `palpate.read` does.
    """
    opened = sources.open(source, **given_beside)
    if not isinstance(opened, FileSource):
        raise ValueError(f"source: got {source}, allowed: a file")  # noqa: TRY004  of a name
    return Review(opened.recording, how, tell)
