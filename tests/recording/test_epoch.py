"""Recordings of several boards on one time axis: the signal itself says when it was measured."""

from pathlib import Path

import numpy as np
import palpate
import pytest
from numpy.typing import NDArray
from palpate.ad7746.bus import RealClock
from palpate.ad7746.simulator.chip import SimulatedChip
from palpate.ad7746.simulator.evalboard import SimulatedBoard
from palpate.ad7746.simulator.usb_backend import SimulatedUsb
from palpate.clocks import epoch_at, fine_ns, on_monotonic
from palpate.recording import sidecar
from project import FOUR

SLOPE_PF_PER_S = 0.2  # 5 ms are 1 fF, 25 times the noise
BEGIN_PF, DAC_STEP_PF = 5.0, 0.17


def board(zero_s: float) -> palpate.Source:
    """Return a board; at both inputs the capacitance rises with the time of the computer."""
    clock, backend = RealClock(), SimulatedUsb(RealClock())
    chip = SimulatedChip(
        lambda _, begin_s, end_s: BEGIN_PF + SLOPE_PF_PER_S * ((begin_s + end_s) / 2 - zero_s),
        dac_step_pF=(DAC_STEP_PF, 0.16),
    )
    backend.plug(SimulatedBoard(chip, clock))
    return palpate.open("usb:", backend=backend, clock=clock)


def recorded(path: Path, zero_s: float) -> palpate.Recording:
    with palpate.Stream(board(zero_s), record=path) as stream:
        for estimate in stream:
            if estimate.sample.seq == 20:
                break
    return palpate.read(path)


def told_utc_ns(recording: palpate.Recording, path: Path, zero_s: float) -> NDArray[np.float64]:
    """Return when each reading was taken, by its own value: the sum with the CAPDAC rises steadily."""
    document = sidecar.load(path) or {}
    whole_pF = recording.hard + DAC_STEP_PF * document["device"]["configuration"]["hard"]["capdac"]
    return np.asarray(
        epoch_at(on_monotonic(0)).utc_ns + 1e9 * ((whole_pF - BEGIN_PF) / SLOPE_PF_PER_S + zero_s)
    )


def test_two_recordings_merge_within_5_ms(tmp_path: Path) -> None:
    zero_s = fine_ns() / 1e9
    paths = [tmp_path / "first.csv", tmp_path / "second.csv"]
    recordings = [recorded(path, zero_s) for path in paths]
    for path, recording in zip(paths, recordings, strict=True):
        known = np.isfinite(recording.hard)  # a computer that stops may have lost some
        assert known.any()
        assert (
            np.abs(recording.utc_ns - told_utc_ns(recording, path, zero_s))[known].max() < 5_000_000
        )
    assert (np.diff(np.concatenate([recording.utc_ns for recording in recordings])) > 0).all()


def test_a_wall_clock_that_was_moved_is_said(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    recorded(path, fine_ns() / 1e9)
    document = sidecar.load(path) or {}
    document["clock"]["zero_utc_ns_at_end"] += 3_600_000_000_000
    sidecar.save(path.with_suffix(".json"), document)
    [note] = [note for note in palpate.read(path).notes if "wall clock" in note]
    assert note.startswith("the wall clock was moved by +3600.00")


@pytest.mark.parametrize("source", ["sim:stiff-steady?seed=1", "sim:stiff-steady?speed=20", "file"])
def test_utc_is_not_invented(tmp_path: Path, source: str) -> None:
    """Of times that do not pass with the clock: of a virtual one, of a faster simulation, of a file that is played."""
    path = tmp_path / "run.csv"
    played = palpate.open(str(FOUR), speed=20) if source == "file" else source
    with palpate.Stream(played, record=path) as stream:
        next(iter(stream))
    with pytest.raises(ValueError, match="utc_ns: got a recording without the wall clock"):
        _ = palpate.read(path).utc_ns
