"""All faults of the board, and the message for the user. `python tests/tools/kit_faults.py` prints the table."""

import math
import re
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from pathlib import Path

from kit_bench import CENTRED, Bench
from palpate.ad7746.bus import Counters
from palpate.ad7746.driver import Ad7746
from palpate.ad7746.evalkit.board import ERROR_COUNT, I2C, PORTS
from palpate.errors import DeviceNotFound, DeviceRefused, ProtocolError, SourceError, SourceTimeout
from palpate.samples import Status

FOREVER = math.inf
PAIRS, ENOUGH = 2, 20
"""Numbers of pairs to read after a fault: if the driver must continue, and at most until it must raise."""
ANY = -1
"""Any count: it depends on the timing."""
IMAGE = ":03000000020100FA\n:00000001FF\n"


@dataclass(frozen=True)
class Row:
    """A fault while reading.

    Attributes
    ----------
    name : str
    arrange : callable
        Function of a bench, with an open driver that has read a pair: adds the fault.
    error : type, optional
        Error of the driver in the end; None: it continues.
    text : str
        Part of the error message.
    counters : dict
        Counters of the driver if it continues, without `pairs` and zeros.
    flags : Status
        Status flags of all samples together.
    replug_s : float
        Longest time that the driver waits for a board, s.
    """

    name: str
    arrange: Callable[[Bench], None]
    error: type[SourceError] | None = None
    text: str = ""
    counters: dict[str, int] = field(default_factory=dict)
    flags: Status = Status.OK
    replug_s: float = 10.0


def _fault(kind: str, amount: float = 1.0, request: int | None = None, times: float = 1) -> Callable[[Bench], None]:
    return lambda bench: bench.fail(kind, amount, request=request, times=times)


def _stuck_low(bench: Bench) -> None:
    bench.kit.chip.pace = 1.05
    bench.fail("RDY# stuck low")


_ONCE = {"errors": 1, "retries": 1}
_GONE = {"errors": 3, "retries": 2, "lost": 1}

RUNNING = (
    Row("a request is not answered, once", _fault("no answer"), counters=_ONCE),
    Row("a request is refused (stall), once", _fault("stall"), counters=_ONCE),
    Row("a transfer is damaged, once", _fault("line error"), counters=_ONCE),
    Row("more bytes than asked for, once", _fault("babble"), counters=_ONCE),
    Row(
        "fewer bytes than asked for, once",
        lambda bench: bench.fail("short", 2, request=I2C, skip=2),
        counters=_ONCE | {"lost": 1},
    ),
    Row("an answer comes too late, once", _fault("late", 0.25), counters=_ONCE),
    Row("the error count is not answered, once", _fault("stall", 1, ERROR_COUNT), counters=_ONCE),
    Row("RDY# is not answered, once", _fault("stall", 1, PORTS), counters=_ONCE),
    Row("the AD7746 does not acknowledge, once: all data are FF", _fault("not acknowledged"), counters=_ONCE),
    Row("not acknowledged in the middle of a write, once", _fault("not acknowledged in mid-write", 2), counters=_ONCE),
    Row("one access fails three times", _fault("stall", 1, I2C, 3), counters=_GONE),
    Row("a conversion is lost", _fault("lost conversion"), counters={"lost": 1}),
    Row("another program switches the input", _fault("other input"), counters={"lost": 1}),
    Row("the AD7746's supply fails for a moment", _fault("brown-out", 1, PORTS), counters={"lost": 1}),
    Row("RDY# is stuck high", _fault("RDY# stuck high"), counters={"errors": 1}),
    Row("RDY# is stuck low, on a slow chip", _stuck_low, counters={"errors": 1, "lost": 1}),
    Row("the excitation is shorted", _fault("excitation shorted", 2), flags=Status.EXCITATION),
    Row("the input leaves the range", _fault("overload", 9.0), flags=Status.HARD_SATURATED | Status.SOFT_SATURATED),
    Row("unplugged, and back a moment later", _fault("unplug", 0.2), counters={"reconnects": 1, "lost": ANY}),
    Row("unplugged", _fault("unplug", FOREVER), DeviceNotFound, "was unplugged: plug it in again", replug_s=0.2),
    Row("the firmware has locked", _fault("lock"), DeviceRefused, "unplug the board for a moment"),
    Row("every request is refused", _fault("stall", 1, None, FOREVER), DeviceRefused, "has no firmware"),
    Row("every transfer is damaged", _fault("line error", 1, I2C, FOREVER), ProtocolError, "another cable or port"),
    Row("the AD7746 is gone", _fault("chip absent"), ProtocolError, "not acknowledged"),
    Row("no conversion ends", _fault("lost conversion", 1e9), SourceTimeout, "not clocked"),
    Row("another program switches the input all the time", _fault("other input", 1e9), ProtocolError, "another prog"),
)


