"""What a source may give: samples and blocks that a recording can store, in order, whose readings are those of their codes."""

from typing import Any

import numpy as np

from palpate._core import SampleRing
from palpate.errors import ProtocolError
from palpate.recording.codes import Codes
from palpate.recording.rows import capacitances
from palpate.samples import Block, Sample, Status

_made = tuple.__new__  # as Sample._make, in a third of its time
_row = SampleRing(2).row
_FARTHEST_NS = 2**62  # the difference of two such times is exact


def checked(given: Any, last: int | None, codes: Codes) -> Sample:
    """Return a sample with fields of int and float that a recording can store.

    Parameters
    ----------
    given : object
        What the source gave.
    last : int or None
        Number of the sample before it.
    codes : Codes
        Readings have to be those of their codes: else a replay would have other ones.

    Raises
    ------
    ProtocolError
        It is none, or not after the last one.
    """
    try:
        sample = _agreeing(_made(Sample, _row(given)), codes)
    except Exception as error:
        where = "first sample" if last is None else f"after seq {last}"
        raise ProtocolError(f"source, {where}: {error}") from error
    if last is not None and sample.seq <= last:
        raise ProtocolError(f"source: seq: got {sample.seq}, allowed: above {last}")
    return sample


def _agreeing(sample: Sample, codes: Codes) -> Sample:
    for name, code, value in (("hard", sample.hard_raw, sample.hard), ("soft", sample.soft_raw, sample.soft)):
        if code >= 0 and (wrong := codes.disagreement(name, code, value)):
            raise ValueError(wrong)
    return sample


def all_good(block: Block, last: int | None, codes: Codes) -> bool:
    """Return whether `checked` would return every sample of a block as it is, and times can be subtracted as int64.

    Parameters
    ----------
    block : numpy.ndarray of `SampleRing.dtype`, shape (n,), n > 0
    last : int or None
    codes : Codes

    Examples
    --------
    >>> from palpate.samples import block_of
    >>> samples = [Sample(seq, 0, 0, -1, -1, 1.5, 2.5) for seq in (3, 4)]
    >>> all_good(block_of(samples), 2, Codes()), all_good(block_of(samples), 3, Codes())
    (True, False)
    """
    seq, uncertainty = block["seq"], block["t_uncertainty_us"]
    good = seq[0] > (-1 if last is None else last) and bool((seq[1:] > seq[:-1]).all())
    good = good and uncertainty.min() >= -1 and block["status"].max() <= int(Status.LOST)
    for name in ("hard", "soft"):
        raw, times, values = block[f"{name}_raw"], block[f"t_{name}_ns"], block[name]
        good = good and raw.min() >= -1 and raw.max() <= codes.largest
        good = good and times.min() > -_FARTHEST_NS and times.max() < _FARTHEST_NS
        good = good and np.array_equal(capacitances(raw, values, codes), values, equal_nan=True)
    return bool(good)
