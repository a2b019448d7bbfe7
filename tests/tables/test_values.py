"""What a table has in place of capacitances: dropouts, other units, scales."""

from pathlib import Path

import numpy as np
import pytest
from foreign_files import RATIOS, measurement  # tests/tools
from palpate import read, touches


def table(folder: Path, header: str, *channels: np.ndarray) -> Path:
    path = folder / "table.csv"
    cells = np.column_stack([measurement()[0], *channels])
    path.write_text(header + "\n" + "".join(",".join(f"{cell:.4f}" for cell in row) + "\n" for row in cells))
    return path


@pytest.mark.parametrize("mark", [0.0, -999.0, 9999.99, 16.0, -1.0])
@pytest.mark.parametrize("header", ["t (s),C1 (pF),C2 (pF)", "t (s),C1,C2"])
def test_a_value_far_from_all_others_is_none(tmp_path: Path, header: str, mark: float) -> None:
    _, hard, soft = measurement()
    lost = np.arange(len(hard)) % 90 < 4
    recording = read(table(tmp_path, header, np.where(lost, mark, hard), soft))
    assert [touch.ratio for touch in touches(recording)] == pytest.approx(RATIOS, rel=5e-3)
    assert np.isnan(recording.hard).tolist() == lost.tolist()
    [note] = [note for note in recording.notes if "exactly" in note]
    assert note.startswith(f"hard: {lost.sum()} readings are exactly {mark:g}, far from all others (6.8")


def test_two_such_values(tmp_path: Path) -> None:
    _, hard, soft = measurement()
    hard[100:103], hard[500:510] = -999, 0
    notes = read(table(tmp_path, "t (s),C1 (pF),C2 (pF)", hard, soft)).notes
    assert [note.split(",")[0] for note in notes if "exactly" in note] == [
        "hard: 3 readings are exactly -999",
        "hard: 10 readings are exactly 0",
    ]


def test_a_channel_that_rests_at_0_keeps_it(tmp_path: Path) -> None:
    _, hard, soft = measurement()
    hard, soft = (np.maximum(np.round(each - each[0], 2), 0) for each in (hard, soft))
    recording = read(table(tmp_path, "t (s),C1 (pF),C2 (pF)", hard, soft))
    assert not np.isnan(recording.hard).any()


OTHER = ["V", "kOhm", "Ω", "kHz", "N", "°C", "dC/C0", "%"]


@pytest.mark.parametrize(
    "name", [*(f"hard ({unit})" for unit in OTHER), "hard [mV]", "hard_norm", "hard dC/C0", "hard %"]
)
def test_other_quantities_are_refused(tmp_path: Path, name: str) -> None:
    path = table(tmp_path, f"t (s),{name},soft", *measurement()[1:])
    with pytest.raises(ValueError, match="ratio of changes of capacitance is wanted") as error:
        read(path, columns={"hard": 2, "soft": 3})
    assert "--unit" not in str(error.value)
    [note] = read(path, columns={"hard": 2, "soft": 3}, unit="pF").notes
    assert "pF is used, as asked" in note


@pytest.mark.parametrize("unit", ["0.1 pF", "pF x10", "10^-12 F"])
def test_a_scale_is_refused(tmp_path: Path, unit: str) -> None:
    path = table(tmp_path, f"t (s),C1 ({unit}),C2 (pF)", *measurement()[1:])
    with pytest.raises(ValueError, match="with a scale"):
        read(path, columns={"hard": 2, "soft": 3})


def test_counts_are_possible(tmp_path: Path) -> None:
    path = table(tmp_path, "t (s),hard (counts),soft (counts)", *measurement()[1:])
    with pytest.raises(ValueError, match="--unit aF"):
        read(path, columns={"hard": 2, "soft": 3})


@pytest.mark.parametrize("header", ["t (s),sensor C,sensor N", "t (s),Ch_V,Ch_A", "t (s),A (hard),B (1)"])
def test_names_are_no_units(tmp_path: Path, header: str) -> None:
    assert read(table(tmp_path, header, *measurement()[1:]), columns={"hard": 2, "soft": 3}).notes == (
        "no unit in the header: pF assumed",
    )


def test_a_unit_that_contradicts_the_header_is_told(tmp_path: Path) -> None:
    path = table(tmp_path, "t (s),C1 (fF),C2 (pF)", *measurement()[1:])
    assert read(path, unit="pF").notes == ("the header of C1 says fF: pF is used, as asked",)
