"""Follows the source of a run: its chips, and whether the calibration was made for it."""

from collections.abc import Collection
from datetime import datetime
from pathlib import Path

from palpate.calibration import Calibration
from palpate.calibration.origin import (
    ReadingsOrigin,
    missing_remark,
    origin_remarks,
    refusal,
)
from palpate.calibration.provenance import present_time
from palpate.errors import CalibrationRefused
from palpate.files import Json
from palpate.live.measurement import LiveMeasurement
from palpate.live.plan import TouchPlan
from palpate.sources import Gap
from palpate.stream import Listener


class SourceWatch(Listener):
    """Compares the chip with the calibration's each time the board is opened.

    The first measurement of a run is refused with an error if they differ. Later the measurement
    goes on without the calibration, until its chip is back.

    Attributes
    ----------
    begun_at : datetime.datetime
        Begin of the run, UTC.
    chips : set of str
        Fingerprints of the chips of this run.
    simulated : bool or None
        Whether the source is a simulator; None: unknown.
    """

    def __init__(
        self, measurement: LiveMeasurement, plan: TouchPlan, accept: Collection[str] = ()
    ) -> None:
        self._measurement = measurement
        self._plan = plan
        self._accept = accept
        self._unused: Calibration | None = None
        self._unused_file: Path | None = None
        self._shown: set[str] = set()
        self._has_begun = False
        self.begun_at: datetime = present_time()
        self.chips: set[str] = set()
        self.simulated: bool | None = None
        self._reason = ""
        measurement.listeners.append(self)

    def opened(self, device: Json) -> None:
        """Compare when the source is open; CalibrationRefused before the first measurement."""
        self._compare(device, is_first=not self._has_begun)
        self._has_begun = True

    def gap(self, gap: Gap) -> None:
        """Compare again: the board may be another one."""
        self._compare(self._measurement.device())

    @property
    def refused(self) -> str:
        """Why the calibration is not used; "": it is used, or there is none."""
        return "" if self._plan.progress.calibration else self._reason

    def _compare(self, device: Json, *, is_first: bool = False) -> None:
        """Use the calibration, or not."""
        origin = ReadingsOrigin.of_device(device)
        self.simulated = origin.simulated
        if origin.chip:
            self.chips.add(origin.chip)
        used = self._plan.progress.calibration
        calibration = used or self._unused
        if calibration is None:
            return
        provenance = calibration.about.provenance
        self._reason = refusal(provenance, origin, self._accept)
        if self._reason and is_first:
            raise CalibrationRefused(f"--calibration: {self._reason}")
        if self._reason and used:
            self._stop_using(calibration)
        elif not self._reason and not used:
            self._use_again(calibration)
        if not self._reason:
            self._show([missing_remark(provenance), *origin_remarks(provenance, origin)])

    def _stop_using(self, calibration: Calibration) -> None:
        """Go on without the calibration, also in reports: the board is another one."""
        files = self._measurement.files
        self._unused = calibration
        self._unused_file = files.calibration
        files.calibration = None
        self._plan.use_calibration(None)
        self._measurement.notify(f"the calibration is not used: {self._reason}")

    def _use_again(self, calibration: Calibration) -> None:
        """Use the calibration again: its board is back."""
        self._measurement.files.calibration = self._unused_file
        self._plan.use_calibration(calibration)
        self._measurement.notify("the calibration is used again")

    def _show(self, remarks: list[str]) -> None:
        """Show each remark once."""
        for remark in remarks:
            if remark and remark not in self._shown:
                self._shown.add(remark)
                self._measurement.notify(f"calibration: {remark}")
