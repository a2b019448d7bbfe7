"""The sources of `palpate live`: that of the command line, and those that the page opens in its place."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from threading import Event

from palpate.calibration import Calibration
from palpate.calibration.origin import (
    ReadingsOrigin,
    missing_remark,
    origin_remarks,
    require_origin,
)
from palpate.cli.exit_codes import message_line
from palpate.cli.output import print_message, print_notes
from palpate.cli.shared_options import Keywords
from palpate.errors import CalibrationRefused
from palpate.live.commands import FileWorkbench, LiveWorkbench, Workbench
from palpate.live.file_review import RecordedMeasurement
from palpate.live.measurement import LiveMeasurement, opener
from palpate.live.opened_source import SourceOpener, StartedSource
from palpate.live.protocol import RefusedCommand
from palpate.live.run_files import RunFiles
from palpate.recording.sidecar import Sidecar, load_checked
from palpate.sources.devices import boards, chips, search_by
from palpate.sources.options import is_file, split

DEMO_SOURCE = "demo:"
_DEMO_TOUCH_S = 3.0  # of a touch of the demo, if nobody asks for another length


@dataclass(frozen=True)
class LiveOptions:
    """The options of `palpate live` for a source.

    `others`: recordings to compare with the source. `has_scene`: whether the user has named the scene
    in `tracking`, the scene and settings of the tracker.
    """

    source: str
    others: tuple[str, ...]
    reading: Keywords
    tracking: Keywords
    has_scene: bool
    scatter: float
    accept: tuple[str, ...]
    calibration: Calibration | None = None
    calibration_file: Path | None = None
    record: Path | None = None
    folder: Path | None = None
    lsl: str | None = None

    def settings(self) -> Keywords:
        """Return scene and settings of the tracker for this source."""
        tracking = self.tracking
        has_length = bool({"seconds", "samples"} & tracking.keys())
        if _is_demo(self.source) and not has_length:
            tracking = tracking | {"seconds": _DEMO_TOUCH_S}
        if self.calibration:
            tracking = self.calibration.for_tracking(tracking) | tracking
        if is_file(self.source) and not self.has_scene:
            tracking = tracking | {"scene": None}  # the recording's
        return tracking


class LiveSources(SourceOpener):
    """Builds a measurement or a recording with its workbench, for a source.

    Recordings that the page opens have the settings that are stored in them; the demo has those of the
    scene; another source has the options of the command line.
    """

    def __init__(self, options: LiveOptions, first_page: Event) -> None:
        self.folder = options.folder or Path()
        if options.folder is None and is_file(options.source):
            self.folder = Path(split(options.source).address).parent
        elif options.folder is None and options.record:
            self.folder = options.record.parent
        self._options = options
        self._first_page = first_page
        self._files = RunFiles(options.record, self.folder)

    def build(self) -> Workbench:
        """Return the workbench of the source of the command line."""
        return self._build(self._options, self._files)

    def source_to_measure(self, shown: str) -> str:
        """Return the shown source if it measures, else that of the command line, else the connected board."""
        for source in (shown, self._options.source):
            if not _is_demo(source) and not is_file(source):
                return source
        connected, notes = search_by(boards, chips)
        if not connected:
            reasons = "".join(f"; {note}" for note in notes)
            raise RefusedCommand(
                f"measure: no board is connected{reasons}: plug it in; in a terminal "
                "`palpate doctor` finds the reason"
            )
        return connected[0].uri

    def source_of_demo(self) -> str:
        """Return the name of the demo; that of the command line may have options."""
        if _is_demo(self._options.source):
            return self._options.source
        return DEMO_SOURCE

    def start(self, source: str, number: int) -> StartedSource:
        """Start a source; without the calibration, if it was not made for it."""
        options = self._options_for(source)
        try:
            return StartedSource(self._start(options, number), "")
        except CalibrationRefused as error:
            if options.calibration is None:
                raise
            remark = f"The calibration is not used: {error}"
            print_line(remark)
        without = replace(options, calibration=None, calibration_file=None)
        return StartedSource(self._start(without, number), remark)

    def _options_for(self, source: str) -> LiveOptions:
        options = self._options
        if source == options.source:
            return options
        if not is_file(source) and not _is_demo(source):
            return replace(options, source=source, others=())
        return replace(
            options,
            source=source,
            others=(),
            reading={},
            tracking={"scene": options.tracking["scene"]},
            has_scene=False,
            lsl=None,
        )

    def _start(self, options: LiveOptions, number: int) -> Workbench:
        bench = self._build(options, self._files.again())
        measurement = bench.measurement
        measurement.number += number
        if isinstance(measurement, LiveMeasurement):
            measurement.records = False  # only what begins with the run, or a person
        measurement.start()
        return bench

    def _build(self, options: LiveOptions, files: RunFiles) -> Workbench:
        if is_file(options.source):
            review = _review_of(options)
            return FileWorkbench(
                review,
                options.source,
                options.calibration,
                options.scatter,
                options.calibration_file,
                options.accept,
            )
        live = LiveMeasurement(
            opener(options.source, options.reading),
            files,
            options.settings(),
            print_line,
            options.lsl,
            first_page=self._first_page,
        )
        return LiveWorkbench(
            live,
            options.source,
            options.calibration,
            options.scatter,
            options.calibration_file,
            options.accept,
        )


def _review_of(options: LiveOptions) -> RecordedMeasurement:
    """Return the recording of a source; CalibrationRefused if the calibration was not made for it."""
    source = options.source
    review = RecordedMeasurement(
        source, options.reading, options.settings(), print_line, options.folder
    )
    if options.others:
        review.files.others = [Path(path) for path in (source, *options.others)]
    sidecars = {source: review.recording.sidecar}
    for other in options.others:
        sidecars[other] = load_checked(Path(other)) or Sidecar()
    _check_origins(options.calibration, sidecars, options.accept)
    return review


def _check_origins(
    calibration: Calibration | None, sidecars: Mapping[str, Sidecar], accept: Collection[str]
) -> None:
    """Print remarks on the origins of calibration and recordings; refuse what does not match."""
    if calibration is None:
        return
    provenance = calibration.about.provenance
    print_notes("calibration", [missing_remark(provenance)])
    for source, sidecar in sidecars.items():
        origin = ReadingsOrigin.of_sidecar(sidecar)
        require_origin(source, provenance, origin, accept)
        print_notes(source, origin_remarks(provenance, origin))


def print_line(message: str) -> None:
    """Print a message of a measurement as one line."""
    print_message(message_line(message))


def _is_demo(source: str) -> bool:
    return split(source).scheme == "demo"
