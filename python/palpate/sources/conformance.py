"""A conformance test for sources: `check_source` runs any source, and lists how it differs from `palpate.Source`."""

import math
import statistics
import threading
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np

from palpate.errors import PalpateError
from palpate.recording.rows import Codes, codes_of
from palpate.samples import DTYPE, Sample, Status, block_of, samples_of
from palpate.source_events import Gap, SourceEvent
from palpate.sources import Source
from palpate.sources import open as open_source
from palpate.sources.base import described, first_wrong

INTERRUPT_S = 0.3
_AWRY = 0.2  # of a period


def check_source(
    source: str | Source, *, samples: int = 100, seconds: float = 10.0, patience: float = 1.0
) -> list[Sample]:
    """Run a source, and raise if it is not what `palpate.Source` asks for.

    It is begun and iterated in one thread, and interrupted and closed in another one. Checked are: the types that the
    iteration yields; order, status and codes of the samples; description and period; that an interruption ends the
    iteration within 0.3 s; and that errors are of `palpate.PalpateError`. Of a source for an earlier version of
    palpate, which yields single samples or has attributes as `gaps`, the findings say what to change.

    Parameters
    ----------
    source : str or Source
        A name for `palpate.open`, or a source that was not begun; it is used up.
    samples : int
        Number of samples to read before the interruption; fewer if the source ends.
    seconds : float
        Longest time for them, s.
    patience : float
        Factor for all limits of time: above 1 on a machine that is busy.

    Returns
    -------
    list of Sample
        What was read.

    Raises
    ------
    AssertionError
        All findings, one a line.

    Examples
    --------
    >>> len(check_source("sim:soft-steady?seed=1", samples=20, patience=10))
    20
    """
    made: Any = open_source(source) if isinstance(source, str) else source
    if not isinstance(made, Source):
        got = type(made).__name__
        message = f"got an object of type {got}, allowed: one that derives from palpate.Source"
        raise AssertionError(message)  # noqa: TRY004
    read: list[Sample] = []
    enough = threading.Event()
    findings = _side_channels(made)
    thread = threading.Thread(
        target=_read, args=(made, samples, read, enough, findings), daemon=True
    )
    thread.start()
    enough.wait(seconds * patience)
    findings += _called("interrupt", made.interrupt)
    thread.join(INTERRUPT_S * patience)
    if thread.is_alive():
        findings.append(
            f"interrupt: the iteration still runs after {INTERRUPT_S * patience:g} s, allowed: it ends"
        )
    device: dict[str, Any] = {}
    findings += _called("describe", lambda: device.update(described(made)))
    findings += _wrong_samples(read, codes_of(device)) + _wrong_period(
        read, device.get("period_s"), patience
    )
    for name, close in (
        ("__exit__", lambda: made.__exit__(None, None, None)),
        ("close", made.close),
    ):
        findings += _called(name, close)
    if not read and not findings:
        findings.append(
            "no sample came, or the iteration ended; if the device needs longer, give more seconds"
        )
    if findings:
        raise AssertionError(
            "\n- ".join([f"{source!s:.100} is not a palpate.Source:", *dict.fromkeys(findings)])
        )
    return read


def _called(name: str, call: Callable[[], object]) -> list[str]:
    """Call a method that may not raise; return the findings."""
    try:
        call()
    except Exception as error:  # noqa: BLE001
        return [f"{name}: raised {_text_of(error)}, allowed: no error"]
    return []


def _read(
    source: Source, count: int, read: list[Sample], enough: threading.Event, findings: list[str]
) -> None:
    """Begin and iterate until the source ends; keep the first samples, and report findings."""
    try:
        source.__enter__()
        for item in source:
            if isinstance(item, np.ndarray):
                block = np.ascontiguousarray(item, DTYPE)
                read += samples_of(block[: count - len(read)])
            elif not isinstance(item, SourceEvent):
                findings.append(_wrong_item(item))
                return
            elif isinstance(item, Gap) and not item.text:
                findings.append("a gap: got no text, allowed: what happened")
            if len(read) >= count:
                enough.set()
    except PalpateError as error:
        findings.append(f"reading: raised {_text_of(error)}")
    except (TypeError, ValueError) as error:
        findings.append(f"a block: {error}")
    except Exception as error:  # noqa: BLE001
        findings.append(f"reading: raised {_text_of(error)}, allowed: a palpate.errors.SourceError")
    finally:
        enough.set()


_EARLIER = {
    "gaps": "yield palpate.sources.Gap(cause, text) before the first sample after it",
    "troubles": "yield palpate.sources.TroubleBegan and TroubleEnded",
    "conditions": "yield palpate.sources.Conditions(t_s, values)",
    "read_block": "yield the blocks in __iter__",
}


def _side_channels(source: Source) -> list[str]:
    """Return what to change in a source for an earlier version of palpate: nobody reads these attributes now."""
    return [f"{name}: is not read; {do}" for name, do in _EARLIER.items() if name in dir(source)]


def _wrong_item(item: object) -> str:
    """Return what to change where the iteration yields anything but blocks and events."""
    got = f"the iteration: got an object of type {type(item).__name__}"
    allowed = (
        "allowed: blocks of samples, palpate.sources.Gap, and the other events of palpate.sources"
    )
    if not isinstance(item, Sample):
        return f"{got}, {allowed}"
    do = "derive from palpate.sources.SampleSource, and rename __iter__ to samples"
    return f"{got}, {allowed}; for single samples {do}"


def _wrong_period(samples: list[Sample], period_s: float | None, patience: float) -> list[str]:
    """Compare the times with the described period."""
    steps = [(b.t_hard_ns - a.t_hard_ns) / max(b.seq - a.seq, 1) for a, b in pairwise(samples)]
    if not period_s or len(steps) < 2:
        return []
    median_s = statistics.median(steps) / 1e9
    if (1 - _AWRY) / patience * period_s <= median_s <= (1 + _AWRY * patience) * period_s:
        return []
    return [
        f"period_s: got {period_s:g}, allowed: {median_s:.3g}, the median of its times, within 20 %"
    ]


def _wrong_samples(samples: list[Sample], codes: Codes) -> list[str]:
    """Check the samples as a stream does; then their times, and whether status and values agree."""
    wrong = first_wrong(block_of(samples), -1, codes)
    found = [wrong[1]] if wrong else []
    for before, sample in pairwise(samples):
        for name in ("t_hard_ns", "t_soft_ns"):
            if getattr(sample, name) < getattr(before, name):
                found.append(
                    f"{name}: goes back at seq {sample.seq}, allowed: times that do not fall"
                )
    for sample in samples:
        lost = bool(sample.status & Status.LOST)
        has_both = math.isfinite(sample.hard + sample.soft)
        if lost == has_both or (lost and sample.status != Status.LOST):
            allowed = "LOST (8) alone if a channel has no value, and only then"
            found.append(
                f"status: got {sample.status} for {sample.hard} pF, {sample.soft} pF, allowed: {allowed}"
            )
    return found[:20]


def _text_of(error: BaseException) -> str:
    return f"{type(error).__name__}: {error!s:.200}"
