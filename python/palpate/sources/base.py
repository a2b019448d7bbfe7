"""The interface of all sources of samples."""

import json
import math
import time
from abc import abstractmethod
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from threading import Event
from typing import Any, NamedTuple, Protocol, Self, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from palpate._core import SampleRing
from palpate.clocks import Clocks
from palpate.errors import DeviceNotFound, ProtocolError, SourceError
from palpate.files import Json
from palpate.messages import quoted
from palpate.recording.rows import LARGEST_STATUS, Codes, codes_of
from palpate.samples import DTYPE, Block, Sample
from palpate.source_events import SourceEvent, SourceItem
from palpate.sources.simulated_hand import SimulatedHand

TURN_S = 0.1  # of one call that waits: an interruption ends between two
_FARTHEST_NS = 2**62  # the difference of two such times is exact
_NAMES = DTYPE.names or ()


def _silent(_: str) -> None:
    """Ignore the message."""


@runtime_checkable
class Source(Protocol):
    """A source of samples: hardware, a simulated board, or a file.

    It is a context manager and an iterable. Iterating yields, in order, blocks of samples (arrays
    of `SampleRing.dtype` with shape (n,)) and events: a `Gap` before the first sample for which the
    earlier baseline is no longer valid, a `TroubleBegan` or `TroubleEnded`, and measured
    `Conditions`. One thread may iterate while another one closes the source; the latter calls
    `interrupt` first, and the iteration then has 0.3 s to end.

    To write a source, derive from this class and define `__iter__` and `describe`. A source that
    reads one sample at a time derives from `SampleSource`. To register its scheme, add an entry
    point of the group ``palpate.sources``: a function of address and options.
    `palpate.sources.conformance.check_source` tests whether a source keeps these promises.

    A loop of your own calls `Tracker.gap` at each gap; the touches after it would be wrong without
    it. A loop that takes each item as samples fails at the first event.

    Attributes
    ----------
    live : bool
        True: samples arrive in real time, and are lost if the reader is too slow. False: the source
        waits.
    real_time : bool
        False: a live source whose times do not pass with the clock of the computer, as a simulation
        at another speed; its recording has no time of day.
    clocks : palpate.clocks.Clocks or None
        Says when the computer slept or stood still, or its wall clock was set. None: the clocks of
        this computer, if the source is live and in real time; else nothing is said.
    notify : callable
        Called with a message for the user, from any thread; set it to receive the messages.
    hand : palpate.sources.simulated_hand.SimulatedHand or None
        Of a simulation: what its hand touches, and what a page may ask of it. None: no simulation.

    Examples
    --------
    >>> import palpate
    >>> tracker = palpate.Tracker(full_scale=4.09)
    >>> with palpate.open("sim:tremor?seed=1&fault=unplug:1@1") as source:
    ...     for item in source:
    ...         if isinstance(item, palpate.sources.Gap):
    ...             gap = item
    ...             tracker.gap()
    ...         elif isinstance(item, np.ndarray):
    ...             columns = (item[name] for name in ("t_hard_ns", "t_soft_ns", "hard", "soft"))
    ...             rows = tracker.process(*map(np.ascontiguousarray, columns))
    >>> gap.text
    'the board was unplugged for 1.0 s'
    """

    live: bool = True
    real_time: bool = True
    clocks: Clocks | None = None
    notify: Callable[[str], None] = staticmethod(_silent)
    hand: SimulatedHand | None = None

    def __enter__(self) -> Self:
        """Begin the measurement."""
        return self

    def __exit__(self, *_: object) -> None:
        """Close the source."""
        self.close()

    @abstractmethod
    def __iter__(self) -> Iterator[SourceItem]:
        """Yield blocks of samples, with increasing numbers, and events.

        Raises SourceError if the source fails, after the samples before the error. A stream ends
        with ProtocolError at a sample that a recording cannot store: a field outside its range
        (`SampleRing.push`).
        """
        ...

    @abstractmethod
    def describe(self) -> Json:
        """Return a description of the instrument, a JSON object in the sidecar of a recording.

        `palpate.Stream` uses these keys, and refuses other values of them: `full_scale_pF`
        (readings from this size on are saturated; above 0), `period_s` (time from one pair to the
        next; above 0), and `stamps`: "host" if the times are arrivals at the computer, which are
        smoothed (the setting `host_stamps`); "converter", the default, if they are conversions. If
        samples have codes of another converter than the AD7746, `codes` is their scale, as
        `palpate.sources.Codes(...)._asdict()`: readers of a recording compute the capacitances from
        the codes. Values that JSON has no type for are stored as text.
        """
        ...

    @property
    def counters(self) -> Mapping[str, int]:
        """Numbers of `errors` and `reconnects` so far, integers from 0."""
        return {}

    @property
    def fastest_period_s(self) -> float:
        """Time from one pair to the next on a computer that is never late, s; nan: not known."""
        return math.nan

    @property
    def zero_ns(self) -> int | None:
        """`time.monotonic_ns()` at t = 0 of the samples; None: take the arrival of the first."""
        return None

    def centre(self) -> None:
        """Set the range again, around the present signal, before the next sample; from any thread.

        If that moves the baseline, the source yields a gap. Raises RuntimeError if the source has
        no such range.
        """
        raise RuntimeError(
            "centre: got a source that cannot set its range, allowed: usb:, i2c:, iio:, sim:"
        )

    def interrupt(self) -> None:
        """Stop an iteration in another thread; it ends within 0.3 s."""
        return

    def close(self) -> None:
        """Release everything; may be called twice."""
        return


