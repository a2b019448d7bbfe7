"""Guided calibration: what it says after each touch, and the file at the end."""

import re
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from threading import Lock
from types import SimpleNamespace
from typing import Any

import palpate
import pytest
from palpate import Calibration, Touch
from palpate.calibration.calibration_file import About
from palpate.calibration.grading import expected_uncertainty
from palpate.calibration.provenance import Provenance
from palpate.calibration.specimen_fit import SpecimenTouches, fit_specimens
from palpate.elasticity import SORBOTHANE_MPA
from palpate.live.calibration_fit import GuidedCalibration
from palpate.live.plan import KnownSpecimen, TouchKept
from palpate.live.protocol import (
    CalibrationMessage,
    CalibrationPoint,
    RefusedCommand,
    RigidRatio,
)
from palpate.live.run_files import RunFiles
from palpate.simulation.hand import session
from palpate.simulation.scenarios import PROBE
from palpate.sources.simulated_hand import SimulatedHand
from recording_bench import soon

MODULI = dict(sorted(SORBOTHANE_MPA.items(), key=lambda item: item[1])[::2])
WANTED = 2
BEGUN_AT = datetime(2026, 11, 29, 8, tzinfo=UTC)


@pytest.fixture(scope="module")
def touches() -> dict[str, list[Touch]]:
    runs = session(0, touches=WANTED)
    return {name: palpate.touches(runs[name]) for name in MODULI}


class Bench:
    """A plan that is touched in order, and a folder."""

    def __init__(self, folder: Path, touches: dict[str, list[Touch]]) -> None:
        self.order = [(name, touch) for name in MODULI for touch in touches[name]]
        self.done, self.left_out = 0, set[int]()
        self.used: list[Calibration] = []
        self.files = RunFiles(folder=folder)
        self.progress = SimpleNamespace(next="40 OO", calibration=None)
        self.document = SimpleNamespace(title="bench 2", operator="A. Bee")
        self.newest_recorder = None
        self.hand: SimulatedHand | None = None
        self.settings = dict[str, Any]()
        self.commands = Lock()
        self.on_changed: list[Callable[[], None]] = []
        self.operator = "A. Bee"
        self.said: list[str] = []
        self.notify = self.said.append
        watch: Any = SimpleNamespace(chips={"66 cc 5c 90"}, simulated=True, begun_at=BEGUN_AT)
        own: Any = self
        self.part = GuidedCalibration(own, own, watch)
        self.uncertainty = 0.0

    def note(self, text: str) -> None:
        """Take a note in the recording."""

    def use_calibration(self, found: Calibration) -> None:
        """Use a calibration for all touches."""
        self.progress.calibration = found
        self.changed()

    def changed(self) -> None:
        """Let the parts know that the plan has changed."""
        for notify in self.on_changed:
            notify()

    def use(self, settings: dict[str, Any], note: str) -> None:
        """Go on with the calibration of the plan."""
        self.used.append(self.progress.calibration)

    @property
    def rows(self) -> list[TouchKept]:
        """What is known of each touch."""
        rows = []
        for number in range(1, self.done + 1):
            why = "it slipped" if number in self.left_out else ""
            rows.append(TouchKept("", not why, why))
        return rows

    def known(self) -> list[KnownSpecimen]:
        numbered = [
            (name, (n, t, n not in self.left_out))
            for n, (name, t) in enumerate(self.order[: self.done], 1)
        ]
        return [
            KnownSpecimen(
                name,
                modulus,
                tuple(row for of, row in numbered if of == name),
                modulus_uncertainty=self.uncertainty,
            )
            for name, modulus in MODULI.items()
        ]

    def touch(self, count: int = 1) -> CalibrationMessage:
        """Return the message when it holds these touches, too."""
        self.done += count
        return self.settled()

    def settled(self) -> CalibrationMessage:
        """Return the message after a change."""
        self.changed()
        self.part._worker.submit(lambda: None).result()
        found = self.part.document()
        assert found.touches == self.done - len(self.left_out)
        return found


def points(message: CalibrationMessage) -> list[CalibrationPoint]:
    assert isinstance(message.points, list)
    return message.points


