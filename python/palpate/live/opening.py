"""Sources of a page: files and simulations run in real time."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from palpate import sources
from palpate.sources import Source
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