class SampleSource(Source):
    """A source that reads one sample at a time: define `samples` in place of `__iter__`.

    Examples
    --------
    >>> class Ramp(SampleSource):
    ...     live = False
    ...     def samples(self):
    ...         for i in range(3):
    ...             yield Sample(i, i * 10**7, i * 10**7, -1, -1, 2.5 * i, 1.0 * i)
    ...     def describe(self):
    ...         return {"name": "ramp"}
    >>> with Ramp() as source:
    ...     [float(block["hard"][0]) for block in source]
    [0.0, 2.5, 5.0]
    """

    @abstractmethod
    def samples(self) -> Iterator[Sample | SourceEvent]:
        """Yield samples and events, in order; numbers of numpy are allowed in a sample, bool is not."""
        ...

    def __iter__(self) -> Iterator[SourceItem]:
        """Yield a block for each sample, and the events; ProtocolError if an item is neither of them."""
        row = SampleRing(2).row
        last: Block | None = None
        for item in self.samples():
            if isinstance(item, SourceEvent):
                yield item
                continue
            block = np.zeros(1, DTYPE)
            try:
                block[0] = row(item)
            except (TypeError, ValueError) as error:
                where = "first sample" if last is None else f"after seq {last['seq'][0]}"
                raise ProtocolError(f"source, {where}: {error}") from error
            last = block
            yield block


class Stoppable(Source):
    """A source whose iteration ends at `_stopped`; it counts errors and reconnects."""

    def __init__(self) -> None:
        self._stopped = Event()
        self._errors = 0
        self._reconnects = 0

    @property
    def counters(self) -> dict[str, int]:
        """Samples that could not be read, and how often the device came back."""
        return {"errors": self._errors, "reconnects": self._reconnects}

    def _wait_for_replug(self, attempt: Callable[[], bool], limit_s: float, gone: str) -> None:
        """Attempt to open the device again until that succeeds or this is stopped.

        DeviceNotFound, with the text `gone`, after the limit.
        """
        begun = time.monotonic()
        while not self._stopped.wait(TURN_S):
            with suppress(SourceError):
                if attempt():
                    return
            if time.monotonic() - begun > limit_s:
                raise DeviceNotFound(gone)

    def interrupt(self) -> None:
        """Stop the iteration."""
        self._stopped.set()


def described(source: Source) -> Json:
    """Return a copy of the description of a source, checked; other types than JSON's are text."""
    try:
        device: Json = json.loads(json.dumps(dict(source.describe()), default=str))
        codes_of(device)
    except (TypeError, ValueError, RecursionError) as error:
        raise ProtocolError(
            f"source: describe() cannot be stored in a recording: {error}"
        ) from error
    for name, limit in (("full_scale_pF", math.inf), ("period_s", 1e9)):
        value = device.get(name, 1)
        if not isinstance(value, int | float) or not 0 < value <= limit:
            raise ProtocolError(
                f"source: describe(): {name}: got {quoted(value)}, allowed: a number above 0"
            )
    stamps = device.get("stamps", "converter")
    if stamps not in ("converter", "host"):
        raise ProtocolError(
            f"source: describe(): stamps: got {quoted(stamps)}, allowed: converter or host"
        )
    return device


Value = float | NDArray[Any]
"""A field of one sample, or of the samples of a block."""


class WrongSample(NamedTuple):
    """The position of a sample in its block, and why a recording cannot store it."""

    position: int
    text: str


def first_wrong(block: Block, last: int, codes: Codes) -> WrongSample | None:
    """Return the first sample that a recording cannot store, if any; `last`: seq before."""
    values: dict[str, Value] = {}
    before: Value = last
    if len(block) == 1:  # plain numbers: a twentieth of the time
        values.update(zip(_NAMES, block.item(), strict=True))
    else:
        for name in _NAMES:
            values[name] = block[name]
        for name in ("hard_raw", "soft_raw"):
            values[name] = block[name].astype(np.int64)
        before = np.concatenate([[last], block["seq"][:-1]])
    wrong: WrongSample | None = None
    for name, good, allowed in _rules(values, before, codes):
        if good is True or np.all(good):
            continue
        position = int(np.argmin(good))
        if wrong is None or position < wrong.position:
            sample = block[position]
            text = f"source: sample {sample['seq']}: {name}: got {sample[name]}, allowed: {allowed}"
            wrong = WrongSample(position, text)
    return wrong


def _rules(
    values: Mapping[str, Value], before: Value, codes: Codes
) -> Iterator[tuple[str, Value, str]]:
    """Yield each field, whether it is valid, and the allowed values."""
    yield "seq", values["seq"] > before, "above the one before"
    yield "status", values["status"] <= LARGEST_STATUS, f"0 to {LARGEST_STATUS}"
    yield "t_uncertainty_us", values["t_uncertainty_us"] >= -1, "-1 or more"
    for name in ("hard", "soft"):
        raw = values[f"{name}_raw"]
        time_name = f"t_{name}_ns"
        time_ns = values[time_name]
        is_near = (time_ns > -_FARTHEST_NS) & (time_ns < _FARTHEST_NS)
        yield time_name, is_near, "less than 146 years"
        yield f"{name}_raw", (raw >= -1) & (raw <= codes.largest), f"-1 to {codes.largest}"
        is_same = (raw - codes.zero) / codes.per_pF == values[name]
        yield name, (raw < 0) | is_same, "the pF of its code, or no code (-1)"