def numbers(message: CalibrationMessage) -> list[int]:
    return [point.touch for point in points(message)]


def test_a_guided_calibration(tmp_path: Path, touches: dict[str, list[Touch]]) -> None:
    bench = Bench(tmp_path, touches)
    assert bench.part.document() == CalibrationMessage(on=False)
    assert (
        bench.part.calibrating(on=True)
        == f"Calibrating with {len(MODULI)} specimens of known modulus."
    )
    first = bench.touch()
    assert (first.verdict, first.next) == ("3 specimens at least; 2 to go.", "Next: 40 OO.")
    assert first.curve is None
    assert numbers(first) == [1]
    grown = [bench.touch() for _ in bench.order[1:]]
    last = grown[-1]
    assert (last.next, last.touches, bench.used) == ("Next: 40 OO.", len(bench.order), [])
    expected = fit_specimens(
        [SpecimenTouches(name, MODULI[name], touches[name]) for name in MODULI],
        about=About(scene="handheld"),
    )
    assert last.details == expected.verdict
    assert last.verdict == f"Good: {expected_uncertainty(expected)}."
    assert (last.grade, last.look, last.doubts) == ("good", [], [])
    assert isinstance(last.rigid, RigidRatio)
    assert last.rigid.value == expected.probe.rigid_ratio
    for name, (low, high) in expected.parameter_intervals().items():
        if high > low:
            assert low < getattr(PROBE, name) < high
    assert {point.fitted for point in points(last)} == {
        expected.probe.ratio(E) for E in MODULI.values()
    }

    bench.progress.next = None  # nothing is lacking: it is saved without an order, once
    for _ in range(5):  # not because it is looked at
        assert bench.part.document().saved is None
    assert list(tmp_path.iterdir()) == []
    saved = bench.settled()
    assert (saved.saved, saved.next) == ("Saved as probe.toml; it is used from now on.", "")
    [used] = bench.used
    assert bench.files.calibration == tmp_path / "probe.toml"
    assert used.as_dict() == Calibration.load(tmp_path / "probe.toml").as_dict()
    assert {**used.as_dict(), "provenance": {}} == expected.as_dict()
    made = used.about.provenance
    stated = Provenance(
        made.date, BEGUN_AT, operator="A. Bee", chips=("66 cc 5c 90",), simulated=True
    )
    assert made == stated
    assert [file.name for file in bench.files.named] == ["probe.toml", "probe-calibration.html"]
    assert expected.verdict in (tmp_path / "probe-calibration.html").read_text()
    assert bench.part.document().saved == saved.saved
    assert bench.part.calibrating(on=False).startswith("Calibrating has ended")


def test_the_uncertainty_of_the_moduli_is_in_the_calibration(
    tmp_path: Path, touches: dict[str, list[Touch]]
) -> None:
    bench = Bench(tmp_path, touches)
    bench.uncertainty = 0.05
    bench.part.calibrating(on=True)
    bench.touch(len(bench.order))
    bench.part.save_calibration()
    found = Calibration.load(tmp_path / "probe.toml")
    assert set(found.modulus_uncertainties.tolist()) == {0.05}
    assert "u(E), %" in (tmp_path / "probe-calibration.html").read_text()


def test_the_report_has_a_head_and_the_touches_that_are_left_out(
    tmp_path: Path, touches: dict[str, list[Touch]]
) -> None:
    bench = Bench(tmp_path, touches)
    bench.part.calibrating(on=True)
    bench.touch(len(bench.order))
    bench.left_out = {3}
    bench.part.save_calibration()
    page = (tmp_path / "probe-calibration.html").read_text(encoding="utf-8")
    assert "<h1>Calibration of a probe: bench 2</h1>" in page
    for fact in ("A. Bee", "not recorded"):
        assert f"<dd>{fact}</dd>" in page
    assert re.search(r"<dt>Date</dt><dd>20\d\d-\d\d-\d\d ", page)
    left_out = page.partition("Touches that are left out")[2]
    assert "it slipped" in left_out
    assert left_out.count("<tr>") == 2  # the header, and one touch


