"""A calibration on the page: used with its chip only, also where the board is exchanged."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from live_bench import Bench, Fed, noisy
from palpate import Calibration
from palpate.calibration.calibration_file import About
from palpate.calibration.provenance import UNKNOWN, Provenance
from palpate.errors import CalibrationRefused
from palpate.files import Json
from palpate.live.measurement import LiveMeasurement
from palpate.live.run_files import RunFiles
from palpate.live.source_watch import SourceWatch
from palpate.samples import Sample
from palpate.sources import Gap, GapCause
from recording_bench import soon

A = "66 cc 5c 90"
B = "61 12 5c 34"
OF_A = Provenance(probe="B2", operator="A. Bee", site="room 3", chips=(A,), simulated=False)


class Boards(Fed):
    """A board that another one may replace."""

    def __init__(self, chip: str, **device: Any) -> None:
        super().__init__(noisy)
        self.chip = chip
        self._device = device
        self._gap: Gap | None = None

    def replace(self, chip: str) -> None:
        """Put another board in its place."""
        self.chip = chip
        self._gap = Gap(GapCause.DISCONNECTED, "the board was unplugged for 1.0 s; another board")

    def samples(self) -> Iterator[Sample | Gap]:  # type: ignore[override]
        """Yield the pairs, and a gap where the board was replaced."""
        for sample in super().samples():
            if self._gap:
                yield self._gap
                self._gap = None
            yield sample

    def describe(self) -> Json:
        """Return the chip, too."""
        return {**super().describe(), "fingerprint": self.chip, **self._device}


def calibration(provenance: Provenance) -> Calibration:
    """Return a calibration with this provenance."""
    about = About(scene="handheld", provenance=provenance)
    return Calibration.fit([2.0, 3.0, 4.0, 5.0], [0.18, 0.46, 1.0, 2.5], about=about)


@pytest.fixture
def said() -> list[str]:
    return []


@pytest.fixture
def running(tmp_path: Path, said: list[str]) -> Callable[..., Any]:
    """Return a function that measures with a calibration, to run.csv."""

    @contextmanager
    def measure(
        boards: Boards, used: Calibration | None, accept: Sequence[str] = ()
    ) -> Iterator[Bench]:
        files = RunFiles(tmp_path / "run.csv")
        how = {"scene": "handheld"}
        measurement = LiveMeasurement(lambda **_: boards, files, how, said.append)
        bench = Bench(measurement, "test:", used, accept=accept)
        measurement.start()
        try:
            yield bench
        finally:
            measurement.close()

    return measure


def calibrated(bench: Bench) -> bool:
    """Return whether the page shows moduli."""
    return bool(bench.hello().calibrated)


def exchange(bench: Bench, boards: Boards, chip: str) -> None:
    """Put another board in the place of one that has sent samples."""
    soon(lambda: bench.measurement.last is not None)
    boards.replace(chip)


def watch_of(bench: Bench) -> SourceWatch:
    """Return the part that compares chips."""
    [watch] = [one for one in bench.measurement.listeners if isinstance(one, SourceWatch)]
    return watch


@pytest.mark.parametrize(
    ("chip", "provenance", "accepted"),
    [(B, OF_A, "other-chip"), (A, Provenance(simulated=True), "simulated")],
)
def test_a_measurement_with_another_calibration_does_not_begin(
    running: Callable[..., Any],
    tmp_path: Path,
    said: list[str],
    chip: str,
    provenance: Provenance,
    accepted: str,
) -> None:
    """Nothing is written; it begins if it is accepted, and says so."""
    used = calibration(provenance)
    text = rf"^--calibration: .*anyway with --accept {accepted}$"
    with pytest.raises(CalibrationRefused, match=text), running(Boards(chip), used):
        pass
    assert list(tmp_path.iterdir()) == []
    with running(Boards(chip), used, [accepted]) as bench:
        assert calibrated(bench)
        assert bench.measurement.files.accept == (accepted,)
    assert [text for text in said if text.endswith(f"; used anyway because of --accept {accepted}")]


def test_another_board_ends_the_use_of_a_calibration(
    running: Callable[..., Any], said: list[str]
) -> None:
    """Until the first one is back, in reports, too; the measurement goes on."""
    boards = Boards(A)
    probe = Path("probe.toml")
    with running(boards, calibration(OF_A)) as bench:
        files = bench.measurement.files
        files.calibration = probe
        assert calibrated(bench)
        exchange(bench, boards, B)
        shown = bench.waited("calibration")
        assert shown.line.title == "The calibration is not used."
        assert f"but the readings are from {B}, allowed: " in shown.line.text
        assert not calibrated(bench)
        assert watch_of(bench).refused
        assert files.calibration is None
        exchange(bench, boards, A)
        soon(lambda: calibrated(bench))
        assert not watch_of(bench).refused
        assert bench.shown().line.what != "calibration"
        assert files.calibration == probe
        assert watch_of(bench).chips == {A, B}
        assert bench.measurement.running
    assert [text[:27] for text in said if text.startswith("the calibration")] == [
        "the calibration is not used",
        "the calibration is used aga",
    ]


def test_a_new_calibration_takes_the_place_of_a_refused_one(running: Callable[..., Any]) -> None:
    boards = Boards(A)
    with running(boards, calibration(OF_A)) as bench:
        exchange(bench, boards, B)
        soon(lambda: not calibrated(bench))
        made: Any = bench.guided
        bench.obey("settings", probe="B3", site="room 4", operator="C. Dee")
        provenance = made._provenance()
        assert (provenance.probe, provenance.site) == ("B3", "room 4")
        assert (provenance.operator, provenance.chips) == ("C. Dee", (B, A))
        assert provenance.simulated is False
        [recorded] = provenance.files
        assert recorded.name == "run.csv"
        plan: Any = bench.plan
        plan.use_calibration(calibration(provenance))
        assert not watch_of(bench).refused
        exchange(bench, boards, B)
        soon(lambda: len(bench.annotations.document().gaps) == 2)
        assert calibrated(bench)


@pytest.mark.parametrize(
    ("provenance", "device", "expected"),
    [
        (OF_A, {"simulated": {}}, ["the readings are simulated, but the calibration was made with a probe"]),
        (Provenance(simulated=True), {"simulated": {}}, []),
        (UNKNOWN, {}, []),
    ],
)  # fmt: skip
def test_what_is_said_once(
    running: Callable[..., Any],
    said: list[str],
    provenance: Provenance,
    device: Json,
    expected: list[str],
) -> None:
    boards = Boards(A, **device)
    with running(boards, calibration(provenance)) as bench:
        exchange(bench, boards, A)
        soon(lambda: len(bench.annotations.document().gaps) == 1)
        assert calibrated(bench)
    remarks = [text.removeprefix("calibration: ") for text in said if "calibration: " in text]
    missing = [text for text in remarks if text.startswith("the calibration does not state: ")]
    assert len(missing) == (provenance.simulated is not True)
    assert [text for text in remarks if text not in missing] == expected


def test_without_a_calibration_nothing_is_compared(
    running: Callable[..., Any], said: list[str]
) -> None:
    boards = Boards(A)
    with running(boards, None) as bench:
        exchange(bench, boards, B)
        soon(lambda: watch_of(bench).chips == {A, B})
        assert not watch_of(bench).refused
    assert [text for text in said if "calibration" in text] == []
