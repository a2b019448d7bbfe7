"""`palpate live`: a measurement in the browser."""

import logging
import os
import signal
import socket
import sys
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from threading import Event
from typing import TYPE_CHECKING, TextIO

import click
from click.core import ParameterSource

from palpate.calibration.assessment import calibration_doubts
from palpate.cli.accept_option import accept_option
from palpate.cli.browser import browser
from palpate.cli.exit_codes import ExitCode, handle_signals, usage_errors
from palpate.cli.output import (
    json_option,
    output_settings,
    print_message,
    print_notes,
    print_result,
)
from palpate.cli.paths import OUTPUT, InputFile, require_free, with_sidecar
from palpate.cli.shared_options import (
    SourceOptions,
    TrackerOptions,
    board_options,
    complete_source,
    lsl_option,
    recording_options,
)
from palpate.errors import need
from palpate.uncertainty import TOUCH_SCATTER

if TYPE_CHECKING:
    from palpate.calibration import Calibration
    from palpate.live.measurement import Measurement
    from palpate.live.opened_source import OpenedSource


@click.command("live")
@click.argument("sources", metavar="[SOURCE] [FILE...]", nargs=-1, shell_complete=complete_source)
@click.option(
    "--record",
    "file",
    type=OUTPUT,
    help="The recording to write from the start, NAME.csv: a new file. The button Record continues "
    "with NAME-2.csv ...; without this option it proposes names with the date.",
)
@click.option(
    "--folder",
    type=click.Path(file_okay=False, exists=True, path_type=Path),
    help="Where the page writes recordings, reports and calibrations. Default: that of --record, "
    "or the present one.",
)
@click.option(
    "--calibration",
    type=InputFile(),
    help="Calibration file from `calibrate`: shows the modulus with its interval.",
)
@accept_option
@click.option(
    "--scatter",
    default=TOUCH_SCATTER,
    show_default=True,
    type=click.FloatRange(0, 1),
    help="Relative scatter of the ratio from touch to touch, to tell whether touches agree; a "
    "calibration has its own.",
)
@lsl_option
@board_options
@recording_options
@click.option(
    "--port",
    default=8746,
    show_default=True,
    type=click.IntRange(0, 65535),
    help="Port of the page; 0: any. If the default port is in use, the next free one is taken.",
)
@click.option(
    "--host",
    default="127.0.0.1",
    show_default=True,
    help="Address to listen at. With another address than 127.0.0.1 others on the network can open "
    "the page, with the token.",
)
@click.option(
    "--no-token",
    is_flag=True,
    help="No token in the address: any user of this machine can open the page. Not with --host.",
)
@click.option("--no-open", is_flag=True, help="Print the address, do not open a browser.")
@json_option
def live_command(
    sources: tuple[str, ...],
    file: Path | None,
    folder: Path | None,
    calibration: Path | None,
    accept: tuple[str, ...],
    scatter: float,
    lsl: str | None,
    reading: SourceOptions,
    tracker: TrackerOptions,
    port: int,
    host: str,
    no_token: bool,
    no_open: bool,
) -> None:
    """Watch a measurement in the browser.

    The page shows ratio, uncertainty and touches while you measure. SOURCE: as in `palpate record`;
    without it, the connected board, or the demo: you press a simulated probe on four specimens,
    with a mouse, a finger or a key. A simulation begins when the page is open. By default only this machine can open the page, with the token in the printed address;
    it needs no network. Files are written only with --record, and by the buttons Record, Report and
    Save: new ones, in one folder; a further button adds the result on a specimen of known modulus
    to the calibration file. A recording, FILE.csv, is shown as a whole; up to four are laid
    beside each other. Ends with Ctrl-C or a closed terminal (exit code 130; a recording is closed
    properly). Exit codes: 2, the calibration is of another chip, or simulated; 3, no device; 4, a
    file cannot be written, or a recording failed; 6, an extra is missing.

    \b
    Example:
      palpate live
      palpate live usb: --record bench.csv --calibration probe.toml
      palpate live monday.csv tuesday.csv
      palpate live "sim:sliding?seed=1" --scene sliding --no-open
    """  # noqa: D301
    for module in ("starlette", "uvicorn", "websockets", "msgspec"):
        need(module, "live")
    require_free(with_sidecar(file) if file else [], force=None)
    from palpate.cli.live_sources import DEMO_SOURCE, LiveOptions, LiveSources, print_line
    from palpate.live.access import is_loopback
    from palpate.live.app import PageApp
    from palpate.live.opened_source import OpenedSource
    from palpate.live.peers import door_for
    from palpate.live.server import address_of, serve
    from palpate.sources.options import is_file

    token = _token(host, no_token=no_token)
    source = sources[0] if sources else _connected_board()
    source = source or DEMO_SOURCE
    if len(sources) > 1:
        _check_files(sources)
    tracking = tracker.keywords()
    scene_origin = click.get_current_context().get_parameter_source("scene")
    options = LiveOptions(
        source,
        sources[1:],
        reading.keywords(),
        tracking,
        scene_origin is not ParameterSource.DEFAULT,
        scatter,
        accept,
        _load_calibration(calibration, tracking["scene"]) if calibration else None,
        calibration,
        file,
        folder,
        lsl,
    )
    first_page = Event()
    with usage_errors(), ExitStack() as close_unless_started:
        if is_file(source):
            _check_no_outputs(file, lsl)
        live_sources = LiveSources(options, first_page)
        opened = OpenedSource(live_sources.build(), live_sources)
        listening = close_unless_started.enter_context(_listening_socket(host, port))
        opened.bench.measurement.start()
        close_unless_started.pop_all()
    debug = output_settings().debug
    with (
        _closing(opened),
        listening,
        library_logs(debug=debug),
        ExitStack() as close_browser,
    ):
        page = PageApp(opened, first_page)
        used_port = listening.getsockname()[1]
        address = address_of(listening, host, token)
        document = {"address": address, "source": source, "recording": str(file) if file else None}
        begin = _begin_text(opened.bench.measurement)
        print_result(document, f"{source} at {address} (Ctrl-C ends it){begin}", indent=None)
        sys.stdout.flush()
        if not no_open and _has_screen():
            close_browser.enter_context(browser(address, page.was_shown))
        own_user_only = token is not None and is_loopback(host)
        door = door_for(listening, print_line, own_user_only=own_user_only)
        serve(page.app(host, used_port, token), listening, door)


