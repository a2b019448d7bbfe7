"""The samples of a source in blocks, if it has `read_block`."""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from palpate.errors import ProtocolError
from palpate.samples import DTYPE, Block, Sample, samples_of
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
    (1411, None)
    """
    for kind in type(source).__mro__:
        if "read_block" in vars(kind):
            return _blocks(source.read_block)  # type: ignore[attr-defined]
        if "__iter__" in vars(kind):
            return None
    return None


def samples_from(source: Source) -> Iterator[Sample]:
    """Return the samples of a source as a stream gets them; errors as of `blocks_of`."""
    blocks = blocks_of(source)
    return iter(source) if blocks is None else (sample for block in blocks for sample in samples_of(block))


def _blocks(read: Callable[[], Any]) -> Iterator[Block]:
    while len(block := _checked(read())):
        yield block


def _checked(given: Any) -> Block:
    """Return a block as it is pushed: dense, and with the padding that numpy takes out when it joins arrays."""
    if not isinstance(given, np.ndarray) or isinstance(given, np.ma.MaskedArray):  # its mask would be lost
        raise _wrong(type(given).__name__)
    if given.dtype.names != DTYPE.names or not np.can_cast(given.dtype, DTYPE, "equiv"):
        raise _wrong(f"dtype {given.dtype}")
    if given.ndim != 1:
        raise _wrong(f"shape {given.shape}")
    return np.ascontiguousarray(given, DTYPE)


def _wrong(got: str) -> ProtocolError:
    allowed = "an array of SampleRing.dtype, shape (n,)"
    return ProtocolError(f"source: read_block(): got {got:.60}, allowed: {allowed}")
