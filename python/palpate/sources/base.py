"""The interface of all sources of samples."""

import json
import math
import time
from abc import abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from functools import wraps
from threading import Event
from typing import Any, NamedTuple, Protocol, Self, runtime_checkable

import numpy as np

from palpate.errors import DeviceNotFound, ProtocolError, SourceError
from palpate.messages import quoted
from palpate.recording.rows import Codes, codes_of
from palpate.samples import DTYPE, Block, Sample, Status

_FARTHEST_NS = 2**62  # the difference of two such times is exact
_TURN_S = 0.1  # between two attempts to open a device that is gone
_NAMES = DTYPE.names or ()


def _silent(_: str) -> None:
    """Ignore the message."""


class Gap(NamedTuple):
    """A place from which the earlier baseline is no longer valid: the device was opened again, or its range was moved.

    Attributes
    ----------
    seq : int
        Number of the first sample after it.
    text : str
        What happened, for the mark in the recording.

    Examples
    --------
    >>> Gap(690, "unplugged for 1.5 s").seq
    690
    """

    seq: int
    text: str


@runtime_checkable
class Source(Protocol):
    """A source of samples: hardware, a simulated board, or a file.

    It is a context manager and an iterable. One thread may iterate and another one close it; the latter calls
    `interrupt` first; the iteration then has 0.5 s to end. To write a source,
    derive from this class and define `__iter__` and `describe`. To register its scheme, add an entry point of the group
    ``palpate.sources``: a function of address and options.

    A source that gets several samples at a time, as from a buffer or a file, may also define ``read_block()``: it returns
    the next samples, all that are there, as an array of `SampleRing.dtype` with shape (n,); it waits for the first one, and
    returns an empty array at the end. Errors are raised by the call after the samples before them. A stream uses it in
    place of the iteration, and single samples are many times as expensive.

    After a gap the earlier baseline is no longer valid: a stream passes it on. A loop of your own does so by `gaps_before`;
    one that does not ends with RuntimeError, as its touches would be wrong.

    `palpate.sources.conformance.check_source` tests whether a source keeps what is promised here.

    Attributes
    ----------
    live : bool
        True: samples arrive in real time, and are lost if the reader is too slow. False: the source waits.
    real_time : bool
        False: a live source whose times do not pass with the clock of the computer, as a simulation at another speed;
        its recording has no time of day.
    notify : callable
        Called with a message for the user, from any thread; set it to receive the messages.

    Examples
    --------
    >>> class Ramp(Source):
    ...     live = False
    ...     def __iter__(self):
    ...         return (Sample(i, i * 10**7, i * 10**7, -1, -1, 2.5 * i, 1.0 * i) for i in range(3))
    ...     def describe(self):
    ...         return {"name": "ramp"}
    >>> with Ramp() as source:
    ...     [sample.hard for sample in source]
    [0.0, 2.5, 5.0]
    """

    live: bool = True
    real_time: bool = True
    notify: Callable[[str], None] = staticmethod(_silent)
    _gaps_passed: int = 0

    def __init_subclass__(cls, **named: Any) -> None:
        """Let the iteration of a source look whether gaps are passed on."""
        super().__init_subclass__(**named)
        if "__iter__" in vars(cls):
            cls.__iter__ = _with_gaps_passed(cls.__iter__)  # type: ignore[method-assign]

    def __enter__(self) -> Self:
        """Begin the measurement."""
        return self

    def __exit__(self, *_: object) -> None:
        """Close the source."""
        self.close()

    @abstractmethod
    def __iter__(self) -> Iterator[Sample]:
        """Return the samples, with increasing numbers; raises SourceError if the source fails.

        A stream ends with ProtocolError at a sample that a recording cannot store: a field that is not a number, or one
        outside its range (`SampleRing.push`). Numbers of numpy are allowed, bool is not.
        """
        ...

    @abstractmethod
    def describe(self) -> dict[str, Any]:
        """Return a description of the instrument, which is stored with a recording.

        `palpate.Stream` uses these keys, and refuses other values of them: `full_scale_pF` (readings from this
        size on are saturated; above 0), `period_s` (time from one pair to the next; above 0), and `stamps`: "host" if
        the times are arrivals at the computer, which are smoothed (the setting `host_stamps`); "converter",
        the default, if they are conversions. If samples have codes of another converter than the AD7746, `codes`
        says their scale, as `palpate.sources.Codes(...)._asdict()`: readers of a recording compute the capacitances from
        the codes. Values that JSON has no type for are stored as text.
        """
        ...

    @property
    def counters(self) -> Mapping[str, int]:
        """Numbers of `errors` and `reconnects` so far, integers from 0."""
        return {}

    @property
    def gaps(self) -> Sequence[Gap]:
        """All gaps so far, in order; one is added before the first sample after it is returned."""
        return ()

    def gaps_before(self, seq: int) -> list[Gap]:
        """Return the gaps before or at a sample that no earlier call returned: after each one the baseline is another one.

        Parameters
        ----------
        seq : int
            Number of the sample.

        Returns
        -------
        list of Gap

        Examples
        --------
        >>> import palpate
        >>> tracker = palpate.Tracker(full_scale=4.09)
        >>> with palpate.open("sim:tremor?seed=1&fault=unplug:1@1") as source:
        ...     for sample in source:
        ...         for gap in source.gaps_before(sample.seq):
        ...             tracker.gap()
        ...         touch = tracker.feed(sample.t_hard_ns / 1e9, sample.t_soft_ns / 1e9, sample.hard, sample.soft)
        >>> gap.text
        'the board was unplugged for 1.0 s'
        """
        found = gaps_until(self, self._gaps_passed, seq)
        self._gaps_passed += len(found)
        return found

    @property
    def conditions(self) -> Sequence[Mapping[str, float]]:
        """What was measured beside the samples, in order: each has `t_s`, and values by name and unit (`temperature_C`)."""
        return ()

    @property
    def troubles(self) -> Mapping[str, str]:
        """What is wrong at present, from any thread: kind -> sentence; empty: nothing.

        Kinds: "unplugged", while the device is waited for; "wiring", while readings show a fault of the wires; "hint", a
        doubt about the wiring that does not prevent a measurement.
        """
        return {}

    @property
    def zero_ns(self) -> int | None:
        """`time.monotonic_ns()` at t = 0 of the samples; None: unknown, then it follows from the arrival of the first one."""
        return None

    def centre(self) -> None:
        """Set the range again, around the present signal, before the next sample; called from any thread.

        If that moves the baseline, the source adds a gap. Raises RuntimeError if the source has no such range.
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


def _with_gaps_passed(
    iterate: Callable[[Any], Iterator[Sample]],
) -> Callable[[Any], Iterator[Sample]]:
    """Return `__iter__` with an error for a reader that goes on after a gap which it has not passed on."""

    @wraps(iterate)
    def samples(self: Any) -> Iterator[Sample]:
        self._gaps_passed = 0
        for sample in iterate(self):
            yield sample
            if missed := gaps_until(self, self._gaps_passed, getattr(sample, "seq", -1)):
                text = f"got {missed[0].text}, then sample {sample.seq} without `gaps_before`"
                raise RuntimeError(
                    f"gap: {text}, allowed: Tracker.gap() for each of source.gaps_before(sample.seq)"
                )

    return samples


class Stoppable(Source):
    """A source whose iteration looks at `_stopped`, and which counts errors, and devices that came back."""

    gaps: tuple[Gap, ...] = ()

    def __init__(self) -> None:
        self._stopped = Event()
        self._errors = self._reconnects = 0

    @property
    def counters(self) -> dict[str, int]:
        """Samples that could not be read, and how often the device came back."""
        return {"errors": self._errors, "reconnects": self._reconnects}

    def _wait_for_replug(self, attempt: Callable[[], bool], limit_s: float, gone: str) -> None:
        """Attempt to open the device again until it succeeds or this is stopped; DeviceNotFound after the limit."""
        begun = time.monotonic()
        while not self._stopped.wait(_TURN_S):
            with suppress(SourceError):
                if attempt():
                    return
            if time.monotonic() - begun > limit_s:
                raise DeviceNotFound(gone)

    def interrupt(self) -> None:
        """Stop the iteration."""
        self._stopped.set()


def described(source: Source) -> dict[str, Any]:
    """Return a copy of the description of a source, in JSON's types; values that JSON has no type for are text."""
    try:
        device: dict[str, Any] = json.loads(json.dumps(dict(source.describe()), default=str))
        codes_of(device)
    except (TypeError, ValueError, RecursionError) as error:
        raise ProtocolError(
            f"source: describe() cannot be stored in a recording: {error}"
        ) from error
    for name in ("full_scale_pF", "period_s"):
        value = device.get(name, 1)
        if not isinstance(value, int | float) or not 0 < value <= (
            math.inf if name == "full_scale_pF" else 1e9
        ):
            raise ProtocolError(
                f"source: describe(): {name}: got {quoted(value)}, allowed: a number above 0"
            )
    if device.get("stamps", "converter") not in ("converter", "host"):
        raise ProtocolError(
            f"source: describe(): stamps: got {quoted(device['stamps'])}, allowed: converter or host"
        )
    return device


