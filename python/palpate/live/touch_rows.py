"""The table of touches on the page, and the values of `hello` and `state` beside it."""

import math
from collections.abc import Collection
from dataclasses import dataclass

from msgspec import UNSET, UnsetType

from palpate._core import Tracker
from palpate.ad7746.registers import linearity_pF
from palpate.calibration import Calibration, Modulus
from palpate.calibration.learning import LearnedCalibration, learned_from
from palpate.calibration.ranges import wider
from palpate.files import Json
from palpate.flags import advice
from palpate.live.measurement import PRESSED, Measurement
from palpate.live.plan import TouchKept, TouchPlan
from palpate.live.protocol import (
    HelloMessage,
    PressedSpecimen,
    RatioState,
    ShownAgreement,
    ShownModulus,
    ShownScatter,
    ShownTrend,
    SimulatedPress,
    SimulationFacts,
    TouchesMessage,
    TouchRow,
)
from palpate.recording import sidecar
from palpate.repeatability import Agreement, agreement, most_reliable, session_scatter, with_scatter
from palpate.touch import Touch
from palpate.tracking import given_levels, has_given_baseline
from palpate.uncertainty import TOUCH_SCATTER, Scatter, Uncertainty


@dataclass(frozen=True)
class _Counted:
    """What the touches show together, for one version of the plan."""

    version: int
    scatter: Scatter
    learned: LearnedCalibration | None