def _begin_text(measurement: "Measurement") -> str:
    """Return a line on when a simulation begins; "": it runs, or it is none."""
    from palpate.live.measurement import LONGEST_WAIT_S

    if measurement.hand is None or not measurement.hand.is_waiting:
        return ""
    return f"\nIt begins when the page is open, after {LONGEST_WAIT_S:g} s at the latest."


def _listening_socket(host: str, port: int) -> socket.socket:
    """Return the listening socket; if nobody asked for a port, at the next free one."""
    from palpate.cli.live_sources import print_line
    from palpate.live.server import listen, listen_near

    port_origin = click.get_current_context().get_parameter_source("port")
    if port_origin is not ParameterSource.DEFAULT:
        return listen(host, port)
    listening = listen_near(host, port)
    used_port = listening.getsockname()[1]
    if used_port != port:
        reason = f"port {port} is in use, perhaps by another palpate live"
        print_line(f"{reason}: this page has port {used_port}")
    return listening


def _connected_board() -> str:
    """Return the source of the connected board, else ""; print which."""
    from palpate.sources.devices import boards, chips, search_by

    connected, notes = search_by(boards, chips)
    if connected:
        click.echo(f"{connected[0].uri}: {connected[0].description}", err=True)
        return connected[0].uri
    print_notes("not searched", notes)
    click.echo(
        "no board found: this is a demo; press its simulated probe on the page; with your board: "
        "palpate doctor",
        err=True,
    )
    return ""


def _check_files(sources: Sequence[str]) -> None:
    """Check that several sources are recordings that can be compared."""
    from palpate.live.compare import LETTERS
    from palpate.sources.options import is_file

    are_files = all(is_file(source) for source in sources)
    are_different = len(set(sources)) == len(sources)
    if not are_files or not are_different or len(sources) > len(LETTERS):
        allowed = f"{len(LETTERS)} recordings at most, each once"
        raise click.UsageError(f"FILE: got {' '.join(sources)}, allowed: {allowed}")


def _check_no_outputs(file: Path | None, lsl: str | None) -> None:
    """Check that a recording is not recorded or sent again."""
    if file or lsl is not None:
        option = "--record" if file else "--lsl"
        allowed = 'with a source that measures, or "FILE?speed=1"'
        raise click.UsageError(f"{option}: got it with a recording, allowed: {allowed}")


def _load_calibration(path: Path, scene: str) -> "Calibration":
    from palpate.calibration import Calibration

    need("scipy", "science")  # now, not during the measurement
    calibration = Calibration.load(path)
    print_notes(path, calibration_doubts(calibration, scene))
    return calibration


def _token(host: str, *, no_token: bool) -> str | None:
    """Return the token for the address of the page; None: any user of this machine can open it."""
    from palpate.live.access import is_loopback, new_token

    if is_loopback(host):
        return None if no_token else new_token()
    if no_token:
        allowed = "only with an address of this machine alone"
        raise click.UsageError(f"--no-token: got --host {host}, allowed: {allowed}")
    click.echo(
        f"Warning: others on the network can reach {host}. Anyone with the address below can "
        "watch, tare and record; it is not encrypted.",
        err=True,
    )
    return new_token()


def _has_screen() -> bool:
    if sys.platform != "linux":
        return True
    return any(os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER"))


@contextmanager
def _closing(opened: "OpenedSource") -> Iterator[None]:
    """Close the source that is open when the server ends, also after an error."""
    try:
        yield
    except KeyboardInterrupt:
        # Ignore further signals: the measurement is ending.
        with handle_signals(lambda *_: None, signal.SIGINT, signal.SIGTERM):
            print_message("ended")
            opened.close()
            sys.exit(ExitCode.BAD_DATA if opened.failed else ExitCode.INTERRUPTED)
    finally:
        opened.close()


class OnceHandler(logging.StreamHandler[TextIO]):
    """Writes each line once: what fails with every connection would fill the terminal."""

    def __init__(self) -> None:
        super().__init__()
        self._written: set[str] = set()

    def emit(self, record: logging.LogRecord) -> None:
        """Write a record, unless its line was written before."""
        line = self.format(record)
        if line not in self._written:
            self._written.add(line)
            super().emit(record)


class OneLineFormatter(logging.Formatter):
    """Writes an error as one line, without its traceback."""

    def format(self, record: logging.LogRecord) -> str:
        """Return the line."""
        error = record.exc_info[1] if record.exc_info else None
        if error:
            text = f"{type(error).__name__}: {error}"
        else:
            text = record.getMessage().strip().splitlines()[-1]
        return f"page: {record.name}: {' '.join(text.split())[:200]}; --debug shows more"


@contextmanager
def library_logs(*, debug: bool) -> Iterator[None]:
    """Print the logs of libraries: errors as one line, or all from warnings on with tracebacks."""
    handler = logging.StreamHandler() if debug else OnceHandler()
    if not debug:
        handler.setLevel(logging.ERROR)
        handler.setFormatter(OneLineFormatter())
    logging.getLogger().addHandler(handler)
    try:
        yield
    finally:
        logging.getLogger().removeHandler(handler)
