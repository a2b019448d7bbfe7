"""A conformance test for sources: `check_source` runs any source, and lists how it differs from `palpate.Source`."""

import math
import statistics
import threading
import time
from collections.abc import Callable, Mapping
from itertools import chain, pairwise
from typing import Any

from palpate._core import SampleRing
from palpate.errors import PalpateError
from palpate.recording.rows import codes_of
from palpate.samples import Sample, Status, samples_of
from palpate.sources import Gap, Source
from palpate.sources import open as open_source
from palpate.sources.base import blocks_of, described

INTERRUPT_S, CLOSE_S = 0.3, 2.0
_AWRY = 0.2  # of a period
_FAST = 300.0  # a recording or a simulation may be live, and so much faster than the clock


def check_source(
    source: str | Source, *, samples: int = 100, seconds: float = 10.0, patience: float = 1.0
) -> list[Sample]:
    """Run a source, and raise if it is not what `palpate.Source` asks for.

    It is begun and read in one thread, by `read_block` if it has that, and interrupted, closed, and closed again in
    another one. Checked are: types, order, times, status and codes of the samples; description, period and gaps; that an
    interruption ends the iteration within 0.3 s; that errors are of `palpate.PalpateError`; that no thread is left; and,
    for a name, that an unknown option is refused.

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
    findings = _unknown_option(source) if isinstance(source, str) else []
    made: Any = open_source(source) if isinstance(source, str) else source
    is_source = isinstance(made, Source)
    if not is_source:
        raise AssertionError(
            f"got an object of type {type(made).__name__}, allowed: one that derives from palpate.Source"
        )
    threads = set(threading.enumerate())
    run = _Run(made, samples)
    run.thread.start()
    run.enough.wait(seconds * patience)
    findings += _called("interrupt", made.interrupt, INTERRUPT_S * patience)
    run.thread.join(INTERRUPT_S * patience)
    if run.thread.is_alive():
        findings.append(f"interrupt: the iteration still runs after {INTERRUPT_S * patience:g} s, allowed: it ends")
    device: dict[str, Any] = {}
    findings += _called("describe", lambda: device.update(described(made)), math.inf)
    findings += run.findings + _wrong_samples(run.samples, device) + _wrong_gaps(list(made.gaps))
    for name, close in (("__exit__", lambda: made.__exit__(None, None, None)), ("close", made.close)):
        findings += _called(name, close, CLOSE_S * patience)
    findings += run.wrong_times(device.get("period_s"), patience)
    for thread in set(threading.enumerate()) - threads - {run.thread}:
        thread.join(INTERRUPT_S * patience)
        if thread.is_alive():
            findings.append(f"threads: {thread.name} still runs after close(), allowed: none")
    if findings:
        raise AssertionError("\n- ".join([f"{source!s:.100} is not a palpate.Source:", *dict.fromkeys(findings)]))
    return run.samples


def _unknown_option(name: str) -> list[str]:
    try:
        open_source(name, no_option_has_this_name=1).close()
    except ValueError:
        return []
    return ["an unknown option: was ignored, allowed: ValueError, as from palpate.sources.options.checked"]


def _called(name: str, call: Callable[[], object], limit_s: float) -> list[str]:
    """Call a method that may not raise or take long; return what is wrong."""
    begun = time.monotonic()
    try:
        call()
    except Exception as error:  # noqa: BLE001
        return [f"{name}: raised {_text_of(error)}, allowed: no error"]
    took_s = time.monotonic() - begun
    return [f"{name}: took {took_s:.3g} s, allowed: {limit_s:g} s"] if took_s > limit_s else []


class _Run:
    """The samples of one run of a source, with the time at which each came, and what is wrong with the reading."""

    def __init__(self, source: Source, count: int) -> None:
        self.source = source
        self.samples: list[Sample] = []
        self.findings: list[str] = []
        self.enough = threading.Event()
        self.thread = threading.Thread(target=self._read, args=(count,), daemon=True)
        self._begun_s = math.nan
        self._arrived_s: list[float] = []

    def _read(self, count: int) -> None:
        """Begin and iterate; the first samples are kept."""
        try:
            self.source.__enter__()
            self._begun_s = time.monotonic()
            row = SampleRing(2).row
            is_in_blocks = hasattr(self.source, "read_block")
            blocks = map(samples_of, blocks_of(self.source)) if is_in_blocks else [self.source]
            for given in chain.from_iterable(blocks):
                if len(self.samples) < count:
                    self.samples.append(Sample(*row(given)))
                    self._arrived_s.append(time.monotonic())
                if len(self.samples) >= count:
                    self.enough.set()
        except PalpateError as error:
            self.findings.append(f"reading: raised {_text_of(error)}")
        except (TypeError, ValueError) as error:
            self.findings.append(f"a sample: {error}")
        except Exception as error:  # noqa: BLE001
            self.findings.append(f"reading: raised {_text_of(error)}, allowed: a palpate.SourceError")
        finally:
            self.enough.set()

    def wrong_times(self, period_s: float | None, patience: float) -> list[str]:
        """Compare the times with the described period and, of a live source, with the clock."""
        if not self.samples and not self.findings:
            return ["no sample came, or the iteration ended; if the device needs longer, give more seconds"]
        if len(self.samples) < 3:
            return []
        found = []
        steps = [(b.t_hard_ns - a.t_hard_ns) / max(b.seq - a.seq, 1) for a, b in pairwise(self.samples)]
        median_s = statistics.median(steps) / 1e9
        if period_s and not (1 - _AWRY) / patience * period_s <= median_s <= (1 + _AWRY * patience) * period_s:
            found.append(f"period_s: got {period_s:g}, allowed: {median_s:.3g}, the median of its times, within 20 %")
        first_s, last_s = self.samples[0].t_hard_ns / 1e9, self.samples[-1].t_hard_ns / 1e9
        arrived_s = self._arrived_s
        if self.source.live and not -1 <= first_s <= _FAST * (arrived_s[0] - self._begun_s + 1):
            found.append(f"t_hard_ns: begins at {first_s:.3g} s, allowed: ns since the source was opened")
        clock_s = max(arrived_s[-1] - arrived_s[0], 1e-3)
        if self.source.live and not 1 / _FAST <= (last_s - first_s) / clock_s <= _FAST:
            found.append(f"t_hard_ns: {last_s - first_s:.3g} s pass in {clock_s:.3g} s of the clock, allowed: ns")
        return found


def _wrong_samples(samples: list[Sample], device: Mapping[str, Any]) -> list[str]:
    """Compare each sample with the one before, and its parts with each other."""
    found, codes = [], codes_of(device)
    for before, sample in pairwise(samples):
        if sample.seq <= before.seq:
            found.append(f"seq: got {sample.seq} after {before.seq}, allowed: above it")
        for name in ("t_hard_ns", "t_soft_ns"):
            if getattr(sample, name) < getattr(before, name):
                found.append(f"{name}: goes back at seq {sample.seq}, allowed: times that do not fall")
    for sample in samples:
        lost, has_both = bool(sample.status & Status.LOST), math.isfinite(sample.hard + sample.soft)
        if lost == has_both or (lost and sample.status != Status.LOST):
            allowed = "LOST (8) alone if a channel has no value, and only then"
            found.append(f"status: got {sample.status} for {sample.hard} pF, {sample.soft} pF, allowed: {allowed}")
        values = (("hard", sample.hard_raw, sample.hard), ("soft", sample.soft_raw, sample.soft))
        found += filter(None, (codes.disagreement(*value) for value in values))
    return found[:20]


def _wrong_gaps(gaps: list[Gap]) -> list[str]:
    if any(not isinstance(gap, Gap) for gap in gaps):
        return [f"gaps: got {gaps!r:.100}, allowed: a sequence of palpate.Gap"]
    in_order = all(earlier.seq <= later.seq for earlier, later in pairwise(gaps))
    return [] if in_order else [f"gaps: got {gaps!r:.100}, allowed: in the order of their seq"]


def _text_of(error: BaseException) -> str:
    return f"{type(error).__name__}: {error!s:.200}"
