"""`palpate live`: a measurement in the browser."""

import json
import os
import signal
import sys
import webbrowser
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, nullcontext, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from palpate import PalpateError
from palpate.cli.exit import BAD_DATA, INTERRUPTED, one_line
from palpate.cli.inputs import InputFile
from palpate.cli.library_logs import library_logs
from palpate.cli.lsl import lsl_option
from palpate.cli.moduli import tell_origin
from palpate.cli.options import board_options, json_option, opening, recording_options, tracking
from palpate.cli.outputs import OUTPUT, require_free, with_sidecar
from palpate.cli.source import SourceType
from palpate.cli.terminal import say, signals
from palpate.several import TOUCH_SCATTER

if TYPE_CHECKING:
    from palpate.ad7746.evalkit.find import Board
    from palpate.calibration import Calibration
    from palpate.live.review import Review
    from palpate.live.session import Session

SIMULATED = "sim:four-specimens"
_PORT = 8746


@click.command()
@click.argument("source", type=SourceType(), required=False)
@click.option("--record", "file", type=OUTPUT,
              help="The recording to write from the start, NAME.csv: a new file. The button Record continues with "
              "NAME-2.csv ...; without this option it proposes names with the date.")  # fmt: skip
@click.option("--folder", type=click.Path(file_okay=False, exists=True, path_type=Path),
              help="Where the page writes recordings, reports and calibrations. Default: that of --record, or the present "
              "one.")  # fmt: skip
@click.option("--calibration", type=InputFile(),
              help="Calibration file from `calibrate`: shows the modulus with its interval.")  # fmt: skip
@click.option("--scatter", default=TOUCH_SCATTER, show_default=True, type=click.FloatRange(0, 1),
              help="Relative scatter of the ratio from touch to touch, to tell whether touches agree; a calibration "
              "has its own.")  # fmt: skip
@lsl_option
@board_options
@recording_options
@click.option(
    "--port", default=_PORT, show_default=True, type=click.IntRange(0, 65535), help="Port of the page; 0: any."
)
@click.option("--host", default="127.0.0.1", show_default=True,
              help="Address to listen at. With another address than 127.0.0.1 others on the network can open the page, "
              "with the token.")  # fmt: skip
@click.option("--no-token", is_flag=True,
              help="No token in the address: any user of this machine can open the page. Not with --host.")  # fmt: skip
@click.option("--no-open", is_flag=True, help="Print the address, do not open a browser.")
@json_option
def live(
    source: str | None,
    file: Path | None,
    folder: Path | None,
    calibration: Path | None,
    scatter: float,
    lsl: str | None,
    firmware: Path | None,
    excitation: str | None,
    asked: dict[str, Any],
    scene: str,
    touch_seconds: float | None,
    samples: int | None,
    settings: dict[str, float],
    port: int,
    host: str,
    no_token: bool,
    no_open: bool,
    as_json: bool,
) -> None:
    """Watch a measurement in the browser.

    The page shows ratio, uncertainty and touches while you measure. SOURCE: as in `palpate record`; without it, the
    connected board, or a simulated one. By default only this machine can open the page, with the token in the printed
    address; it needs no network. Files are written only with --record, and by the buttons
    Record, Report and Save: new ones, in one folder. A recording, FILE.csv, is shown as a whole. Ends with Ctrl-C or a closed terminal (exit code 130; a recording is closed properly).
    Exit codes: 3, no device; 4, a file cannot be written, or a recording failed; 6, an extra is missing.

    \b
    Example:
      palpate live
      palpate live usb: --record bench.csv --calibration probe.toml
      palpate live "sim:sliding?seed=1" --scene sliding --no-open
    """  # noqa: D301
    _require()
    require_free(with_sidecar(file) if file else [], force=None)
    from palpate.live.access.gatekeeper import new_token
    from palpate.live.opening import is_file, opener, review
    from palpate.live.recordings import Recordings
    from palpate.live.serve import address_of, listen, serve
    from palpate.live.server import Server
    from palpate.live.session import Session
    from palpate.live.workbench import Workbench

    token, named = _token(host, no_token=no_token), source
    source = source or _plugged_in()
    how: dict[str, Any] = {"scene": scene, **tracking(touch_seconds, samples, settings)}
    beside, tell = opening(firmware, excitation) | asked, lambda message: say(one_line(message))
    looks = is_file(source)
    if looks:
        _refuse_measuring(file, lsl)
        if click.get_current_context().get_parameter_source("scene") is ParameterSource.DEFAULT:
            how["scene"] = None  # that of the recording
    calibrated = _calibration(calibration, scene) if calibration else None
    try:
        session = (
            review(source, beside, how, tell)
            if looks
            else Session(opener(source, beside), Recordings(file, folder), how, tell, lsl)
        )
        with ExitStack() as unless_started:
            listening = unless_started.enter_context(listen(host, port))
            session.start()
            unless_started.pop_all()
    except (ValueError, TypeError) as error:
        raise click.UsageError(str(error).split("\n")[0]) from error
    debug = "palpate.debug" in click.get_current_context().meta
    in_place = not named and source == SIMULATED
    with _ending(session), _arrivals(session) if in_place else nullcontext(), listening, library_logs(debug=debug):
        ticket = new_token() if token else None
        server, port = Server(Workbench(session, source, calibrated, scatter, calibration)), listening.getsockname()[1]
        _tell(address_of(listening, host, token), source, file, as_json=as_json)
        if not no_open and _has_screen():
            webbrowser.open(address_of(listening, host, ticket))
        serve(server.app(host, port, token, ticket), listening, token, ticket)


