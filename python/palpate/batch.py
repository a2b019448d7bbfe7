"""Touches of one recording, or of many."""

import os
import warnings
from collections import deque
from collections.abc import Callable, Generator, Iterable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial
from typing import (
    TYPE_CHECKING,
    Any,
    Protocol,
    TypeGuard,
    TypeVar,
    Unpack,
    cast,
    overload,
    runtime_checkable,
)

import numpy as np
from numpy.typing import ArrayLike

from palpate._core import Tracker
from palpate.dataframe import Frame, is_frame
from palpate.errors import SomeFailed
from palpate.recording.reading import read, recorded
from palpate.recording.recording import Recording
from palpate.recording.two_arrays import PairTimes, recording_of_arrays, require_no_signal
from palpate.recording_protocol import RecordingProtocol, is_like_recording
from palpate.tracking import Touches, Windows, tracked

if TYPE_CHECKING:
    from palpate._core import _AnySettings, _Scene

    class _ArrayOptions(_AnySettings, total=False):  # the keywords of `touches` with two arrays
        scene: _Scene
        unit: str | None
        windows: Windows | None

    class _Options(_ArrayOptions, total=False):
        reading: Mapping[str, Any] | None
        jobs: int


One = RecordingProtocol | Frame | str | os.PathLike[str]
"""A recording, the path of one, or a data frame."""
_Item = TypeVar("_Item")
_Result = TypeVar("_Result")


@overload  # a str is a path, although it is iterable, too
def touches(recording: One, **options: Unpack["_Options"]) -> Touches: ...  # type: ignore[overload-overlap]
@overload
def touches(recording: Iterable[One], **options: Unpack["_Options"]) -> list[Touches]: ...
@overload
def touches(
    hard: ArrayLike,
    soft: ArrayLike,
    *,
    times_s: ArrayLike,
    soft_later_s: float = 0.0,
    **options: Unpack["_ArrayOptions"],
) -> Touches: ...
@overload
def touches(
    hard: ArrayLike,
    soft: ArrayLike,
    *,
    rate_hz: float,
    soft_later_s: float = 0.0,
    **options: Unpack["_ArrayOptions"],
) -> Touches: ...
def touches(  # type: ignore[misc]  # the first argument has two names: recording, hard
    recording: Any = None,
    soft: Any = None,
    *,
    hard: Any = None,
    times_s: Any = None,
    rate_hz: float | None = None,
    soft_later_s: float = 0.0,
    scene: "_Scene" = "handheld",
    unit: str | None = None,
    reading: Mapping[str, Any] | None = None,
    windows: Windows | None = None,
    jobs: int = 1,
    **settings: Unpack["_AnySettings"],
) -> Touches | list[Touches]:
    """Return the touches of a recording, of two arrays, or of each of several recordings.

    Parameters
    ----------
    recording : Recording, Simulation, path-like, data frame, or an iterable of them
        Also the result of `palpate.recorded`, and anything with the members of `palpate.recording_protocol.RecordingProtocol`. A reading that
        is nan, or `full_scale_pF` or more, is left out and counted. The result of
        `palpate.recorded` and a path are read in blocks. Of a recording of palpate, the baseline is
        tared at the same samples as in the measurement, and a touch after a gap has the flag "gap".
    hard, soft : array_like of real numbers, shape (n,)
        In place of a recording: the readings of both channels with their baseline, in pairs, as
        ``touches(hard, soft, rate_hz=40)``; nan for a missing one. Columns of data frames need one
        index.
    times_s : array_like, shape (n,)
        Times of the hard readings, s (whole numbers, too), which increase; or `rate_hz`.
    rate_hz : float
        Pairs a second, at an even rate; the time of the first one is 0.
    soft_later_s : float
        Time from the hard reading of a pair to its soft reading, s: less than from pair to pair,
        and negative if soft is first. 0, the default, if both are read at once; a converter that
        reads in turn needs about half of the time from pair to pair.
    scene : str
        As in `Tracker`.
    unit : str, optional
        As in `palpate.read`; of paths, data frames and two arrays. Of arrays the default is pF, for
        values of the size of a gauge.
    reading : mapping, optional
        More keywords of `palpate.read` for paths and data frames, for example {"columns": {"hard": 2, "soft": 3}}.
    windows : sequence of (float, float), optional
        Begin and end, s, of touches that are cut out by hand, of one recording; each lies within
        one press. The result has a touch for each window, in their order: of its samples, up to the
        lift of the probe, and of any length. Its baseline is from the readings without contact
        before and after it, or, with a note, after it only; or the setting `baseline`.
    jobs : int
        Threads for several recordings, 1 or more. The results are the same bit for bit. The
        estimator runs in all of them at once, and so does waiting for a slow disk; the text of
        files is read by one at a time. Of an iterator no more than 2 * jobs recordings are taken
        ahead.
    **settings
        As in `Tracker`. Without times a touch has 250 `samples` by default, where the scene has a
        length in seconds.

    Returns
    -------
    Touches, or list of Touches
        The touches in order of time, with the results known at the end of the recording; empty if
        no change was above the noise. Its `notes` and `doubts` are those of the recording; doubts
        of a file are a UserWarning, too. Of several recordings a list for each, in the order of the
        recordings.

    Raises
    ------
    ValueError
        An unknown scene, a setting out of range, or `seconds` for a recording without times; a
        window without a touch, or without a rest before and after it. Arrays of different
        lengths, times that do not increase, a rate or a delay out of range, a size that is not
        probable for pF.
    TypeError
        An unknown setting; or not a recording: the message names the missing members. One array
        alone; neither times nor a rate, or both, or one of them with a recording.
    RecordingError
        A file cannot be read.
    SomeFailed
        Some of several recordings failed, for any of these reasons. It is raised when all are done,
        and has the results of the other ones in `results`.

    Examples
    --------
    >>> import palpate
    >>> from palpate.simulation import scenarios
    >>> [touch] = palpate.touches(scenarios.run("stiff-steady"))
    >>> abs(touch.ratio / scenarios.PROBE.ratio(8.68) - 1) < 3 * touch.standard_error / touch.ratio
    True
    >>> paths = ["tests/data/four-specimens.csv"] * 3
    >>> [len(found) for found in palpate.touches(paths, jobs=2)]
    [4, 4, 4]
    >>> [touch] = palpate.touches(paths[0], windows=[(3.0, 7.5)])
    >>> round(touch.start_s, 1), touch.samples
    (3.0, 170)
    >>> run = scenarios.run("stiff-steady")
    >>> [touch] = palpate.touches(run.hard, run.soft, times_s=run.t_hard_s, soft_later_s=0.013)
    >>> round(touch.start_s, 1), touch.samples
    (2.0, 250)
    """
    if isinstance(jobs, bool) or not isinstance(jobs, int) or jobs < 1:
        raise ValueError(f"jobs: got {jobs!r}, allowed: a whole number, 1 or more")
    keywords = dict(reading or {})
    if unit is not None:
        keywords["unit"] = unit
    one = partial(_of_one, keywords, scene=scene, windows=windows, **settings)
    times = PairTimes(times_s, rate_hz, soft_later_s)
    if hard is not None or soft is not None:
        signal = _hard_of(recording, hard, reading)
        signals = recording_of_arrays(signal, soft, times, unit)
        return tracked(signals, scene=scene, windows=windows, **settings).touches
    times.require_none()
    require_no_signal(recording)
    if not _is_several(recording):
        return one(recording)
    if windows is not None:
        raise ValueError("windows: got them with several recordings, allowed: with one")
    Tracker(scene, **cast(Any, settings))  # a wrong setting is one error, not one of each recording
    return _of_each(in_order(one, recording, jobs))


