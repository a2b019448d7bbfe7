"""On the page: a specimen of known modulus that is touched while a calibration is used."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import palpate
import pytest
from palpate import Calibration, Touch
from palpate.calibration.assurance import today
from palpate.calibration.calibration_file import About
from palpate.calibration.provenance import Provenance
from palpate.elasticity import SORBOTHANE_MPA, Elasticity
from palpate.live.plan import TouchPlan
from palpate.live.protocol import RefusedCommand, VerificationMessage
from palpate.live.run_files import RunFiles
from palpate.live.specimen_check import SpecimenCheck
from palpate.recording.sidecar import Sidecar
from project import FOUR

GEL_MPA = 1.1
NOTHING = VerificationMessage("", agrees=True, kept=False)


@pytest.fixture(scope="module")
def touch() -> Touch:
    return palpate.touches(palpate.read(FOUR))[1]


def unknown_source() -> Any:
    """Return what the check reads of a `SourceWatch`."""
    return SimpleNamespace(simulated=None)


class Bench:
    """A plan of one gel of known modulus, and an object without one; the touches come by order."""

    def __init__(self, folder: Path, touch: Touch, calibration: Calibration | None) -> None:
        self.last_s = 0.0
        self.sidecar = Sidecar()
        self.listeners: list[Any] = []
        self.recording_begun: list[Any] = []
        self.file = None
        self.touches_wanted = 4
        self.recorder = None
        self.ended_recording = None
        self.require_amendable = lambda: None
        self.newest_recorder = None
        self.files = RunFiles(folder=folder)
        self._touch = touch
        self._touches = 0
        own: Any = self
        self.plan = TouchPlan(own, calibration)
        self.plan.plan(text=f"gel; {GEL_MPA}; 1 %\nunknown", wanted=2)
        self.watch = unknown_source()
        self.check = SpecimenCheck(own, self.plan, self.watch)
        if calibration:
            self.files.calibration = folder / "probe.toml"
            calibration.save(self.files.calibration)

    def touch(self, ratio: float) -> None:
        """Complete a touch with this ratio."""
        self._touches += 1
        start_s = self.last_s + 2
        self.last_s += 10
        level_ratio = self._touch.level_ratio * ratio / self._touch.ratio
        touch = replace(self._touch, start_s=start_s, ratio=ratio, level_ratio=level_ratio)
        self.plan.touch(self._touches, touch)

    def touch_gel(self, gain: float = 1.0) -> None:
        """Complete both touches on the gel."""
        for scatter in (0.998, 1.002):
            self.touch(gain * scatter * Elasticity().ratio(GEL_MPA))


@pytest.fixture
def calibration() -> Calibration:
    """Ten specimens by two touches, which scatter by .3 %."""
    moduli = [modulus for modulus in SORBOTHANE_MPA.values() for _ in range(2)]
    scatter = [0.998, 1.002] * len(SORBOTHANE_MPA)
    true = Elasticity()
    ratios = [true.ratio(one) * factor for one, factor in zip(moduli, scatter, strict=True)]
    return Calibration.fit(ratios, moduli)


@pytest.mark.parametrize(("gain", "agrees"), [(1.0, True), (1.05, False)])
def test_a_known_specimen_is_compared_when_its_touches_are_done(
    tmp_path: Path, touch: Touch, calibration: Calibration, gain: float, agrees: bool
) -> None:
    bench = Bench(tmp_path, touch, calibration)
    assert bench.check.document() == NOTHING
    bench.touch(gain * Elasticity().ratio(GEL_MPA))
    assert bench.check.document() == NOTHING
    bench.touch(gain * Elasticity().ratio(GEL_MPA))
    shown = bench.check.document()
    assert shown.text.startswith("gel (1.10 MPa) measures 1.")
    assert (shown.agrees, shown.kept) == (agrees, False)
    assert f" on {today()}" in shown.text
    message = bench.check.verify()
    assert message == f"probe.toml has the result: {shown.text}"
    assert bench.check.document().kept
    [stored] = Calibration.load(tmp_path / "probe.toml").verifications
    assert (stored.specimen, stored.agrees, stored.touches) == ("gel", agrees, 2)
    assert stored.known_uncertainty == 0.01
    assert bench.plan.document.notes[-1].text == f"verification: {shown.text[:-1]}"
    with pytest.raises(RefusedCommand, match=r"probe\.toml has this result already"):
        bench.check.verify()


def test_another_object_is_not_compared(
    tmp_path: Path, touch: Touch, calibration: Calibration
) -> None:
    bench = Bench(tmp_path, touch, calibration)
    bench.touch_gel()
    bench.touch(4.0)
    bench.touch(4.0)
    assert bench.check.document() == NOTHING
    with pytest.raises(RefusedCommand, match="there is no result yet"):
        bench.check.verify()


def test_nothing_is_compared_without_a_calibration(tmp_path: Path, touch: Touch) -> None:
    bench = Bench(tmp_path, touch, None)
    bench.touch_gel()
    assert bench.check.document() == NOTHING


def test_specimens_that_calibrated_in_this_run_are_no_test(
    tmp_path: Path, touch: Touch, calibration: Calibration
) -> None:
    bench = Bench(tmp_path, touch, None)
    bench.touch_gel()
    bench.plan.use_calibration(calibration)
    bench.files.calibration = tmp_path / "probe.toml"
    assert bench.check.document() == NOTHING
    bench.touch_gel()
    assert bench.check.document() == NOTHING


def test_simulated_touches_are_no_evidence_on_a_probe(
    tmp_path: Path, touch: Touch, calibration: Calibration
) -> None:
    about = About(provenance=Provenance(simulated=False))
    bench = Bench(tmp_path, touch, replace(calibration, about=about))
    bench.touch_gel()
    bench.watch.simulated = True
    before = (tmp_path / "probe.toml").read_bytes()
    with pytest.raises(RefusedCommand, match="verify: the touches are simulated"):
        bench.check.verify()
    assert (tmp_path / "probe.toml").read_bytes() == before


def test_a_calibration_that_is_not_used_for_a_while_is_compared_again(
    tmp_path: Path, touch: Touch, calibration: Calibration
) -> None:
    """Another board is connected, and then its board again."""
    bench = Bench(tmp_path, touch, calibration)
    bench.touch_gel()
    shown = bench.check.document()
    bench.plan.use_calibration(None)
    assert bench.check.document() == NOTHING
    bench.plan.use_calibration(calibration)
    assert bench.check.document() == shown


def test_a_file_that_cannot_be_written_is_named(
    tmp_path: Path, touch: Touch, calibration: Calibration, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench = Bench(tmp_path, touch, calibration)
    bench.touch_gel()

    def full(path: Path, data: bytes) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("palpate.calibration.calibration_file.write_file", full)
    with pytest.raises(RefusedCommand, match=r"probe\.toml: No space left on device"):
        bench.check.verify()
    assert not bench.check.document().kept
