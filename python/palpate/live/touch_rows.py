"""The table of touches on the page, and the values of `hello` and `state` beside it: plain values, ready for JSON."""

import math
from collections.abc import Sequence
from itertools import count

from palpate import number_format
from palpate._core import Tracker
from palpate.ad7746.registers import linearity_pF
from palpate.calibration import Calibration, Modulus
from palpate.calibration.learning import LearnedCalibration, learned_from
from palpate.calibration.ranges import wider
from palpate.flags import advice
from palpate.live.feed import Document
from palpate.live.measurement import PRESSED, AnyMeasurement
from palpate.live.plan import TouchPlan
from palpate.recording import sidecar
from palpate.repeatability import Agreement, agreement, most_reliable, session_scatter, with_scatter
from palpate.touch import Touch
from palpate.tracking import given_levels, has_given_baseline
from palpate.uncertainty import TOUCH_SCATTER, Scatter, Uncertainty


class TouchTable:
    """The touches of a measurement, with what the plan knows of them, and moduli if there is a calibration.

    `scatter`: relative scatter from touch to touch without a calibration, for whether touches agree, and for the uncertainty.
    """

    def __init__(
        self, measurement: AnyMeasurement, plan: TouchPlan, scatter: float = TOUCH_SCATTER
    ) -> None:
        self._measurement, self._plan, self._scatter = measurement, plan, scatter
        # by touch: what it is made of, and the row
        self._rows: dict[int, tuple[tuple[object, ...], Document]] = {}
        self._shown: tuple[tuple[object, ...], Document] | None = None
        self._assumed = None if plan.progress.calibration else scatter
        self._learned: LearnedCalibration | None = None

    @property
    def calibration(self) -> Calibration | None:
        """The calibration of the plan; a new one holds for all touches."""
        return self._plan.progress.calibration

    def hello(self, source: str) -> Document:
        """Return the values that do not change during a measurement."""
        measurement, tracker = self._measurement, self._measurement.tracker
        device = measurement.device()
        simulation = {
            "demo": measurement.demo,
            "truths": [truth._asdict() for truth in measurement.truths],
        }
        named = device["device"] if isinstance(device.get("device"), dict) else device
        return {
            "measurement": measurement.number,
            "kind": "file" if measurement.file else "live",
            "file": measurement.file,
            "origin_s": measurement.levels.span and measurement.levels.span[0],
            "seconds": tracker.settings.get("seconds"),
            "source": source,
            "simulation": simulation if sidecar.is_simulated(device) else None,
            "device": ", ".join(str(named[key]) for key in ("name", "file") if key in named),
            "scene": tracker.scene,
            "stated": _stated(tracker),
            "threshold": tracker.threshold if tracker.threshold < math.inf else None,
            "calibrated": self.calibration is not None,
            "scatter": self.calibration.touch_spread if self.calibration else None,
            "assumed": self._assumed,
        }

    def now(self) -> Document:
        """Return the values that change during a measurement."""
        measurement = self._measurement
        moment = measurement.moment
        measured = moment.state in PRESSED
        ratio, error = (moment.ratio, moment.standard_error) if measured else (math.nan, math.nan)
        known, modulus = Uncertainty.of_ratio(ratio, error, self._scatter_now()), None
        # a level ratio: at the end only
        if self.calibration and self.calibration.ratio == "hold" and math.isfinite(ratio):
            noise = known.noise if math.isfinite(known.noise) else None
            modulus = self.calibration.modulus(ratio, noise).as_dict()
        return {
            "state": measurement.state,
            "end_s": measurement.levels.span and measurement.levels.span[1],
            "ratio": ratio,
            "standard_error": error,
            **known.as_dict(),
            "modulus": modulus,
        }

    def result(self, touch: Touch) -> str:
        """Return the ratio of a touch with its uncertainty, and its modulus if there is a calibration."""
        modulus = f", modulus {self._modulus_of(touch)}" if self.calibration else ""
        return f"ratio {self.known(touch)}{modulus}"

    def _modulus_of(self, touch: Touch) -> Modulus:
        """Return the modulus of a touch, with what the touches so far show of the contact exponent."""
        found = self._learned.calibration if self._learned else self.calibration
        assert found is not None
        return found.modulus_of(touch)

    def _learn(self, touches: Sequence[Touch], known: Sequence[Document]) -> None:
        """Learn the contact exponent from the kept touches; the same range as before: nothing changes."""
        if self.calibration is None:
            self._learned = None
            return
        objects: dict[str, list[Touch]] = {}
        for touch, row in zip(touches, known, strict=False):
            if row["kept"]:
                objects.setdefault(row["specimen"] or "", []).append(touch)
        learned = learned_from(self.calibration, objects)
        if self._learned is None or learned.sentence != self._learned.sentence:
            self._learned = learned

    def known(self, touch: Touch) -> Uncertainty:
        """Return the uncertainty of a touch, with the scatter that holds now."""
        return self._of(touch, self._scatter_now())

    def document(self) -> Document:
        """Return a row for each completed touch; whether they agree; the number of the most reliable one if they do.

        A row stays the same object until it changes. What one more touch changes in all rows is beside them: `scatter`,
        for the uncertainties, and `means` of the specimens, for the distances from them.
        """
        made_of = touches, known, _ = self._measurement.touches, self._plan.rows, self.calibration
        if self._shown is None or any(
            one is not other for one, other in zip(self._shown[0], made_of, strict=True)
        ):
            # the plan may lack the newest one yet
            self._shown = (made_of, self._document(touches[: len(known)], known))
        return self._shown[1]

    def _document(self, touches: list[Touch], known: Sequence[Document]) -> Document:
        self._learn(touches, known)
        each = zip(touches, known, strict=False)  # on the last specimen
        alike = [
            one
            for one, row in each
            if row["kept"] and row["specimen"] == known[len(touches) - 1]["specimen"]
        ]
        found, best, together = self._agreement(alike), None, None
        if found and found.agree:
            accepted, ratio_of = (
                self.calibration.accepted if self.calibration else (),
                self._plan.progress.ratio_of,
            )
            best = (
                touches.index(
                    most_reliable(alike, scatter=None, accept=accepted, ratio_of=ratio_of)
                )
                + 1
            )
        if found and found.touches > 1:
            modulus = None
            text = str(found)
            if self._learned and found.agree:
                modulus = self._learned.calibration.mean_modulus(alike).as_dict()
                if self._learned.sentence:
                    text = f"{text}. {self._learned.sentence}"
            together = {**found.as_dict(), "modulus": modulus, "text": text}
        rows = [self._row(*one) for one in zip(count(1), touches, known)]
        now, means = self._scatter_now(), self._plan.progress.means
        return {
            "rows": rows,
            "scatter": {"share": now.share, "source": now.source},
            "means": means,
            "most_reliable": best,
            "together": together,
        }

    def _row(self, number: int, touch: Touch, known: Document) -> Document:
        of = self._measurement.number, touch.revised, self._learned, known
        if number not in self._rows or self._rows[number][0] != of:
            modulus = self._modulus_of(touch).as_dict() if self.calibration else None
            remarks = list(map(str, advice(touch)))
            if self.calibration:
                remarks += map(wider, self.calibration.differences(touch))
            ratio, error = self._plan.progress.ratio_of(touch)
            used = number_format.plain({"ratio": ratio, "standard_error": error})
            more = {
                "end_s": self._measurement.ends.get(number),
                "modulus": modulus,
                "advice": remarks,
            }
            own_error = self._of(touch, Scatter(0.0)).uncertainty
            row = {
                "number": number,
                **touch.as_dict(),
                **used,
                **more,
                "own_error": own_error,
                **known,
            }
            self._rows[number] = of, row
        return self._rows[number][1]

    def _of(self, touch: Touch, scatter: Scatter) -> Uncertainty:
        linearity = linearity_pF(self._measurement.tracker.settings["full_scale"])
        return Uncertainty.of(touch, scatter, linearity, self._plan.progress.ratio_of)

    def _scatter_now(self) -> Scatter:
        """Return the scatter of the calibration, else of the touches that are kept, else the assumed one."""
        if self.calibration:
            return self.calibration.touch_scatter
        pairs = zip(self._plan.rows, self._measurement.touches, strict=False)
        kept = ((row["specimen"], touch) for row, touch in pairs if row["kept"])
        found = session_scatter(kept, self._plan.progress.ratio_of)
        assumed = found.source == "assumed" or self._measurement.demo  # as its text says
        return Scatter(self._scatter) if assumed else found

    def _agreement(self, touches: list[Touch]) -> Agreement | None:
        """Return whether the touches agree; None if none is usable."""
        try:
            if self.calibration:
                return self.calibration.agreement(touches)
            found = agreement(touches, scatter=self._scatter, ratio_of=self._plan.progress.ratio_of)
            return with_scatter(found, self._scatter_now())
        except ValueError:
            return None


def _stated(tracker: Tracker) -> list[str]:
    """Return what the user has stated of the probe: that it falls when pressed, and its baseline."""
    stated = ["falling"] if tracker.settings.get("falling") else []
    if has_given_baseline(tracker):
        hard, soft = given_levels(tracker)
        levels = f"{hard:g} and {soft:g} pF" if hard or soft else "zero"
        stated.append(f"baseline given, {levels}")
    return stated
