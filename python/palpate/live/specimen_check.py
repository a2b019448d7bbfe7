"""Compares a specimen of known modulus, touched while a calibration is used, with it."""

from collections.abc import Sequence

from palpate.calibration import Calibration
from palpate.calibration.assurance import CalibrationVerification, today
from palpate.calibration.calibration_file import add_verification
from palpate.calibration.learning import learned_from
from palpate.live.measurement import LiveMeasurement
from palpate.live.plan import KnownSpecimen, TouchPlan
from palpate.live.protocol import RefusedCommand, VerificationMessage
from palpate.live.source_watch import SourceWatch


class SpecimenCheck:
    """Compares the specimen of the newest touch with the calibration, when its touches are done.

    The result is added to the calibration file by a command. Specimens that calibrated in this run
    are not compared: their touches are no test.
    """

    def __init__(
        self, measurement: LiveMeasurement, plan: TouchPlan, watch: SourceWatch | None = None
    ) -> None:
        self._measurement = measurement
        self._watch = watch
        self._plan = plan
        self._given = plan.progress.calibration
        self._calibrated: frozenset[str] = frozenset()
        self._compared: tuple[Calibration, KnownSpecimen, list[KnownSpecimen]] | None = None
        self._found: CalibrationVerification | None = None
        self._kept: CalibrationVerification | None = None
        plan.on_changed.append(self._note_calibrated)

    def document(self) -> VerificationMessage:
        """Return the message: the result as a sentence, "": there is none."""
        found = self._newest()
        if found is None:
            return VerificationMessage("", agrees=True, kept=False)
        return VerificationMessage(f"{found}.", found.agrees, found == self._kept)

    def verify(self) -> str:
        """Add the result to the calibration file; return the message."""
        found = self._newest()
        calibration = self._plan.progress.calibration
        path = self._measurement.files.calibration
        if found is None or calibration is None or path is None:
            raise RefusedCommand(
                "verify: there is no result yet, allowed: with a calibration file, after all "
                "touches on a specimen of known modulus that did not calibrate in this run"
            )
        if self._is_simulated(calibration):
            raise RefusedCommand(
                "verify: the touches are simulated, but the calibration was made with a probe: "
                "they are no evidence, allowed: touches with a probe"
            )
        if found == self._kept:
            raise RefusedCommand(f"verify: {path.name} has this result already")
        try:
            add_verification(path, found)
        except OSError as error:
            raise RefusedCommand(f"verify: {path.name}: {error.strerror}") from error
        self._kept = found
        self._plan.note(f"verification: {found}")
        return f"{path.name} has the result: {found}."

    def _is_simulated(self, calibration: Calibration) -> bool:
        """Return whether the touches are simulated, and the calibration is not."""
        is_real = calibration.about.provenance.simulated is False
        return is_real and self._watch is not None and self._watch.simulated is True

    def _newest(self) -> CalibrationVerification | None:
        """Return the comparison of the specimen that was touched last; None: there is none."""
        calibration = self._plan.progress.calibration
        known = self._plan.known()
        specimen = self._specimen(known)
        if calibration is None or specimen is None:
            return None
        compared = (calibration, specimen, known)
        if compared != self._compared:
            self._compared = compared
            self._found = _comparison(calibration, specimen, known)
        return self._found

    def _specimen(self, known: Sequence[KnownSpecimen]) -> KnownSpecimen | None:
        """Return the specimen that was touched last, if it can be compared and is done."""
        progress = self._plan.progress
        last = progress.named(progress.last)
        if last is None or last.name in self._calibrated:
            return None
        if len(progress.kept.get(last.name, ())) < last.wanted:
            return None
        for one in known:
            if one.name == last.name:
                return one
        return None

    def _note_calibrated(self) -> None:
        """Remember which specimens a calibration was fitted to that is new in this run."""
        calibration = self._plan.progress.calibration
        if calibration is None or calibration is self._given:
            return
        self._given = calibration
        touched = [one.name for one in self._plan.known() if one.touches]
        self._calibrated = frozenset(touched)


def _comparison(
    calibration: Calibration, specimen: KnownSpecimen, known: Sequence[KnownSpecimen]
) -> CalibrationVerification | None:
    """Return the comparison; None: no touch counts. All touches show the contact exponent."""
    counted = [touch for touch in specimen.kept if not calibration.objections(touch)]
    if not counted:
        return None
    touches = {one.name: one.kept for one in known}
    learned = learned_from(calibration, touches)
    return learned.calibration.verify(
        counted,
        specimen.modulus,
        specimen.modulus_uncertainty,
        specimen=specimen.name,
        date=today(),
    )
