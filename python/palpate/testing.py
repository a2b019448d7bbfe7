"""A conformance test for sources: `check_source` runs any source, and says how it differs from `palpate.Source`."""

import math
import statistics
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from itertools import pairwise
from typing import Any

from palpate._core import SampleRing
from palpate.errors import PalpateError
from palpate.recording.codes import codes_of
from palpate.samples import Sample, Status
from palpate.sources import Gap, Source
from palpate.sources import open as open_source
from palpate.sources.blocks import samples_from
from palpate.sources.claims import Conditions, conditions_of, counted, described, is_source, zero_of

BEGIN_S, INTERRUPT_S, CLOSE_S = 30.0, 0.3, 2.0
_OWN_THREADS = "palpate-check-"
_NO_OPTION = "no_option_has_this_name"
_AWRY = 0.2  # of a period
_FAST = 300.0  # a recording or a simulation may be live, and so much faster than the clock
_MOST_FINDINGS = 20


def check_source(
    source: str | Source, *, samples: int = 100, seconds: float = 10.0, patience: float = 1.0
) -> list[Sample]:
    """Run a source, and raise if it is not what `palpate.Source` asks for.

    It is begun and read in one thread, by `read_block` if it has that, and interrupted, closed, and closed again in another one. Checked are: types,
    order, times, status and codes of the samples; description, period, counters and gaps; that an interruption ends the
    iteration within 0.3 s; that errors are of `palpate.PalpateError`; that no thread is left, and no sample comes after
    the end; and, for a name, that an unknown option is refused.

    Parameters
    ----------
    source : str or Source
        A name for `palpate.open`, or a source that was not begun; it is used up.
    samples : int
        So many are read before the interruption, or all.
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
    trial = _Trial(samples, patience)
    before = set(threading.enumerate())
    made = trial.opened(source)
    if made is not None:
        trial.run(made, seconds)
        trial.judge_threads(before)
    if trial.findings:
        more = len(trial.findings) - _MOST_FINDINGS
        lines = [*trial.findings[:_MOST_FINDINGS], *([f"and {more} more"] if more > 0 else [])]
        raise AssertionError("\n- ".join([f"{source!s:.100} is not a palpate.Source:", *lines]))
    return trial.samples


class _Trial:
    """One run of a source; `findings` has what is wrong."""

    def __init__(self, count: int, patience: float) -> None:
        self.findings: list[str] = []
        self.samples: list[Sample] = []
        self._count, self._patience = count, patience
        self._ring = SampleRing(2)
        self._lock = threading.Lock()
        self._begun_s, self._spans_s = math.nan, [math.nan, math.nan]
        self._entered, self._enough, self._ended = threading.Event(), threading.Event(), threading.Event()
        self._over = False
        self._codes = codes_of({})
        self._gaps_seen: list[int] = []  # with each sample

    def find(self, text: str) -> None:
        with self._lock:
            if text not in self.findings:
                self.findings.append(text)

    def opened(self, source: str | Source) -> Source | None:
        """Return the source, opened by its name; None: it cannot be used."""
        if isinstance(source, str):
            self._refuses_unknown_options(source)
            source = open_source(source)
        if not is_source(source):
            self.find(
                f"got an object of type {type(source).__name__}, allowed: one that is derived from palpate.Source"
            )
            return None
        if not isinstance(getattr(source, "live", None), bool):
            self.find(f"live: got {getattr(source, 'live', None)!r:.60}, allowed: True or False")
        source.notify = self._hear
        return source

    def run(self, source: Source, seconds: float) -> None:
        """Read the source in a thread, and end it from this one."""
        self._describe(source)
        reading = threading.Thread(target=self._read, args=(source,), name=f"{_OWN_THREADS}reader", daemon=True)
        reading.start()
        if not self._entered.wait(BEGIN_S * self._patience):
            self.find(f"__enter__: did not return within {BEGIN_S * self._patience:g} s")
        self._enough.wait(seconds * self._patience)
        self._interrupt(source)
        with self._lock:
            self._over = True
        period_s = self._describe(source).get("period_s")
        self._judge_counters(source)
        self._judge_gaps(source)
        for name in ("__exit__", "close"):
            self._call(
                name, (lambda: source.__exit__(None, None, None)) if name == "__exit__" else source.close, CLOSE_S
            )
        self._judge_times(bool(source.live), period_s)
        self._after_the_end(source)

    def judge_threads(self, before: set[threading.Thread]) -> None:
        """Find threads of the source that still run."""
        left = [thread for thread in threading.enumerate()
                if thread not in before and not thread.name.startswith(_OWN_THREADS)]  # fmt: skip
        deadline = time.monotonic() + INTERRUPT_S * self._patience
        for thread in left:
            thread.join(max(deadline - time.monotonic(), 0))
        if names := sorted({thread.name for thread in left if thread.is_alive()}):
            self.find(f"threads: {', '.join(names)} still run after close(), allowed: none")

    def _refuses_unknown_options(self, name: str) -> None:
        try:
            open_source(name, **{_NO_OPTION: 1}).close()
        except ValueError:
            return
        except Exception as error:  # noqa: BLE001  a source may raise anything
            self.find(f"an unknown option: raised {_told(error)}, allowed: ValueError")
            return
        self.find("an unknown option: was ignored, allowed: ValueError, as from palpate.sources.options.checked")

    def _hear(self, message: Any) -> None:
        if not isinstance(message, str):
            self.find(f"notify: got {message!r:.60}, allowed: text")

    def _describe(self, source: Source) -> dict[str, Any]:
        try:
            found = described(source)
            self._codes = codes_of(found)
        except Exception as error:  # noqa: BLE001
            self.find(str(error) if isinstance(error, PalpateError) else f"describe(): raised {_told(error)}")
            return {}
        return found

    def _read(self, source: Source) -> None:
        """Begin and iterate; every sample is checked, the first ones are kept."""
        try:
            source.__enter__()
            self._begun_s = time.monotonic()
            self._entered.set()
            for sample in samples_from(source):
                self._take(source, sample)
                if self._over:
                    break
        except Exception as error:  # noqa: BLE001
            wrong = "" if isinstance(error, PalpateError) else ", allowed: a palpate.SourceError"
            self.find(f"reading: raised {_told(error)}{wrong}")
        finally:
            self._entered.set()
            self._enough.set()
            self._ended.set()

    def _take(self, source: Source, given: Any) -> None:
        if self._over or len(self.samples) >= self._count:
            return
        now = time.monotonic()
        try:
            sample = Sample(*self._ring.row(given))
        except Exception as error:  # noqa: BLE001
            self.find(f"a sample: {error!s:.200}")
            self._enough.set()  # a stream ends here
            return
        self._judge(sample)
        self._gaps_seen.append(len(self._gaps_of(source)))
        self._spans_s = [now if math.isnan(self._spans_s[0]) else self._spans_s[0], now]
        self.samples.append(sample)
        if len(self.samples) == self._count:
            self._enough.set()

    def _judge(self, sample: Sample) -> None:
        """Compare a sample with the one before, and its parts with each other."""
        if self.samples and sample.seq <= (last := self.samples[-1]).seq:
            self.find(f"seq: got {sample.seq} after {last.seq}, allowed: above it")
        for name in ("t_hard_ns", "t_soft_ns"):
            if self.samples and getattr(sample, name) < getattr(self.samples[-1], name):
                self.find(f"{name}: goes back at seq {sample.seq}, allowed: times that do not fall")
        lost = bool(sample.status & Status.LOST)
        if lost and sample.status != Status.LOST:
            self.find(f"status: got {sample.status} at seq {sample.seq}, allowed: LOST alone")
        if lost == (math.isfinite(sample.hard) and math.isfinite(sample.soft)):
            allowed = "LOST (8) if a channel has no value, and only then"
            self.find(f"status: got {sample.status} for {sample.hard} pF, {sample.soft} pF, allowed: {allowed}")
        for name in ("hard", "soft"):
            if wrong := self._codes.disagreement(name, getattr(sample, f"{name}_raw"), getattr(sample, name)):
                self.find(wrong)

    def _judge_gaps(self, source: Source) -> None:
        """Compare the gaps with what was there when the first sample after each was given."""
        gaps = self._gaps_of(source)
        if any(not isinstance(gap, Gap) or type(gap.seq) is not int or not isinstance(gap.text, str) for gap in gaps):
            self.find(f"gaps: got {gaps!r:.100}, allowed: a sequence of palpate.sources.Gap")
            return
        if any(later.seq < earlier.seq for earlier, later in pairwise(gaps)):
            self.find(f"gaps: got {gaps!r:.100}, allowed: in the order of their seq")
        with suppress(PalpateError):  # found as one of the counters
            if (back := counted(source)[1]) > len(gaps):
                self.find(f"gaps: got {len(gaps)} after {back} reconnects, allowed: one for each")
        for number, gap in enumerate(gaps):
            seen = [count for sample, count in zip(self.samples, self._gaps_seen, strict=True) if sample.seq >= gap.seq]
            if seen and seen[0] <= number:
                self.find(f"gaps: {gap} was not there when seq {gap.seq} was given, allowed: before this sample")

    def _gaps_of(self, source: Source) -> list[Any]:
        try:
            return list(source.gaps)
        except Exception as error:  # noqa: BLE001
            self.find(f"gaps: raised {_told(error)}, allowed: a sequence of palpate.sources.Gap")
            return []

    def _interrupt(self, source: Source) -> None:
        if not self.samples and not self.findings and self._count > 0:
            more = (
                "the iteration ended, allowed: a sample"
                if self._ended.is_set()
                else "if the device needs longer, give more seconds"
            )
            self.find(f"no sample came; {more}")
        self._call("interrupt", source.interrupt, INTERRUPT_S)
        if not self._ended.wait(INTERRUPT_S * self._patience):
            self.find(f"interrupt: the iteration still runs after {INTERRUPT_S * self._patience:g} s, allowed: it ends")

    def _call(self, name: str, call: Callable[[], Any], limit_s: float) -> None:
        """Call a method in a thread; find an error, and a method that does not return."""
        done = threading.Event()

        def run() -> None:
            try:
                call()
            except Exception as error:  # noqa: BLE001
                self.find(f"{name}: raised {_told(error)}, allowed: no error")
            finally:
                done.set()

        threading.Thread(target=run, name=f"{_OWN_THREADS}{name}", daemon=True).start()
        if not done.wait(limit_s * self._patience):
            self.find(f"{name}: did not return within {limit_s * self._patience:g} s")

    def _judge_counters(self, source: Source) -> None:
        try:
            conditions_of(source, Conditions([], 0))
            zero_of(source)
            first, second = counted(source), counted(source)
        except PalpateError as error:
            self.find(str(error))
            return
        if any(later < earlier for earlier, later in zip(first, second, strict=True)):
            self.find(f"counters: got {second} after {first}, allowed: numbers that do not fall")

    def _judge_times(self, live: bool, period_s: float | None) -> None:
        """Compare the times with each other, with the described period and, if live, with the clock."""
        if len(self.samples) < 3:
            return
        steps = [(b.t_hard_ns - a.t_hard_ns) / (b.seq - a.seq) for a, b in pairwise(self.samples) if b.seq > a.seq]
        median_s = statistics.median(steps or [math.nan]) / 1e9
        least_s, most_s = (1 - _AWRY) / self._patience, 1 + _AWRY * self._patience
        if period_s and not least_s * period_s <= median_s <= most_s * period_s:
            self.find(f"period_s: got {period_s:g}, allowed: {median_s:.3g}, the median of its times, within 20 %")
        if not live:
            return
        first, span_s = self.samples[0].t_hard_ns / 1e9, (self.samples[-1].t_hard_ns - self.samples[0].t_hard_ns) / 1e9
        if not -1 <= first <= _FAST * (self._spans_s[0] - self._begun_s + 1):
            self.find(f"t_hard_ns: begins at {first:.3g} s, allowed: ns since the source was opened")
        if not 1 / _FAST <= span_s / max(clock_s := self._spans_s[1] - self._spans_s[0], 1e-3) <= _FAST:
            self.find(f"t_hard_ns: {span_s:.3g} s pass in {clock_s:.3g} s of the clock, allowed: ns")

    def _after_the_end(self, source: Source) -> None:
        """Iterate again: a live source has no more samples."""

        def iterate() -> None:
            try:
                sample = next(iter(source), None)
            except (PalpateError, ValueError):
                return
            if source.live and sample is not None:
                self.find(f"an iteration after close(): gave seq {getattr(sample, 'seq', '?')}, allowed: no sample")

        self._call("an iteration after close()", iterate, INTERRUPT_S)


def _told(error: BaseException) -> str:
    try:
        return f"{type(error).__name__}: {error!s:.200}"
    except Exception:  # noqa: BLE001  of the error's own text
        return type(error).__name__