def _refuse_measuring(file: Path | None, lsl: str | None) -> None:
    for name, given in {"--record": file, "--lsl": lsl}.items():
        if given is not None:
            raise click.UsageError(
                f'{name}: got it with a recording, allowed: with a source that measures, or "FILE?speed=1"'
            )


def _require() -> None:
    from palpate.extras import need

    for module in ("starlette", "uvicorn", "websockets"):
        need(module, "live")


def _plugged_in() -> str:
    """Return the connected board, or a simulated one, and print which."""
    from palpate.sources.devices import boards

    found, notes = boards()
    for note in [] if found else notes:
        click.echo(f"not searched: {note}", err=True)
    uri = found[0].uri if found else SIMULATED
    click.echo(f"{uri}: {found[0].what}" if found else f"no board found; using a simulated one: {uri}", err=True)
    return uri


@contextmanager
def _arrivals(session: "Session | Review") -> Iterator[None]:
    """While a simulated board measures in place of one: tell when one is plugged in."""
    from palpate.ad7746.evalkit.hotplug import Hotplug  # the simulated board needs pyusb, too

    def tell(before: "set[Board]", now: "set[Board]") -> None:
        for board in now - before:
            session.stream.source.notify(
                f"usb:{board} was plugged in: to measure with it, end this with Ctrl-C, then type palpate live again"
            )

    with ExitStack() as ending:
        with suppress(OSError, PalpateError):  # no libusb, for example
            ending.callback(Hotplug(tell).close)
        yield


def _calibration(path: Path, scene: str) -> "Calibration":
    from palpate.calibration import Calibration

    found = Calibration.load(path)
    found.modulus(found.probe.soft_ratio)  # raises MissingExtra now, not during the measurement
    tell_origin(path, found.about, scene)
    return found


def _token(host: str, *, no_token: bool) -> str | None:
    from palpate.live.access.gatekeeper import is_loopback, new_token

    if is_loopback(host):
        return None if no_token else new_token()
    if no_token:
        raise click.UsageError(f"--no-token: got --host {host}, allowed: only with an address of this machine alone")
    click.echo(
        f"Warning: others on the network can reach {host}. Anyone with the address below can watch, tare and record; "
        "it is not encrypted.",
        err=True,
    )
    return new_token()


def _tell(address: str, source: str, file: Path | None, *, as_json: bool) -> None:
    document = {"address": address, "source": source, "recording": str(file) if file else None}
    click.echo(json.dumps(document) if as_json else f"{source} at {address} (Ctrl-C ends it)")
    sys.stdout.flush()


def _has_screen() -> bool:
    return sys.platform != "linux" or bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


@contextmanager
def _ending(session: "Session | Review") -> Iterator[None]:
    """Close the session when the server ends, also after an error."""
    try:
        yield
    except KeyboardInterrupt:
        with signals(lambda *_: None, signal.SIGINT, signal.SIGTERM):  # another one changes nothing: it ends
            say("ended")
            session.close()
            sys.exit(BAD_DATA if session.failed else INTERRUPTED)
    finally:
        session.close()