class TouchTable:
    """The touches of a measurement, with what the plan knows of them, and moduli if there is a calibration.

    `scatter`: relative scatter from touch to touch without a calibration, for whether touches agree, and for the uncertainty.
    """

    def __init__(
        self, measurement: Measurement, plan: TouchPlan, scatter: float = TOUCH_SCATTER
    ) -> None:
        self._measurement = measurement
        self._plan = plan
        self._scatter = scatter
        self._assumed = None if plan.progress.calibration else scatter
        # by number: what it is made of, and the row
        self._rows: dict[int, tuple[tuple[object, ...], TouchRow]] = {}
        self._counted: _Counted | None = None
        self._message: TouchesMessage | None = None
        self._shown_version = -1

    @property
    def calibration(self) -> Calibration | None:
        """The calibration of the plan; a new one holds for all touches."""
        return self._plan.progress.calibration

    def hello(self, source: str) -> HelloMessage:
        """Return the values that do not change during a measurement."""
        measurement = self._measurement
        tracker = measurement.tracker
        device = measurement.device()
        calibration = self.calibration
        hello = HelloMessage(
            measurement=measurement.number,
            kind="live",
            file=measurement.file,
            origin_s=measurement.levels.first_s,
            seconds=tracker.settings.get("seconds"),
            source=source,
            simulation=_simulation(measurement, device),
            device=_device_name(device),
            scene=tracker.scene,
            stated=_stated(tracker),
            threshold=tracker.threshold,
            calibrated=calibration is not None,
            scatter=None,
            assumed=self._assumed,
        )
        if measurement.file:
            hello.kind = "file"
        if calibration:
            hello.scatter = calibration.touch_spread
        return hello

    def now(self) -> RatioState:
        """Return the values that change during a measurement."""
        measurement = self._measurement
        tracker = measurement.tracker_state
        ratio = error = math.nan
        if tracker.state in PRESSED:
            ratio = tracker.ratio
            error = tracker.standard_error
        known = Uncertainty.of_ratio(ratio, error, self._scatter_now())
        modulus = None
        # a level ratio: at the end only
        if self.calibration and self.calibration.ratio == "hold" and math.isfinite(ratio):
            noise = None
            if math.isfinite(known.noise):
                noise = known.noise
            modulus = shown_modulus(self.calibration.modulus(ratio, noise))
        return RatioState(
            measurement.state,
            measurement.levels.last_s,
            ratio,
            error,
            known.uncertainty,
            known.source,
            modulus,
        )

    def result(self, touch: Touch) -> str:
        """Return the ratio of a touch with its uncertainty, and its modulus if there is a calibration."""
        text = f"ratio {self.known(touch)}"
        modulus = self._modulus_of(touch)
        return f"{text}, modulus {modulus}" if modulus else text

    def known(self, touch: Touch) -> Uncertainty:
        """Return the uncertainty of a touch, with the scatter that holds now."""
        return self._uncertainty(touch, self._scatter_now())

    def document(self) -> TouchesMessage:
        """Return a row for each completed touch; whether they agree; the number of the most reliable one if they do.

        The message stays the same object until the plan changes, and a row until its touch does. What one more touch
        changes in all rows is beside them: `scatter`, for the uncertainties, and `means` of the specimens, for the
        distances from them.
        """
        version = self._plan.version
        if self._message is None or version != self._shown_version:
            self._message = self._document()
            self._shown_version = version
        return self._message

    def _document(self) -> TouchesMessage:
        known = self._plan.rows
        touches = self._measurement.touches[: len(known)]
        known = known[: len(touches)]
        alike = []  # on the last specimen
        for touch, row in zip(touches, known, strict=True):
            if row.kept and row.specimen == known[-1].specimen:
                alike.append(touch)
        found = self._agreement(alike)
        rows = []
        for number, (touch, row) in enumerate(zip(touches, known, strict=True), 1):
            rows.append(self._row(number, touch, row))
        scatter = self._scatter_now()
        return TouchesMessage(
            rows=rows,
            scatter=ShownScatter(scatter.share, scatter.source),
            means=self._plan.progress.means,
            most_reliable=self._most_reliable(touches, alike, found),
            together=self._together(alike, found),
            count=len(rows),
        )

    def _most_reliable(
        self, touches: list[Touch], alike: list[Touch], found: Agreement | None
    ) -> int | None:
        """Return the number of the most reliable touch; None: they do not agree."""
        if found is None or not found.agree:
            return None
        accepted: Collection[str] = ()
        if self.calibration:
            accepted = self.calibration.accepted
        ratio_of = self._plan.progress.ratio_of
        best = most_reliable(alike, scatter=None, accept=accepted, ratio_of=ratio_of)
        return touches.index(best) + 1

    def _together(self, alike: list[Touch], found: Agreement | None) -> ShownAgreement | None:
        """Return what several touches show together, with their modulus."""
        if found is None or found.touches < 2:
            return None
        learned = self._counts().learned
        modulus = None
        text = str(found)
        if learned and found.agree:
            modulus = shown_modulus(learned.calibration.mean_modulus(alike))
            if learned.sentence:
                text = f"{text}. {learned.sentence}"
        return shown_agreement(found, text, modulus)

    def _row(self, number: int, touch: Touch, known: TouchKept) -> TouchRow:
        made_of = (self._measurement.number, touch.revised, self._counts().learned, known)
        if number in self._rows and self._rows[number][0] == made_of:
            return self._rows[number][1]
        row = self._new_row(number, touch, known)
        self._rows[number] = (made_of, row)
        return row

    def _new_row(self, number: int, touch: Touch, known: TouchKept) -> TouchRow:
        ratio, standard_error = self._plan.progress.ratio_of(touch)
        modulus = self._modulus_of(touch)
        remarks = list(map(str, advice(touch)))
        if self.calibration:
            remarks += map(wider, self.calibration.differences(touch))
        return TouchRow(
            number=number,
            start=touch.start,
            start_s=touch.start_s,
            samples=touch.samples,
            ratio=ratio,
            covariance=touch.covariance,
            standard_error=standard_error,
            revised=touch.revised,
            first_ratio=touch.first_ratio,
            first_standard_error=touch.first_standard_error,
            level_ratio=touch.level_ratio,
            level_standard_error=touch.level_standard_error,
            contact_exponent=touch.contact_exponent,
            depth_pF=touch.depth_pF,
            rise_s=touch.rise_s,
            age_s=touch.age_s,
            ratio_before=touch.ratio_before,
            before_standard_error=touch.before_standard_error,
            ratio_after=touch.ratio_after,
            after_standard_error=touch.after_standard_error,
            offset_ratio=touch.offset_ratio,
            offset_standard_error=touch.offset_standard_error,
            effects=touch.effects,
            alarm_share=touch.alarm_share,
            saturated=touch.saturated,
            refused=touch.refused,
            flags=[flag.value for flag in touch.flags],
            outliers=touch.outliers,
            end_s=self._measurement.ends.get(number),
            modulus=shown_modulus(modulus) if modulus else None,
            advice=remarks,
            own_error=self._uncertainty(touch, Scatter(0.0)).uncertainty,
            specimen=known.specimen,
            kept=known.kept,
            why=known.why,
        )

    def _modulus_of(self, touch: Touch) -> Modulus | None:
        """Return the modulus of a touch, with what the touches so far show of the contact exponent."""
        if self.calibration is None:
            return None
        learned = self._counts().learned
        if learned:
            return learned.calibration.modulus_of(touch)
        return self.calibration.modulus_of(touch)

    def _uncertainty(self, touch: Touch, scatter: Scatter) -> Uncertainty:
        linearity = linearity_pF(self._measurement.tracker.settings["full_scale"])
        return Uncertainty.of(touch, scatter, linearity, self._plan.progress.ratio_of)

    def _scatter_now(self) -> Scatter:
        """Return the scatter of the calibration, else of the touches that are kept, else the assumed one."""
        return self._counts().scatter

    def _counts(self) -> _Counted:
        """Return what the touches show together; computed again when the plan has changed."""
        version = self._plan.version
        if self._counted is None or self._counted.version != version:
            learned = None
            if self._counted:
                learned = self._counted.learned
            self._counted = _Counted(version, self._scatter_of_touches(), self._learn(learned))
        return self._counted

    def _scatter_of_touches(self) -> Scatter:
        if self.calibration:
            return self.calibration.touch_scatter
        kept = []
        for row, touch in zip(self._plan.rows, self._measurement.touches, strict=False):
            if row.kept:
                kept.append((row.specimen, touch))
        found = session_scatter(kept, self._plan.progress.ratio_of)
        if found.source == "assumed":
            return Scatter(self._scatter)
        return found

    def _learn(self, before: LearnedCalibration | None) -> LearnedCalibration | None:
        """Learn the contact exponent from the kept touches; the same range as before: nothing changes."""
        if self.calibration is None:
            return None
        objects: dict[str, list[Touch]] = {}
        for touch, row in zip(self._measurement.touches, self._plan.rows, strict=False):
            if row.kept:
                objects.setdefault(row.specimen or "", []).append(touch)
        learned = learned_from(self.calibration, objects)
        if before is not None and learned.sentence == before.sentence:
            return before
        return learned

    def _agreement(self, touches: list[Touch]) -> Agreement | None:
        """Return whether the touches agree; None if none is usable."""
        try:
            if self.calibration:
                return self.calibration.agreement(touches)
            found = agreement(touches, scatter=self._scatter, ratio_of=self._plan.progress.ratio_of)
            return with_scatter(found, self._scatter_now())
        except ValueError:
            return None