def gaps_until(source: Source, passed: int, seq: int) -> list[Gap]:
    """Return the gaps of a source before or at a sample, without the first ones, which were passed before."""
    return [gap for gap in source.gaps[passed:] if gap.seq <= seq]


def blocks_of(source: Any) -> Iterator[Block]:
    """Return the blocks of a source that has `read_block`, until its end; dense, without the padding that numpy adds."""
    while len(block := source.read_block()):
        yield np.ascontiguousarray(block, DTYPE)


def first_wrong(block: Block, last: int, codes: Codes) -> tuple[int, str] | None:
    """Return position and message of the first sample that a recording cannot store; None: all are good; `last`: seq before."""
    before: Any = last
    if len(block) == 1:  # plain numbers: a twentieth of the time
        fields = dict(zip(_NAMES, block.item(), strict=True))
    else:
        fields = {
            name: block[name].astype(np.int64) if name.endswith("_raw") else block[name]
            for name in _NAMES
        }
        before = np.concatenate([[last], block["seq"][:-1]])
    rules = _rules(fields, before, codes)
    wrong = [
        (int(np.argmin(good)), name, allowed)
        for name, good, allowed in rules
        if good is not True and not np.all(good)
    ]
    if not wrong:
        return None
    at, name, allowed = min(wrong, key=lambda found: found[0])
    return (
        at,
        f"source: sample {block['seq'][at]}: {name}: got {block[name][at]}, allowed: {allowed}",
    )


def _rules(fields: dict[str, Any], before: Any, codes: Codes) -> Iterator[tuple[str, Any, str]]:
    """Yield each field, whether it is good, and what is allowed; of one sample as numbers, or of many as arrays."""
    yield "seq", fields["seq"] > before, "above the one before"
    yield "status", fields["status"] <= int(Status.LOST), f"0 to {int(Status.LOST)}"
    yield "t_uncertainty_us", fields["t_uncertainty_us"] >= -1, "-1 or more"
    for name in ("hard", "soft"):
        raw, time_ns = fields[f"{name}_raw"], fields[f"t_{name}_ns"]
        yield (
            f"t_{name}_ns",
            (time_ns > -_FARTHEST_NS) & (time_ns < _FARTHEST_NS),
            "less than 146 years",
        )
        yield f"{name}_raw", (raw >= -1) & (raw <= codes.largest), f"-1 to {codes.largest}"
        is_same = (raw - codes.zero) / codes.per_pF == fields[name]
        yield name, (raw < 0) | is_same, "the pF of its code, or no code (-1)"