def test_a_report_that_fails_does_not_say_that_nothing_is_saved(
    tmp_path: Path, touches: dict[str, list[Touch]], monkeypatch: pytest.MonkeyPatch
) -> None:
    def report() -> None:
        raise RefusedCommand("report: cannot be written: No space left on device")

    bench = Bench(tmp_path, touches)
    monkeypatch.setattr(bench.files, "report", report)
    bench.files.made(tmp_path / "run.csv", "recording")
    bench.part.calibrating(on=True)
    bench.touch(len(bench.order))
    bench.progress.next = None
    said = (
        "Saved as probe.toml; moduli are from it now. There is no report: report: cannot be written: "
        "No space left on device."
    )
    bench.changed()
    soon(lambda: bench.part.document().verdict == said)
    assert bench.part.document().saved == "Saved as probe.toml; it is used from now on."
    assert bench.said == ["run.csv: no checksum: No such file or directory"]


def test_a_touch_that_is_left_out_is_shown_and_not_used(
    tmp_path: Path, touches: dict[str, list[Touch]]
) -> None:
    bench = Bench(tmp_path, touches)
    bench.part.calibrating(on=True)
    whole = bench.touch(len(bench.order))
    bench.left_out = {3}
    less = bench.settled()
    assert [point.touch for point in points(less) if not point.kept] == [3]
    assert less.rigid != whole.rigid
    bench.left_out = set()
    assert bench.settled() == whole


def test_what_is_not_possible_is_said(
    tmp_path: Path, touches: dict[str, list[Touch]], monkeypatch: pytest.MonkeyPatch
) -> None:
    bench = Bench(tmp_path, touches)
    monkeypatch.setattr(bench, "known", list)
    with pytest.raises(
        RefusedCommand, match="needs 3 specimens at least, of different known moduli; 3 to go"
    ):
        bench.part.calibrating(on=True)
    monkeypatch.undo()
    with pytest.raises(RefusedCommand, match="3 specimens at least; 3 to go"):
        bench.part.save_calibration()
    bench.done = len(bench.order)
    reverse = Bench(tmp_path, dict(zip(MODULI, reversed(touches.values()), strict=True)))
    reverse.part.calibrating(on=True)
    # ratios that do not rise are an objection, not a failure
    found = reverse.touch(len(reverse.order))
    assert found.grade == "look"
    assert not found.sound
    (tmp_path / "probe.toml").write_text("precious")
    assert bench.part.save_calibration().file == "probe-2.toml"
    assert (tmp_path / "probe.toml").read_text() == "precious"


def test_specimens_that_were_exchanged_are_named_and_nothing_is_saved(
    tmp_path: Path, touches: dict[str, list[Touch]]
) -> None:
    names = list(MODULI)
    exchanged = {**touches, names[1]: touches[names[3]], names[3]: touches[names[1]]}
    bench = Bench(tmp_path, exchanged)
    bench.part.calibrating(on=True)
    bench.touch(len(bench.order))
    bench.progress.next = None
    found = bench.settled()
    assert found.grade == "look"
    assert found.verdict == (
        f"Look at touches 3, 4, 7 and 8: {names[1]} and {names[3]} seem to be exchanged."
    )
    assert found.look == [3, 4, 7, 8]
    assert isinstance(found.doubts, list)
    assert found.doubts[0] == (
        f"{names[1]} and {names[3]} seem to be exchanged (touches 3, 4, 7 and 8)."
    )
    assert (found.saved, bench.used, list(tmp_path.iterdir())) == (None, [], [])


def test_the_demo_keeps_its_calibration_in_memory(
    tmp_path: Path, touches: dict[str, list[Touch]]
) -> None:
    bench = Bench(tmp_path, touches)
    bench.hand = SimulatedHand([], MODULI)
    bench.part.calibrating(on=True)
    bench.touch(len(bench.order))
    bench.progress.next = None
    found = bench.settled()
    assert found.saved == "Kept in memory: the demo writes no file. It is used from now on."
    assert (len(bench.used), bench.files.calibration) == (1, None)
    assert (bench.files.named, list(tmp_path.iterdir())) == ([], [])
