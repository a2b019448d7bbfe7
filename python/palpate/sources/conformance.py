"""A test for sources: `check_source` lists how a source differs from `palpate.Source`."""

import threading
from collections.abc import Callable, Mapping
from enum import Enum
from typing import Any

import numpy as np

from palpate.errors import PalpateError
from palpate.files import Json
from palpate.recording.rows import codes_of
from palpate.samples import DTYPE, Block, Sample, Status, block_of, samples_of
from palpate.source_events import (
    Gap,
    GapCause,
    SourceEvent,
    TroubleBegan,
    TroubleEnded,
    TroubleKind,
)
from palpate.sources import Source
from palpate.sources import open as open_source
from palpate.sources.base import described, first_wrong

INTERRUPT_S = 0.3
_TOLERANCE = 0.2  # of a period


def check_source(
    source: str | Source, *, samples: int = 100, seconds: float = 10.0, patience: float = 1.0
) -> list[Sample]:
    """Run a source, and raise if it is not what `palpate.Source` asks for.

    One thread begins and iterates it, another one interrupts and closes it. Checked are: the types
    that the iteration yields; order, status and codes of the samples; description and period; that
    an interruption ends the iteration within 0.3 s; and that errors are of `palpate.PalpateError`.
    If a source is for an earlier version of palpate, as it yields single samples or has attributes
    as `gaps`, the findings say what to change.

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
    opened: Any = open_source(source) if isinstance(source, str) else source
    if not isinstance(opened, Source):
        got = type(opened).__name__
        message = f"got an object of type {got}, allowed: one that derives from palpate.Source"
        raise AssertionError(message)  # noqa: TRY004
    read: list[Sample] = []
    enough = threading.Event()
    findings = _side_channels(opened)
    thread = threading.Thread(
        target=_read, args=(opened, samples, read, enough, findings), daemon=True
    )
    thread.start()
    enough.wait(seconds * patience)
    findings += _errors_of("interrupt", opened.interrupt)
    limit_s = INTERRUPT_S * patience
    thread.join(limit_s)
    if thread.is_alive():
        findings.append(
            f"interrupt: the iteration still runs after {limit_s:g} s, allowed: it ends"
        )
    device: Json = {}
    findings += _errors_of("describe", lambda: device.update(described(opened)))
    block = block_of(read)
    wrong = first_wrong(block, -1, codes_of(device))
    if wrong:
        findings.append(wrong.text)
    findings += _wrong_samples(block)[:20]
    findings += _wrong_counters(opened.counters)
    findings += _wrong_period(block, device.get("period_s"), patience)
    findings += _errors_of("__exit__", lambda: opened.__exit__(None, None, None))
    findings += _errors_of("close", opened.close)
    if not read and not findings:
        findings.append(
            "no sample came, or the iteration ended; if the device needs longer, give more seconds"
        )
    if findings:
        name = source if isinstance(source, str) else type(source).__name__
        title = f"{name:.100} does not keep the promises of a palpate.Source:"
        raise AssertionError("\n- ".join([title, *dict.fromkeys(findings)]))
    return read


def _errors_of(name: str, call: Callable[[], object]) -> list[str]:
    """Call a method that may not raise an error; return the findings."""
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
            else:
                findings += _wrong_event(item)
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
    """Return what to change in a source for an earlier version of palpate."""
    return [f"{name}: is not read; {do}" for name, do in _EARLIER.items() if name in dir(source)]


def _wrong_item(item: object) -> str:
    """Return what to change where the iteration yields anything but blocks and events."""
    finding = (
        f"the iteration: got an object of type {type(item).__name__}, allowed: "
        "blocks of samples, palpate.sources.Gap, and the other events of palpate.sources"
    )
    if isinstance(item, Sample):
        finding += (
            "; for single samples derive from palpate.sources.SampleSource, "
            "and rename __iter__ to samples"
        )
    return finding


def _wrong_event(event: SourceEvent) -> list[str]:
    """Check the cause of a gap and its text, and the kind of a trouble."""
    if isinstance(event, Gap):
        findings = _not_one_of("cause of a gap", event.cause, GapCause)
        if not event.text:
            findings.append("a gap: got no text, allowed: what happened")
        return findings
    if isinstance(event, TroubleBegan | TroubleEnded):
        return _not_one_of("kind of a trouble", event.kind, TroubleKind)
    return []


def _not_one_of(name: str, value: object, kinds: type[Enum]) -> list[str]:
    if isinstance(value, kinds):
        return []
    return [f"{name}: got {value!r:.40}, allowed: one of palpate.sources.{kinds.__name__}"]


def _wrong_counters(counters: object) -> list[str]:
    """Check that `counters` is a mapping, not a method, with whole numbers."""
    if not isinstance(counters, Mapping):
        got = type(counters).__name__
        return [f"counters: got an object of type {got}, allowed: a property with a mapping"]
    findings = []
    for name, value in counters.items():
        if not isinstance(value, int):
            findings.append(f"counters: got {value!r:.40} for {name}, allowed: a whole number")
    return findings


def _wrong_period(block: Block, period_s: float | None, patience: float) -> list[str]:
    """Compare the times with the described period."""
    if not period_s or len(block) < 3:
        return []
    steps_ns = np.diff(block["t_hard_ns"]) / np.maximum(np.diff(block["seq"]), 1)
    median_s = float(np.median(steps_ns)) / 1e9
    shortest_s = (1 - _TOLERANCE) / patience * period_s
    longest_s = (1 + _TOLERANCE * patience) * period_s
    if shortest_s <= median_s <= longest_s:
        return []
    return [
        f"period_s: got {period_s:g}, allowed: {median_s:.3g}, the median of its times, within 20 %"
    ]


def _wrong_samples(block: Block) -> list[str]:
    """Check that times do not go back, and that status and values agree."""
    findings = []
    for name in ("t_hard_ns", "t_soft_ns"):
        for seq in block["seq"][1:][np.diff(block[name]) < 0]:
            findings.append(f"{name}: goes back at seq {seq}, allowed: times that do not fall")
    lost = int(Status.LOST)
    has_both = np.isfinite(block["hard"]) & np.isfinite(block["soft"])
    is_lost = block["status"] & lost != 0
    is_wrong = (is_lost == has_both) | (is_lost & (block["status"] != lost))
    for sample in samples_of(block[is_wrong]):
        findings.append(
            f"status: got {sample.status} for {sample.hard} pF, {sample.soft} pF, "
            "allowed: LOST (8) alone if a channel has no value, and only then"
        )
    return findings


def _text_of(error: BaseException) -> str:
    return f"{type(error).__name__}: {error!s:.200}"