@dataclass(frozen=True)
class Opening:
    """A fault while opening the board: a context around the attempt."""

    name: str
    attempt: Callable[[], Iterator[Bench]]
    error: type[SourceError]
    text: str
    where: dict[str, int] = field(default_factory=dict)


def _nothing() -> Iterator[Bench]:
    with Bench(plugged=False) as bench:
        yield bench


def _one() -> Iterator[Bench]:
    with Bench() as bench:
        yield bench


def _two() -> Iterator[Bench]:
    with Bench() as bench:
        bench.another()
        yield bench


def _denied() -> Iterator[Bench]:
    with Bench() as bench, bench.carrier.denied(bench.kit):
        yield bench


def _busy() -> Iterator[Bench]:
    with Bench() as bench:
        bench.open_kit()
        yield bench


def _bare() -> Iterator[Bench]:
    with Bench(loaded=False) as bench:
        yield bench


def _with_image(text: str) -> Callable[[], Iterator[Bench]]:
    def attempt() -> Iterator[Bench]:
        with tempfile.TemporaryDirectory() as folder, Bench(loaded=False) as bench:
            bench.firmware = Path(folder) / "image.hex"
            bench.firmware.write_text(text)
            yield bench

    return attempt


def _dead_image() -> Iterator[Bench]:
    for bench in _with_image(IMAGE)():
        bench.fail("stall", request=ERROR_COUNT, times=FOREVER)
        yield bench


OPENING = (
    Opening("no board", _nothing, DeviceNotFound, "found: check the cable"),
    Opening("no board at that address", _one, DeviceNotFound, "found: usb:1/", {"bus": 1, "address": 99}),
    Opening("two boards, none named", _two, DeviceNotFound, "choose one of usb:1/"),
    Opening("no permission", _denied, DeviceRefused, "doctor --install-udev"),
    Opening("used by another program", _busy, DeviceRefused, "another program uses the board"),
    Opening("no firmware", _bare, DeviceRefused, "--firmware PATH"),
    Opening("a firmware file with a wrong checksum", _with_image(IMAGE.replace("FA", "FB")), ProtocolError, "0xFB"),
    Opening("a firmware file that was cut off", _with_image(IMAGE.split("\n")[0]), ProtocolError, "no end record"),
    Opening("a firmware that does not run", _dead_image, DeviceRefused, "does not answer"),
)


@dataclass(frozen=True)
class Outcome:
    """The result for the user."""

    error: SourceError | None
    counters: dict[str, int]
    flags: Status


def run(row: Row) -> Outcome:
    """Open, read a pair, add the fault, continue reading."""
    with Bench() as bench:
        bench.replug_s = row.replug_s
        driver = bench.open(CENTRED)
        bench.read(driver, 1)
        row.arrange(bench)
        error = None
        try:
            bench.read(driver, ENOUGH if row.error else PAIRS)
        except SourceError as raised:
            error = raised
        bench.check_samples(driver)
        flags = Status.OK
        for sample in bench.samples:
            flags |= Status(sample.status)
        return Outcome(error, _counted(driver), flags & ~Status.LOST)


def _counted(driver: Ad7746) -> dict[str, int]:
    return {name: count for name, count in asdict(driver.counters).items() if count and name != "pairs"}


def attempt(opening: Opening) -> SourceError | None:
    """Try to open the board; return the error."""
    with contextmanager(opening.attempt)() as bench:
        try:
            bench.open_kit(**opening.where)
        except SourceError as raised:
            return raised
    return None


def table() -> str:
    """Return the table as text."""
    lines = []
    for opening in OPENING:
        raised = attempt(opening)
        lines += [f"- {opening.name}", f"    {type(raised).__name__}: {_plain(raised)}"]
    for row in RUNNING:
        outcome = run(row)
        lines.append(f"- {row.name}")
        if outcome.error:
            lines.append(f"    {type(outcome.error).__name__}: {_plain(outcome.error)}")
        else:
            marks = f"; samples marked {outcome.flags.name}" if outcome.flags else ""
            counts = ", ".join(f"{name} {count}" for name, count in outcome.counters.items()) or "nothing"
            lines.append(f"    goes on; counted: {counts}{marks}")
    return "\n".join(lines)


def _plain(error: SourceError | None) -> str:
    return re.sub(r"/tmp/\w+/", "", str(error))


if __name__ == "__main__":
    assert set(Counters.__dataclass_fields__) >= {"lost", "errors", "retries", "reconnects"}
    print(table())
