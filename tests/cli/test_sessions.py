"""Recordings whose sidecar says what was touched: `replay` shows it, `calibrate` needs no table and no file names."""

import re
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import palpate
import pytest
from command_lines import document, run
from palpate.calibration.specimen_files import read_moduli
from palpate.recording import sidecar
from palpate.recording.session import Entry, Plan, Specimen
from project import FOUR

MODULI = {"30 OO": 0.143, "70 OO": 0.52, "40 A": 1.56, "70 A": 8.68}
WHOLE = Plan(specimens=tuple(Specimen(name, modulus) for name, modulus in MODULI.items()))


def planned(path: Path, plan: Plan | None, source: Path = FOUR) -> Path:
    """Copy a recording, with a plan in its sidecar."""
    shutil.copy(source, path)
    document = sidecar.load(source) or {}
    sidecar.save(
        sidecar.sidecar_path(path), document | ({"session": plan.as_dict()} if plan else {})
    )
    return path


@pytest.fixture(scope="module")
def plan() -> Plan:
    """Return a plan whose touches are on its specimens, in order."""
    touches = zip(palpate.touches(palpate.read(FOUR)), MODULI, strict=True)
    return replace(WHOLE, touches=tuple(Entry(touch.start_s, name) for touch, name in touches))


def test_replay_shows_what_was_touched(plan: Plan, tmp_path: Path) -> None:
    """One column more, and two keys; without a plan nothing is different."""
    entries = (replace(plan.touches[0], left_out="discarded"), *plan.touches[1:3])
    path = planned(tmp_path / "run.csv", replace(plan, touches=entries))
    bare = planned(tmp_path / "bare.csv", WHOLE)  # specimens, but no touch of them
    plain, shown = run("replay", bare), run("replay", path)
    assert (plain.exit_code, shown.exit_code) == (0, 0)
    ends = ["specimen", "30 OO, left out: discarded", "70 OO", "40 A", "-"]
    for line, before, end in zip(
        shown.stdout.splitlines(), plain.stdout.splitlines(), ends, strict=False
    ):
        assert line.startswith(before.rstrip())
        assert line.endswith(f"  {end}")
    first, *_, last = document("replay", path)["touches"]
    assert (first["specimen"], first["left_out"]) == ("30 OO", "discarded")
    assert (last["specimen"], last["left_out"]) == (None, "")
    assert "specimen" not in document("replay", bare)["touches"][0]


def test_it_is_the_calibration_of_the_same_touches_in_files_with_names(tmp_path: Path) -> None:
    assert run("simulate", "-o", tmp_path / "ten", "--touches", "2").exit_code == 0
    table = tmp_path / "ten" / "moduli.csv"
    named, moduli, others = sorted({*table.parent.glob("*.csv")} - {table}), read_moduli(table), []
    for number, file in enumerate(named):
        name = next(name for name in moduli if name.replace(" ", "") == file.stem)
        entries = tuple(Entry(touch.start_s, name) for touch in palpate.touches(palpate.read(file)))
        plan = Plan(specimens=(Specimen(name, moduli[name].modulus),), touches=entries)
        others.append(planned(tmp_path / f"{number}.csv", plan, file))
    by_name = run("calibrate", *named, "--moduli", table, "-o", tmp_path / "named.toml")
    by_plan = run("calibrate", *others, "-o", tmp_path / "planned.toml")
    assert (by_name.exit_code, by_plan.exit_code) == (0, 0)
    date_and_files = re.compile("^calibrated: .*$", re.MULTILINE)
    assert date_and_files.sub("", by_name.stdout) == date_and_files.sub("", by_plan.stdout)


def test_what_is_left_out_is_told(plan: Plan, tmp_path: Path) -> None:
    changes: tuple[dict[str, Any], ...] = (
        {"left_out": "discarded"},
        {},
        {"specimen": None},
        {"specimen": "gel"},
    )
    entries = tuple(
        replace(entry, **change) for entry, change in zip(plan.touches, changes, strict=True)
    )
    path = planned(tmp_path / "run.csv", replace(plan, touches=entries))
    result = run("calibrate", path, "-o", tmp_path / "probe.toml")
    assert result.stderr.splitlines()[:-1] == [
        "30 OO: touch 1 of run.csv is left out: discarded",
        "touch 3 of run.csv is left out: no specimen is named for it",
        "gel: no modulus is known: the specimen is left out",
        *(f"{name}: no touches: the specimen is left out" for name in ("30 OO", "40 A", "70 A")),
    ], result.stderr


def test_a_table_wins_and_says_so_and_recordings_that_disagree_are_refused(
    plan: Plan, tmp_path: Path
) -> None:
    other = replace(plan, specimens=(Specimen("30OO", 0.2), *plan.specimens[1:]))
    paths, table = (
        (planned(tmp_path / "a.csv", plan), planned(tmp_path / "b.csv", other)),
        tmp_path / "moduli.csv",
    )
    result = run("calibrate", *paths, "-o", tmp_path / "probe.toml")
    assert result.exit_code == 4
    assert f"{paths[1]}: 30 OO: got 0.2 MPa, allowed: 0.143 MPa, as in" in result.stderr
    table.write_text("specimen,MPa\n30oo,0.15\n")
    result = run("calibrate", *paths, "--moduli", table, "-o", tmp_path / "probe.toml")
    assert f"{paths[1]}: 30oo: got 0.2 MPa, used: 0.15 MPa, as {table} says" in result.stderr
    assert "\n    30oo  0.15  " in result.stdout
    assert f"{paths[1]}: has the touches of {paths[0]}: each of them counts again" in result.stderr
    assert result.exit_code == 5


def test_without_a_plan_the_table_is_needed(plan: Plan, tmp_path: Path) -> None:
    paths = planned(tmp_path / "a.csv", plan), planned(tmp_path / "b.csv", WHOLE)
    result = run("calibrate", *paths, "-o", tmp_path / "probe.toml")
    missing = "--moduli: missing: allowed: a table of moduli"
    assert (result.exit_code, missing in result.stderr, str(paths[1]) in result.stderr) == (
        2,
        True,
        True,
    )