def shown_modulus(modulus: Modulus) -> ShownModulus:
    """Return a modulus for the page."""
    return ShownModulus(
        modulus.value,
        modulus.low,
        modulus.high,
        str(modulus),
        modulus.reason,
        modulus.extrapolated,
    )


def shown_agreement(
    found: Agreement, text: str, modulus: ShownModulus | UnsetType | None = UNSET
) -> ShownAgreement:
    """Return an agreement for the page: the mean only if the touches agree."""
    trend = None
    if found.trend:
        trend = ShownTrend(found.trend.change, found.trend.probability)
    shown = ShownAgreement(
        agree=found.agree,
        ratio=None,
        standard_error=None,
        touches=found.touches,
        spread=found.spread,
        scatter=found.scatter,
        probability=found.probability,
        cause=found.cause,
        trend=trend,
        without_tilt=found.without_tilt,
        text=text,
        modulus=modulus,
    )
    if found.agree:
        shown.ratio = found.ratio
        shown.standard_error = found.standard_error
    return shown


def _simulation(measurement: Measurement, device: Json) -> SimulationFacts | None:
    """Return what is known of a simulation; None: it is none."""
    if not sidecar.is_simulated(device):
        return None
    truths = [SimulatedPress(one.start_s, one.ratio, one.name) for one in measurement.truths]
    specimens = []
    if measurement.hand:
        for name, modulus in measurement.hand.specimens.items():
            specimens.append(PressedSpecimen(name, modulus))
    return SimulationFacts(specimens, truths)


def _device_name(device: Json) -> str:
    """Return the name of a device, and its file."""
    named = device
    if isinstance(device.get("device"), dict):
        named = device["device"]
    return ", ".join(str(named[key]) for key in ("name", "file") if key in named)


def _stated(tracker: Tracker) -> list[str]:
    """Return what the user has stated of the probe: that it falls when pressed, and its baseline."""
    stated = []
    if tracker.settings.get("falling"):
        stated.append("falling")
    if has_given_baseline(tracker):
        hard, soft = given_levels(tracker)
        levels = "zero"
        if hard or soft:
            levels = f"{hard:g} and {soft:g} pF"
        stated.append(f"baseline given, {levels}")
    return stated
