"""The samples of a source in blocks, if it has `read_block`."""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from palpate.errors import ProtocolError
from palpate.samples import DTYPE, Block
from palpate.sources.base import Source


def blocks_of(source: Source) -> Iterator[Block] | None:
    """Return the blocks of a source, until its end; None: it gives single samples.

    A class that overrides `__iter__`, and not `read_block`, gives single samples.

    Parameters
    ----------
    source : Source

    Yields
    ------
    numpy.ndarray of `SampleRing.dtype`, shape (n,), n > 0

    Raises
    ------
    ProtocolError
        `read_block` returned something else.

    Examples
    --------
    >>> from palpate import open
    >>> sum(map(len, blocks_of(open("tests/data/four-specimens.csv")))), blocks_of(open("sim:"))
    (1442, None)
    """
    for kind in type(source).__mro__:
        if "read_block" in vars(kind):
            return _blocks(source.read_block)  # type: ignore[attr-defined]
        if "__iter__" in vars(kind):
            return None
    return None


def _blocks(read: Callable[[], Any]) -> Iterator[Block]:
    while len(block := _checked(read())):
        yield block


def _checked(given: Any) -> Block:
    if isinstance(given, np.ndarray) and given.dtype == DTYPE and given.ndim == 1:
        return np.ascontiguousarray(given)
    got = f"{given.dtype}, shape {given.shape}" if isinstance(given, np.ndarray) else type(given).__name__
    raise ProtocolError(f"source: read_block(): got {got:.100}, allowed: an array of SampleRing.dtype, shape (n,)")
