"""Folders for check and calibrate; captured lines by options; a later soft channel for import and convert."""

from pathlib import Path

import numpy as np
import palpate
import pytest
from captured_files import FILES, cells, lines  # tests/tools
from command_lines import run
from foreign_files import RATIOS  # tests/tools
from palpate import Calibration


def test_a_folder_is_checked_and_calibrates(tmp_path: Path) -> None:
    folder = tmp_path / "specimens"
    objects = ("soft=0.2", "middle=1.0", "hard=4.0")
    options = [text for each in objects for text in ("--object", each)]
    assert run("simulate", "-o", folder, *options, "--touches", "2").exit_code == 0
    checked = run("check", folder)
    assert checked.exit_code == 0, checked.stderr
    assert checked.stdout.count(": complete, clean end: ") == len(objects)
    curves: list[list[float]] = []
    for files in ([folder], [folder / f"{name}.csv" for name in ("soft", "middle", "hard")]):
        output = tmp_path / f"probe{len(curves)}.toml"
        done = run("calibrate", *files, "--moduli", folder / "moduli.csv", "-o", output)
        assert done.exit_code in (0, 5), done.stderr
        curves.append(Calibration.load(output).ratios.tolist())
    assert len(curves[0]) == 2 * len(objects)
    assert sorted(curves[0]) == sorted(curves[1])
    empty = tmp_path / "empty"
    empty.mkdir()
    assert run("check", empty).exit_code == 4


@pytest.mark.parametrize(
    ("name", "options"),
    [
        ("columns behind a stamp", ["--columns", "soft,hard,-"]),
        ("a pattern", ["--pattern", "A(?P<hard>.*)pF B(?P<soft>.*)pF"]),
    ],
)
def test_captured_lines_by_options(tmp_path: Path, name: str, options: list[str]) -> None:
    path = tmp_path / "capture.txt"
    path.write_bytes(FILES[name].data)
    done = run("import", path, *options)
    assert done.exit_code == 0, done.stderr
    assert all(f"{ratio:.2f}" in done.stdout for ratio in RATIOS), done.stdout
    assert run("import", path, *options, "--map", "hard=1,soft=2").exit_code == 2


def test_a_soft_channel_that_is_read_later(tmp_path: Path) -> None:
    """As of `replay`: import shows other ratios, convert writes other times."""
    path = tmp_path / "table.csv"
    path.write_bytes(lines(cells(","), "t_s,C1_pF,C2_pF\n"))
    assert all(f"{ratio:.2f}" in run("import", path).stdout for ratio in RATIOS)
    later = run("import", path, "--soft-later-ms", "13")
    assert "1.989" in later.stdout or "1.99" in later.stdout, later.stdout
    assert run("convert", path, "-o", tmp_path / "own.csv", "--soft-later-ms", "13").exit_code == 0
    found = palpate.read(tmp_path / "own.csv")
    assert np.allclose(found.t_soft_s - found.t_hard_s, 0.013, atol=1e-6)
    again = run("convert", tmp_path / "own.csv", "-o", tmp_path / "b.csv", "--soft-later-ms", "13")
    assert again.exit_code == 2
    assert "soft_later_ms: got a recording of palpate" in again.stderr
    assert run("import", path, "--soft-later-ms", "nan").exit_code == 2


def test_a_unit_with_blanks_around_it_is_that_unit(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    path.write_text("t_s,A,B\n" + "".join(f"{n / 40},{6 + n},{4 + n}\n" for n in range(40)))
    found = palpate.read(path, columns={"hard": 2, "soft": 3}, unit=" fF ", time_unit=" s ")
    assert (found.unit, found.hard[0]) == ("pF", 0.006)


def test_a_masked_ratio_or_modulus_is_none() -> None:
    ratios = np.ma.masked_array([1.6, 2.8, 4.9, 8.3], [False, False, True, False])
    with pytest.raises(ValueError, match="ratios: got nan, allowed: positive numbers"):
        Calibration.fit(ratios, [0.1, 0.3, 0.9, 3.0])
    with pytest.raises(ValueError, match="moduli: got nan"):
        Calibration.fit([1.6, 2.8, 4.9, 8.3], np.ma.masked_equal([0.1, 0.3, 0.9, 3.0], 0.3))


def test_figures_of_the_paper_from_own_recordings(tmp_path: Path) -> None:
    folder = tmp_path / "specimens"
    objects = ("soft=0.2", "middle=1.0", "firm=2.5", "hard=8.0")
    options = [text for each in objects for text in ("--object", each)]
    assert run("simulate", "-o", folder, *options, "--touches", "3").exit_code == 0
    known = ("--moduli", folder / "moduli.csv")
    words = {"10": "mean and standard deviation of 4", "11": "mean: rises", "12": "eq. (2):"}
    for figure, text in words.items():
        path = tmp_path / f"figure-{figure}.png"
        done = run("plot", folder, *known, "--figure", figure, "-o", path)
        assert done.exit_code == 0, done.stderr
        assert path.read_bytes().startswith(b"\x89PNG")
        assert f"12 touches on 4 specimens; {text}" in done.stdout
    path = tmp_path / "other.png"
    few = [folder / "soft.csv", folder / "hard.csv"]
    for arguments, reason in (
        ([*few, *known, "--figure", "12"], "moduli: got 2 specimens, allowed: 3 or more"),
        ([*few], "FILE: got 2 recordings, allowed: one recording, or several with --figure"),
        ([few[0], *known], "got them without --figure"),
        ([*few, "--figure", "10"], "--moduli: missing"),
    ):
        done = run("plot", *arguments, "-o", path)
        assert done.exit_code in (2, 4)
        assert reason in done.stderr, done.stderr
        assert not path.exists()
