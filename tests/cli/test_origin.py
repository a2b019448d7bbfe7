"""On the command line: where a calibration comes from, and for which recordings it is refused."""

import json
import re
import shutil
import tomllib
from pathlib import Path

import pytest
import tomli_w
from command_lines import document, run
from palpate.calibration.provenance import FileChecksum
from palpate.files import Json
from palpate.recording import sidecar
from palpate.recording.session import Plan
from project import FOUR, made_once
from report_session import change, recorded, specimens

A = "66 cc 5c 90"
B = "61 12 5c 34"
STATED = ("--probe", "B2", "--operator", "A. Bee", "--site", "room 3")


def board(chip: str = A) -> Json:
    """Return the description of a real board."""
    return {"converter": "AD7746", "fingerprint": chip, "full_scale_pF": 4.095755859375}


def real(path: Path, chip: str = A, started: str = "2026-11-27T11:02:00+01:00") -> Path:
    """Let the sidecar of a recording state that a board made it."""
    change(path, {"device": board(chip), "started": started})
    return path


@pytest.fixture(scope="module")
def simulated(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Ten simulated specimens, a gel, and the calibration."""
    return made_once(tmp_path_factory, "report", recorded)


@pytest.fixture(scope="module")
def measured(simulated: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the same, as a board with the chip A would have recorded it."""
    folder = tmp_path_factory.mktemp("measured")
    for part in ("ten", "gel"):
        shutil.copytree(simulated / part, folder / part)
    for path in [*specimens(folder), folder / "gel" / "gel.csv"]:
        real(path)
    change(specimens(folder)[0], {"session": Plan(operator="C. Dee").as_dict()})
    result = run("calibrate", *specimens(folder), *output(folder), *STATED)
    assert result.exit_code == 0, result.output
    return folder


def output(folder: Path, name: str = "probe.toml") -> list[str | Path]:
    """Return the options of `calibrate` for its inputs and output."""
    return ["--moduli", folder / "ten" / "moduli.csv", "-o", folder / name]


def gel(folder: Path, target: Path) -> Path:
    """Copy the recording of the gel."""
    for suffix in (".csv", ".json"):
        shutil.copy(folder / "gel" / f"gel{suffix}", target / f"gel{suffix}")
    return target / "gel.csv"


def test_a_calibration_states_where_it_comes_from(measured: Path) -> None:
    made = tomllib.loads((measured / "probe.toml").read_text())["provenance"]
    files = made.pop("files")
    assert re.fullmatch(r"20\d\d-\d\d-\d\dT\d\d:\d\d:\d\d\+00:00", made.pop("date"))
    assert made == {
        "measured": "2026-11-27T10:02:00+00:00",
        "probe": "B2",
        "operator": "A. Bee",
        "site": "room 3",
        "chips": [A],
        "simulated": False,
    }
    assert len(files) == 21
    first = specimens(measured)[0]
    sources = [first, sidecar.sidecar_path(first), measured / "ten" / "moduli.csv"]
    for path in sources:
        assert FileChecksum.of(path).as_dict() in files


def test_what_is_not_stated_comes_from_the_session_or_is_missing(
    measured: Path, tmp_path: Path
) -> None:
    options = [*output(measured)[:2], "-o", tmp_path / "p.toml"]
    result = run("calibrate", *specimens(measured), *options)
    assert (
        "operator: C. Dee; chip: 66 cc 5c 90; touches: measured with a probe; not stated: probe, site\n"
        in (result.stdout)
    )
    found = document("calibrate", *specimens(measured), *options, "--force")
    assert found["provenance"]["operator"] == "C. Dee"
    replayed = run("replay", measured / "gel" / "gel.csv", "--calibration", tmp_path / "p.toml")
    missing = "the calibration does not state: probe, site; palpate calibrate has --probe --site"
    assert replayed.stderr == f"{tmp_path / 'p.toml'}: {missing}\n"
    assert replayed.exit_code == 0


def test_a_default_of_the_configuration_is_stated(
    measured: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("palpate.toml").write_text('[calibrate]\nprobe = "B7"\n')
    options = [*output(measured)[:2], "-o", "p.toml"]
    found = document("calibrate", *specimens(measured), *options)
    assert found["provenance"]["probe"] == "B7"
    long = run("calibrate", *specimens(measured), *options, "--force", "--site", "x" * 201)
    assert (long.exit_code, "site: got 'xxx" in long.stderr) == (2, True)


def test_simulated_and_real_recordings_are_not_mixed(measured: Path, tmp_path: Path) -> None:
    shutil.copytree(measured / "ten", tmp_path / "ten")
    first, second, *_ = specimens(tmp_path)
    change(first, {"device": {"name": "simulated probe"}})
    result = run("calibrate", *specimens(tmp_path), *output(tmp_path))
    assert result.exit_code == 2
    assert (
        f"got simulated recordings ({first.name}) and recordings from a probe ({second.name}, "
        in (result.stderr)
    )
    assert "allowed: recordings of one kind" in result.stderr
    assert not (tmp_path / "probe.toml").exists()


@pytest.mark.parametrize(
    ("kind", "expected", "text"),
    [
        ("ten", True, "so the calibration counts as simulated"),
        ("measured", None, "no sidecar states whether they are simulated"),
    ],
)
def test_recordings_that_do_not_state_it(
    simulated: Path, measured: Path, tmp_path: Path, kind: str, expected: bool | None, text: str
) -> None:
    source = simulated if kind == "ten" else measured
    shutil.copytree(source / "ten", tmp_path / "ten")
    first = specimens(tmp_path)[0]
    sidecar.sidecar_path(first).unlink()
    result = run("calibrate", *specimens(tmp_path), *output(tmp_path), "--json")
    found = json.loads(result.stdout)
    assert found["provenance"].get("simulated") is expected
    [note] = [note for note in found["notes"] if note.startswith(f"{first.name}: no sidecar")]
    assert note.endswith(text)
    assert note in result.stderr


def test_recordings_of_two_chips_are_named(measured: Path, tmp_path: Path) -> None:
    shutil.copytree(measured / "ten", tmp_path / "ten")
    real(specimens(tmp_path)[0], B)
    result = run("calibrate", *specimens(tmp_path), *output(tmp_path))
    assert f"the recordings are from 2 chips: {B}, {A}\n" in result.stderr
    made = tomllib.loads((tmp_path / "probe.toml").read_text())["provenance"]
    assert made["chips"] == [B, A]


def test_the_same_chip_needs_no_word(measured: Path, tmp_path: Path) -> None:
    path = gel(measured, tmp_path)
    probe = ("--calibration", measured / "probe.toml")
    result = run("replay", path, *probe)
    assert (result.exit_code, result.stderr) == (0, "")
    assert document("replay", path, *probe)["calibration"]["remarks"] == []
    assert run("report", path, *probe, "-o", tmp_path / "gel.html").stderr == ""


@pytest.mark.parametrize("command", ["replay", "report", "live", "shown"])
@pytest.mark.parametrize("accepted", ["other-chip", "simulated"])
def test_a_calibration_that_was_not_made_for_it_is_refused(
    simulated: Path, measured: Path, tmp_path: Path, command: str, accepted: str
) -> None:
    """Another chip; a simulation. The measurement of a page is refused before anything is written."""
    path = gel(measured, tmp_path)
    probe = simulated / "probe.toml"
    if accepted == "other-chip":
        real(path, B)
        probe = measured / "probe.toml"
    words: list[str | Path] = [command, path, "--calibration", probe]
    if command == "live":
        words = ["live", f"{path}?speed=1", "--record", tmp_path / "run.csv", *words[2:]]
    elif command == "shown":
        words[0] = "live"
    [other] = {"other-chip", "simulated"} - {accepted}
    for options in ([], ["--accept", other]):
        before = sorted(tmp_path.iterdir())
        result = run(*words, *options)
        assert result.exit_code == 2
        assert f"or use it anyway with --accept {accepted}" in result.stderr
        assert result.stdout == ""
        assert sorted(tmp_path.iterdir()) == before
    refused = json.loads(run(*words, "--json").stdout)["error"]
    assert (refused["code"], f"--accept {accepted}" in refused["message"]) == (2, True)


@pytest.mark.parametrize("accepted", ["other-chip", "simulated"])
def test_what_is_accepted_is_used_and_said(
    simulated: Path, measured: Path, tmp_path: Path, accepted: str
) -> None:
    path = gel(measured, tmp_path)
    probe = simulated / "probe.toml"
    if accepted == "other-chip":
        real(path, B)
        probe = measured / "probe.toml"
    words = (path, "--calibration", probe, "--accept", accepted)
    text = f"; used anyway because of --accept {accepted}"
    replayed = run("replay", *words)
    assert (replayed.exit_code, replayed.stderr.count(text)) == (0, 1)
    found = document("replay", *words)
    [remark] = found["calibration"]["remarks"]
    assert remark.endswith(text)
    assert found["modulus_of_mean"]["value_MPa"] > 0
    report = tmp_path / "gel.html"
    written = run("report", *words, "-o", report)
    assert (written.exit_code, written.stderr.count(text)) == (0, 1)
    page = report.read_text(encoding="utf-8")
    assert re.search(rf'<p class="box">gel\.csv: the calibration was made .*{text}</p>', page)
    assert f"palpate replay gel.csv --calibration probe.toml --accept {accepted}" in page
    assert f"palpate report gel.csv --calibration probe.toml --accept {accepted}" in page


def test_a_folder_of_recordings_is_refused_one_by_one(measured: Path, tmp_path: Path) -> None:
    own = gel(measured, tmp_path)
    for suffix in (".csv", ".json"):
        shutil.copy(own.with_suffix(suffix), tmp_path / f"other{suffix}")
    real(tmp_path / "other.csv", B)
    result = run("replay", tmp_path, "--calibration", measured / "probe.toml")
    assert result.exit_code == 2
    assert result.stderr.startswith(f"Error: {tmp_path / 'other.csv'}: the calibration was made")
    assert "mean of 4 touches" in result.stdout
    found = document("replay", tmp_path, "--calibration", measured / "probe.toml")
    assert [each.get("error", {}).get("code") for each in found] == [None, 2]


def test_a_report_of_many_recordings_has_each_remark_once(simulated: Path, tmp_path: Path) -> None:
    paths = []
    for number in range(5):
        path = shutil.copy(simulated / "gel" / "gel.csv", tmp_path / f"gel-{number}.csv")
        paths.append(path)
    probe = ("--calibration", simulated / "probe.toml", "-o", tmp_path / "gel.html")
    found = document("report", *paths, *probe)
    [remark] = found["calibration"]["remarks"]
    assert remark.startswith("gel-0.csv, gel-1.csv, gel-2.csv and 2 more: the calibration was ma")


def test_a_recording_without_a_sidecar_is_said_and_not_refused(
    simulated: Path, measured: Path, tmp_path: Path
) -> None:
    path = gel(measured, tmp_path)
    sidecar.sidecar_path(path).unlink()
    of_chip = run("replay", path, "--calibration", measured / "probe.toml")
    assert of_chip.exit_code == 0
    assert "the readings do not state their chip and whether they are simulated" in of_chip.stderr
    of_nothing = run("replay", path, "--calibration", simulated / "probe.toml")
    assert of_nothing.exit_code == 0
    assert "the calibration was made from simulated touches, and the readings do not state" in (
        of_nothing.stderr
    )


def test_a_real_calibration_on_simulated_readings_is_said(simulated: Path, measured: Path) -> None:
    path = simulated / "gel" / "gel.csv"
    result = run("replay", path, "--calibration", measured / "probe.toml")
    assert result.exit_code == 0
    assert (
        "the readings are simulated, but the calibration was made with a probe\n" in result.stderr
    )


def test_an_old_calibration_and_an_earlier_file_are_said(measured: Path, tmp_path: Path) -> None:
    """Exit code 0: the calibration is reliable."""
    path = real(gel(measured, tmp_path), started="2028-01-27T11:02:00+01:00")
    old = run("replay", path, "--calibration", measured / "probe.toml")
    assert old.exit_code == 0
    assert "the calibration is from 2026-11-27, more than a year before the readings" in old.stderr
    values = tomllib.loads((measured / "probe.toml").read_text())
    del values["provenance"]
    earlier = tmp_path / "earlier.toml"
    earlier.write_text(tomli_w.dumps(values))
    for command in ("replay", "report"):
        result = run(command, path, "--calibration", earlier)
        assert result.exit_code == 0
        assert result.stderr.count("does not state: date, date of the touches, probe, oper") == 1


def test_the_report_states_the_provenance(measured: Path, tmp_path: Path) -> None:
    path = gel(measured, tmp_path)
    probe = ("--calibration", measured / "probe.toml")
    run("report", path, *probe, "-o", tmp_path / "gel.html")
    line = "Probe: B2; operator: A. Bee; site: room 3; chip: 66 cc 5c 90; touches: measured with a probe."
    assert line in (tmp_path / "gel.html").read_text(encoding="utf-8")
    found = document("report", path, *probe, "-o", tmp_path / "json.html")
    assert found["calibration"]["provenance"]["probe"] == "B2"
    made = [*output(measured)[:2], "-o", tmp_path / "p.toml", "--report", tmp_path / "p.html"]
    run("calibrate", *specimens(measured), *made, *STATED)
    assert line in (tmp_path / "p.html").read_text(encoding="utf-8")


def test_an_unknown_acceptance_is_a_usage_error() -> None:
    result = run("replay", FOUR, "--accept", "all")
    assert (result.exit_code, "'other-chip', 'simulated'" in result.stderr) == (2, True)
