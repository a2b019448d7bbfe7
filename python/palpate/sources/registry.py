"""Opens a source by its name: SCHEME:ADDRESS?OPTIONS, or a path."""

from collections.abc import Callable, Mapping
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Any

from palpate.errors import PalpateError, SourceError
from palpate.messages import nearest, shortened
from palpate.sources.base import Source
from palpate.sources.options import split

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

# Group of entry points that add a scheme: functions of address and options -> `Source`.
GROUP = "palpate.sources"
_OWN = {
    "usb": "palpate.sources.board:open_usb",
    "sim": "palpate.sources.sim:open_sim",
    "demo": "palpate.sources.demo:open_demo",
    "i2c": "palpate.sources.board:open_i2c",
    "iio": "palpate.sources.iio:open_iio",
    "serial": "palpate.sources.serial:open_serial",
    "lsl": "palpate.sources.lsl:open_lsl",
    "": "palpate.sources.playback:open_file",  # a path
}

Factory = Callable[[str, Mapping[str, object]], Source]


def schemes() -> list[str]:
    """Return the names of all schemes that `open` accepts, also of other packages.

    Returns
    -------
    list of str
        Sorted, without the colon.

    Examples
    --------
    >>> {"usb", "sim", "i2c", "iio", "serial"} <= set(schemes())
    True
    """
    names = {point.name for point in entry_points(GROUP)}
    return sorted(names | _OWN.keys() - {""})


def open(uri: str, **options: Any) -> Source:
    """Open a source of samples.

    Parameters
    ----------
    uri : str
        `usb:` or `usb:BUS/ADDRESS`: the evaluation kit. `sim:SCENARIO`: the same driver with a
        simulated kit. `demo:`: that, pressed by hand on the page of `palpate live`. `i2c:/dev/i2c-N`: the chip on a Linux I2C bus. `iio:` or `iio:PATH`: the chip
        with the driver of the Linux kernel. `serial:PORT`: lines of text. `lsl:NAME`: a stream of
        Lab Streaming Layer. A path: a recording, or a table of another logger. Options may follow
        as `?NAME=VALUE&NAME=VALUE`.
    **options
        Options as keywords. usb: capf (0 to 7), excitation (A, B, AB, or HARD,SOFT as B,A; default
        B), level (0 to 3), chop, differential (yes or no), hard_input, soft_input (1, 2), replug
        (s), firmware (path), backend. i2c: as usb, without the last two. sim: as i2c, and seed,
        speed (1: real time; default: as fast as possible), bus_kHz (10 to 400), fault
        (KIND[:AMOUNT]@SECONDS, separated by commas; sleep, stop and clock-set are of the computer),
        wiring (a mistake of the wiring; a wrong name lists all), idle (s at rest before the
        scenario). demo: as i2c, and seed, tremor (of the force, relative), page (yes: it does
        not end by itself). iio: hard_input, centre (yes or no).
        serial: columns (names of the cells of a line) or pattern (a regular expression with groups
        of these names), unit (or pF of a count), baud, reset (yes, no: leave DTR and RTS inactive),
        replug. lsl: type, source_id, host (which stream), hard, soft (labels or positions of the
        channels), unit, stamps (converter, host), wait (s until it answers), replug. A path: map
        (as hard=COL,soft=COL), unit, time_unit, rate, decimal, soft, part, as in `palpate.read`,
        and speed.

    Returns
    -------
    Source
        Use it in a `with` statement, and iterate over it.

    Raises
    ------
    ValueError
        The scheme or an option is unknown, or a value is outside its range.
    SourceError
        The device was not found, or cannot be used.
    RecordingError
        The file is not a recording.
    MissingExtra
        An optional package is missing; the message has the pip command that installs it.

    Examples
    --------
    >>> import numpy as np
    >>> with open("sim:four-specimens?seed=1") as source:
    ...     blocks = [item for item in source if isinstance(item, np.ndarray)]
    >>> blocks[0]["seq"].tolist(), blocks[0]["status"].tolist()
    ([0], [0])
    """
    scheme, address, uri_options = split(uri)
    for name in sorted(uri_options):
        if name in options:
            raise ValueError(
                f"source: got {shortened(name)} twice, allowed: in the name or by keyword"
            )
    return _factory(scheme)(address, {**uri_options, **options})


def entry_points(group: str) -> "list[EntryPoint]":
    """Return the entry points of other packages."""
    from importlib.metadata import entry_points as installed  # as slow as all of palpate.sources

    return list(installed(group=group))


def _factory(scheme: str) -> Factory:
    """Return the function that opens the sources of a scheme."""
    if scheme in _OWN:
        factory: Factory = resolve_name(_OWN[scheme])
        return factory
    for point in entry_points(GROUP):
        if point.name == scheme:
            return loaded(point)
    names = [f"{name}:" for name in schemes()]
    allowed = f"{', '.join(names)} or a path{nearest(f'{scheme}:', names)}"
    raise ValueError(f"source: got {shortened(scheme)}:, allowed: {allowed}")


def loaded(point: "EntryPoint") -> Callable[..., Any]:
    """Return the function of an entry point; SourceError with the name of its package if it fails."""
    try:
        function: Callable[..., Any] = point.load()
        return function
    except PalpateError:
        raise
    except Exception as error:
        reason = f"{type(error).__name__}: {error!s:.200}; reinstall or remove this package"
        raise SourceError(
            f"{point.name}: of {package_of(point)} cannot be loaded from {point.value}: {reason}"
        ) from error


def package_of(point: "EntryPoint") -> str:
    """Return the name of the package that has an entry point, for a message."""
    return f"package {point.dist.name}" if point.dist else "another package"