def _of_each(attempts: Iterable[Touches | Exception]) -> list[Touches]:
    """Return the touches of each recording; raise SomeFailed if there is an exception."""
    touches_of_each = list[Touches]()
    results = list[Touches | Exception]()
    for result in attempts:
        results.append(result)
        if not isinstance(result, Exception):
            touches_of_each.append(result)
    if len(touches_of_each) < len(results):
        raise SomeFailed.of(results)
    return touches_of_each


def _hard_of(recording: Any, hard: Any, reading: object) -> Any:
    """Return the first of two arrays, by its name or by its position.

    Raises
    ------
    TypeError
        There is a recording, or its keywords, too.
    """
    unused = ""
    if reading is not None:
        unused = "reading"
    elif hard is not None and recording is not None:
        unused = "recording"
    if unused:
        raise TypeError(f"{unused}: got it with two arrays, allowed: without it")
    return recording if hard is None else hard


def _of_one(keywords: Mapping[str, Any], recording: Any, **options: Any) -> Touches:
    """Return the touches of one recording; `keywords` of `read`, `options` of `tracked`."""
    is_path = isinstance(recording, str | os.PathLike)
    if is_frame(recording) and not isinstance(recording, Recording):
        recording = read(recording, **keywords)
    elif "unit" in keywords and not is_path:
        raise ValueError(
            f"unit: got {keywords['unit']!r} with a recording in memory, "
            "allowed: with a path or a table"
        )
    if not is_path:
        return tracked(recording, **options).touches
    try:
        found = tracked(recorded(recording, **keywords), **options).touches
    except Exception as error:
        error.add_note(f"file: {os.fspath(recording)}")
        raise
    if found.doubts:
        warnings.warn(
            f"{os.fspath(recording)}: results may be wrong: {'; '.join(found.doubts)}", stacklevel=3
        )
    return found


@runtime_checkable
class _SourceOfSamples(Protocol):
    """The members that only a source has, which sources/base.py defines above this module."""

    def describe(self) -> object:
        """Return a description of the instrument."""

    def interrupt(self) -> None:
        """Stop an iteration in another thread."""


def _is_several(given: One | Iterable[One]) -> TypeGuard[Iterable[One]]:
    """Return whether this is no recording, path or table, but may contain some.

    A source is iterable, too. Its blocks are parts of one recording: as recordings of their own
    they would lose touches and gaps.
    """
    is_one = isinstance(given, str | bytes | np.ndarray | _SourceOfSamples) or is_frame(given)
    return isinstance(given, Iterable) and not is_one and not is_like_recording(given)


def in_order(
    work: Callable[[_Item], _Result], items: Iterable[_Item], jobs: int
) -> Generator[_Result | Exception, None, None]:
    """Yield the result of a function for each item in order, or its error; from threads if `jobs` > 1.

    Examples
    --------
    >>> [str(result) for result in in_order(float, ["1", "x", "2"], jobs=2)]
    ['1.0', "could not convert string to float: 'x'", '2.0']
    """

    def attempt(item: _Item) -> _Result | Exception:
        try:
            return work(item)
        except Exception as error:  # noqa: BLE001 (it takes the place of the result)
            return error

    if jobs == 1:
        yield from map(attempt, items)
        return
    waiting: deque[Future[_Result | Exception]] = deque()
    with ThreadPoolExecutor(jobs, "palpate") as pool:
        try:
            for item in items:
                waiting.append(pool.submit(attempt, item))
                if len(waiting) == 2 * jobs:
                    yield waiting.popleft().result()
            while waiting:
                yield waiting.popleft().result()
        finally:  # after Ctrl-C: running ones end, waiting ones do not begin
            pool.shutdown(cancel_futures=True)
