"""On the command line: a specimen of known modulus compared with a calibration."""

import shutil
from pathlib import Path
from typing import Any

import palpate
import pytest
from command_lines import document, run
from palpate import Calibration
from palpate.calibration.assurance import today
from palpate.recording.session import Entry, Plan, Specimen
from project import made_once
from report_session import change, recorded

GEL = ("--modulus", "1.1 MPa")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a calibration, probe.toml, and gel/gel.csv, four touches on 1.1 MPa."""
    return made_once(tmp_path_factory, "report", recorded)


@pytest.fixture
def gel(folder: Path, tmp_path: Path) -> Path:
    """Return a copy of the recording of the gel."""
    for suffix in (".csv", ".json"):
        shutil.copy(folder / "gel" / f"gel{suffix}", tmp_path)
    return tmp_path / "gel.csv"


@pytest.fixture
def probe(folder: Path, tmp_path: Path) -> Path:
    """Return a copy of the calibration file."""
    return Path(shutil.copy(folder / "probe.toml", tmp_path))


@pytest.fixture
def dated(gel: Path) -> str:
    """Let the recording begin at a time that is the next day in UTC; return the day."""
    change(gel, {"started": "2026-03-04T23:30:00-02:00"})
    return "2026-03-05"


def named(gel: Path, names: list[str | None], left_out: str = "") -> None:
    """Give the touches of a recording specimens; the first one is left out by hand."""
    touches = palpate.touches(palpate.read(gel))
    entries = []
    for number, (touch, name) in enumerate(zip(touches, names, strict=True)):
        entries.append(Entry(touch.start_s, name, "" if number else left_out))
    plan = Plan(
        specimens=(Specimen("Gel 1", 1.1, 4, 0.02), Specimen("foam")),
        touches=tuple(entries),
    )
    change(gel, {"session": plan.as_dict()})


def test_a_calibration_that_holds(gel: Path, probe: Path, dated: str) -> None:
    result = run("verify", "gel", gel, *GEL, "--calibration", probe)
    assert result.exit_code == 0, result.output
    *table, sentence, added = result.stdout.splitlines()
    assert [line.split()[0] for line in table] == ["touch", "1", "2", "3", "4"]
    assert table[0].endswith("modulus (95 % interval)")
    assert sentence.startswith("gel (1.10 MPa) measures 1.1")
    assert f") on {dated}: the calibration holds (a change of the ratio by " in sentence
    assert added == f"{probe}: the result is added."
    [stored] = Calibration.load(probe).verifications
    assert sentence == f"{stored}."
    assert (stored.specimen, stored.date, stored.touches) == ("gel", dated, 4)


def test_a_calibration_that_does_not_hold_is_warned_about_until_one_agrees(
    gel: Path, probe: Path, dated: str, tmp_path: Path
) -> None:
    worn = ("verify", "gel", gel, "--modulus", "0.7 MPa", "--calibration", probe)
    result = run(*worn)
    assert result.exit_code == 5
    assert f"on {dated}, " in result.stdout
    assert "the calibration does not hold any more" in result.stdout
    assert "check the connections and the gain of both channels" in result.stdout
    warning = "the newest verification disagrees, so the moduli may be wrong: gel (0.700 MPa)"
    later = run("replay", gel, "--calibration", probe)
    assert later.exit_code == 5
    assert warning in later.stderr
    assert dated in later.stderr
    report = run("report", gel, "--calibration", probe, "-o", tmp_path / "gel.html")
    assert report.exit_code == 5
    assert warning in report.stderr
    again = run("verify", "gel", gel, *GEL, "--calibration", probe)
    assert again.exit_code == 0
    assert warning not in again.stderr
    healthy = run("replay", gel, "--calibration", probe)
    assert healthy.exit_code == 0
    assert warning not in healthy.stderr
    assert len(Calibration.load(probe).verifications) == 2


def test_touches_that_differ_are_no_evidence(gel: Path, probe: Path, folder: Path) -> None:
    """The touches on two specimens, given as touches on one."""
    other = next(
        path for path in sorted(folder.glob("*/*.csv")) if path.stem not in ("gel", "moduli")
    )
    before = probe.read_bytes()
    result = run("verify", "gel", gel, other, *GEL, "--calibration", probe)
    assert result.exit_code == 5
    assert "touches differ: their ratios spread by" in result.stdout
    assert "Nothing is compared: touch the specimen again." in result.stdout
    assert probe.read_bytes() == before


def test_a_dry_run_changes_nothing(gel: Path, probe: Path) -> None:
    before = probe.read_bytes()
    result = run("verify", "gel", gel, *GEL, "--calibration", probe, "--dry-run")
    assert result.exit_code == 0
    assert result.stdout.endswith(f"{probe}: not changed: --dry-run.\n")
    assert probe.read_bytes() == before


def test_verify_as_json(gel: Path, probe: Path, dated: str) -> None:
    found = document("verify", "gel", gel, *GEL, "--calibration", probe)
    assert (found["calibration"], found["written"]) == (str(probe), True)
    verification = found["verification"]
    assert verification["agrees"]
    assert (verification["known_MPa"], verification["date"]) == (1.1, dated)
    assert 0.01 < verification["probability"] <= 1
    assert [touch["number"] for touch in found["touches"]] == [1, 2, 3, 4]
    assert {touch["file"] for touch in found["touches"]} == {"gel.csv"}
    for touch in found["touches"]:
        assert touch["modulus"]["low_MPa"] < 1.1 < touch["modulus"]["high_MPa"]


def test_a_recording_without_a_date_is_of_today(gel: Path, probe: Path) -> None:
    found = document("verify", "gel", gel, *GEL, "--calibration", probe)
    assert found["verification"]["date"] == today()


@pytest.mark.parametrize("started", ["9999-12-31T00:00:00+00:00", "0001-01-01T00:00:00+14:00"])
def test_a_date_that_cannot_be_is_today(gel: Path, probe: Path, started: str) -> None:
    change(gel, {"started": started})
    found = document("verify", "gel", gel, *GEL, "--calibration", probe)
    assert found["verification"]["date"] == today()


def test_only_the_touches_on_the_specimen_count(gel: Path, probe: Path) -> None:
    """By the session: its modulus and uncertainty, and the touch that was discarded."""
    named(gel, ["Gel 1", "Gel 1", "foam", None], left_out="discarded")
    found = document("verify", "gel1", gel, "--calibration", probe)
    assert [touch["number"] for touch in found["touches"]] == [1, 2]
    assert [touch["left_out"] for touch in found["touches"]] == [["discarded"], []]
    verification = found["verification"]
    assert verification["touches"] == 1
    assert (verification["known_MPa"], verification["known_uncertainty"]) == (1.1, 0.02)
    other = run("verify", "gell", gel, *GEL, "--calibration", probe)
    assert other.exit_code == 2
    assert "SPECIMEN: got 'gell', allowed: Gel 1, foam" in other.stderr


def test_several_recordings_have_a_column(gel: Path, probe: Path) -> None:
    second = gel.with_name("gel-2.csv")
    shutil.copy(gel, second)
    shutil.copy(gel.with_suffix(".json"), second.with_suffix(".json"))
    result = run("verify", "gel", gel, second, *GEL, "--calibration", probe)
    lines = result.stdout.splitlines()
    assert [line.split()[0] for line in lines[:3]] == ["file", "gel.csv", "gel.csv"]
    assert lines[8].split()[:2] == ["gel-2.csv", "4"]


@pytest.mark.parametrize(
    ("options", "known", "uncertainty"),
    [
        (["--modulus", "1100 kPa"], 1.1, 0.0),
        (["--modulus", "1.1 MPa", "--modulus-uncertainty", "5%"], 1.1, 0.05),
        (["--modulus", "1.1 MPa", "--modulus-uncertainty", "0.11 MPa"], 1.1, 0.1),
    ],
)
def test_the_modulus_of_an_option(
    gel: Path, probe: Path, options: list[str], known: float, uncertainty: float
) -> None:
    found = document("verify", "gel", gel, *options, "--calibration", probe)["verification"]
    assert found["known_MPa"] == pytest.approx(known)
    assert found["known_uncertainty"] == pytest.approx(uncertainty)


def test_the_modulus_of_a_table(gel: Path, probe: Path, tmp_path: Path) -> None:
    table = tmp_path / "moduli.csv"
    table.write_text('specimen,MPa,"u, %"\nGel,1.1,4\n')
    options = ("--moduli", table, "--calibration", probe)
    found = document("verify", "gel", gel, *options)["verification"]
    assert (found["known_MPa"], found["known_uncertainty"]) == (1.1, 0.04)
    other = run("verify", "foam", gel, *options)
    assert other.exit_code == 4
    assert f"{table}: got specimen 'foam', allowed: Gel" in other.stderr


def test_a_hardness_is_converted_and_named(gel: Path, probe: Path) -> None:
    options = ("--modulus", "30 A", "--calibration", probe, "--dry-run")
    result = run("verify", "gel", gel, *options)
    assert "gel: 30 Shore A is taken as 1.14 MPa +-22 % (k = 1)\n" in result.stderr
    assert result.exit_code == 0


@pytest.mark.parametrize(
    ("options", "code", "message"),
    [
        ([], 2, "--modulus: missing: no modulus is known for 'gel'"),
        (["--modulus", "1.1"], 2, "got '1.1', allowed: a positive number with Pa, kPa"),
        (["--modulus", "-1 MPa"], 2, "got '-1 MPa', allowed: a positive number"),
        (["--modulus", "1 MPa", "--modulus-uncertainty", "5"], 2, "got '5' as a standard unc"),
        (["--modulus", "1 MPa", "--moduli", "{probe}"], 2, "--modulus and --moduli: allowed one"),
        (["--modulus", "1 MPa", "-o", "new.csv"], 2, "-o: got it with a recording"),
        (["--modulus", "1 MPa", "--excitation", "A"], 2, "--excitation: got it with a recording"),
        (["--modulus", "1 MPa", "sim:tremor"], 2, "allowed: one source that measures, or"),
        (["--modulus", "1 MPa", "nope.csv"], 4, "nope.csv: No such file"),
        (["--modulus", "1 MPa", "--calibration", "{gel}"], 4, "gel.csv: not a calibration"),
    ],
)
def test_wrong_lines(gel: Path, probe: Path, options: list[str], code: int, message: str) -> None:
    named_files = [option.format(gel=gel, probe=probe) for option in options]
    before = probe.read_bytes()
    result = run("verify", "gel", gel, "--calibration", probe, *named_files)
    assert (result.exit_code, message in result.stderr) == (code, True), result.stderr
    assert probe.read_bytes() == before


def test_a_source_needs_a_modulus_before_it_is_opened(probe: Path) -> None:
    result = run("verify", "gel", "sim:no-such-scenario", "--calibration", probe)
    assert result.exit_code == 2
    assert "--modulus: missing" in result.stderr


def test_a_recording_that_was_changed_is_no_evidence(gel: Path, probe: Path) -> None:
    gel.write_bytes(gel.read_bytes().replace(b",0\n", b",1\n", 1))
    before = probe.read_bytes()
    result = run("verify", "gel", gel, *GEL, "--calibration", probe)
    assert result.exit_code == 5
    assert "the rows were changed" in result.stderr
    assert result.stdout.endswith(f"{probe}: not changed: the result is not reliable.\n")
    assert probe.read_bytes() == before


def test_touches_that_do_not_count_are_named(gel: Path, probe: Path) -> None:
    before = probe.read_bytes()
    result = run("verify", "gel", gel, *GEL, "--calibration", probe, "--set", "age=1.3")
    assert result.exit_code == 5
    assert result.stdout.count("left out: measured with age 1.3, but calibrated with age 0") == 4
    assert "No touch counts, so nothing is compared: touch the specimen again." in result.stdout
    assert probe.read_bytes() == before


def test_a_source_is_measured_and_recorded(gel: Path, probe: Path, tmp_path: Path) -> None:
    """A recording that is played has the touches of the recording."""
    kept = tmp_path / "kept.csv"
    options = (*GEL, "--calibration", probe, "--dry-run")
    read = document("verify", "gel", gel, *options)["verification"]
    played = run("verify", "gel", f"{gel}?speed=1000", *options, "-o", kept, "--touches", "4")
    assert played.exit_code == 0, played.output
    assert "gel: 4 touches to measure\ntouch 1 of 4 has ended\n" in played.stderr
    assert read["text"].replace(read["date"], today()) in played.stdout
    assert palpate.check(kept).verdict == "complete, clean end"
    again: Any = document("verify", "gel", kept, *options)
    assert again["verification"]["value_MPa"] == read["value_MPa"]


def test_fewer_touches_than_wanted(gel: Path, probe: Path) -> None:
    options = (*GEL, "--calibration", probe, "--touches", "9")
    result = run("verify", "gel", f"{gel}?speed=1000", *options)
    assert result.exit_code == 5
    assert result.stderr.endswith("4 of 9 touches were measured\n")
    assert Calibration.load(probe).verifications[-1].touches == 4


def test_a_recording_is_never_replaced(gel: Path, probe: Path) -> None:
    result = run("verify", "gel", f"{gel}?speed=1000", *GEL, "--calibration", probe, "-o", gel)
    assert result.exit_code == 4
    assert "already exists: choose another name" in result.stderr


def test_the_scene_is_that_of_the_calibration(gel: Path, probe: Path) -> None:
    text = probe.read_text()
    assert 'scene = "handheld"' in text
    probe.write_text(text.replace('scene = "handheld"', 'scene = "paper"'))
    options = (*GEL, "--calibration", probe, "--dry-run")
    measured = run("verify", "gel", f"{gel}?speed=1000", *options)
    assert "with scene" not in measured.stderr
    of_recording = run("verify", "gel", gel, *options)
    assert "made with scene paper, but this is scene handheld" in of_recording.stderr


def test_a_simulated_calibration_needs_accept_for_a_probe(gel: Path, probe: Path) -> None:
    change(gel, {"device": {"name": "AD7746", "full_scale_pF": 4.096}})
    before = probe.read_bytes()
    line = ("verify", "gel", gel, *GEL, "--calibration", probe)
    refused = run(*line)
    assert refused.exit_code == 2
    assert "the calibration was made from simulated touches, but the readings" in refused.stderr
    assert probe.read_bytes() == before
    accepted = run(*line, "--accept", "simulated")
    assert accepted.exit_code == 0, accepted.output
    assert "used anyway because of --accept simulated" in accepted.stderr


def test_simulated_touches_are_no_evidence_on_a_probe(gel: Path, probe: Path) -> None:
    text = probe.read_text()
    assert text.count("simulated = true") == 1
    probe.write_text(text.replace("simulated = true", "simulated = false"))
    before = probe.read_bytes()
    doubt = "the touches are simulated, but the calibration was made with a probe: they are no"
    for source in (gel, "sim:four-specimens?seed=1"):
        options = (*GEL, "--calibration", probe, "--touches", "1")
        result = run("verify", "gel", source, *options)
        assert result.exit_code == 5
        assert doubt in result.stderr
        assert probe.read_bytes() == before


def test_a_simulated_calibration_is_refused_before_a_source_is_recorded(
    probe: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("palpate.calibration.origin.is_simulated", lambda _: False)
    kept = tmp_path / "kept.csv"
    options = (*GEL, "--calibration", probe, "--touches", "1", "-o", kept)
    result = run("verify", "gel", "sim:four-specimens?seed=1", *options)
    assert result.exit_code == 2
    assert "sim:four-specimens?seed=1: the calibration was made from simulated" in result.stderr
    assert not kept.exists()
