"""On the command line: simulate, calibrate, and replay with a calibration."""

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import palpate
import pytest
from click.testing import CliRunner, Result
from palpate.cli import main
from palpate.several import objections
from project import ROOT


def run(*arguments: str | Path) -> Result:
    return CliRunner().invoke(main, [str(a) for a in arguments])


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Ten specimens by four touches, an eleventh object, and the calibration."""
    base = tmp_path_factory.mktemp("session")
    assert run("simulate", "-o", base / "ten").exit_code == 0
    assert run("simulate", "-o", base / "gel", "--object", "gel=1.1", "--seed", "7").exit_code == 0
    result = run(
        "calibrate", *files(base), "--moduli", base / "ten" / "moduli.csv", "-o", base / "probe.toml",
        "--plot", base / "probe.png", "--report", base / "probe.html",
    )  # fmt: skip
    assert result.exit_code == 0, result.output
    (base / "printed.txt").write_text(result.stdout, encoding="utf-8")
    return base


def files(base: Path) -> list[Path]:
    return sorted(path for path in (base / "ten").glob("*.csv") if path.name != "moduli.csv")


def values(printed: str) -> int:
    """Return how many touches a calibration used."""
    found = re.search(r"specimens, (\d+) values", printed)
    assert found, printed
    return int(found[1])


def test_the_session(folder: Path) -> None:
    lines = (folder / "printed.txt").read_text(encoding="utf-8").splitlines()
    assert lines[0].split()[:3] == ["specimen", "MPa", "touches"]
    assert [line.split()[:3] for line in lines[1:3]] == [["30", "OO", "0.143"], ["40", "OO", "0.186"]]
    assert lines[11].split() == ["rises", "yes", "yes", "yes", "yes"]
    assert lines[-1].startswith("The curve fits. 10 specimens, ")
    assert 36 <= values(lines[-1]) <= 40  # the gauges are not quite linear: some touches have the flag "curve"
    for name, true in {"rigid_ratio": 10.0, "half_modulus": 2.0}.items():
        [line] = [line for line in lines if line.startswith(name)]
        found = re.search(r"([\d.]+) to ([\d.]+)", line)
        assert found
        low, high = map(float, found.groups())
        assert low < true < high
    assert (folder / "probe.png").read_bytes().startswith(b"\x89PNG")


def test_the_report_stands_alone(folder: Path) -> None:
    page = (folder / "probe.html").read_text(encoding="utf-8")
    assert "The curve fits." in page
    assert "<svg" in page
    assert re.search(r"<td[^>]*>70 A</td>", page)
    assert not re.search(r'(src|href)="(?!#)', page)


def test_replay_adds_the_modulus(folder: Path) -> None:
    plain = run("replay", folder / "gel" / "gel.csv").stdout.splitlines()
    result = run("replay", folder / "gel" / "gel.csv", "--calibration", folder / "probe.toml")
    assert (result.exit_code, result.stderr) == (0, "")
    lines = result.stdout.splitlines()
    assert len(lines) == len(plain) + 2 == 7
    for before, after in zip(plain, lines, strict=False):
        assert after.startswith(before)
    assert lines[5].startswith("mean of 4 touches: 4.20")
    assert re.fullmatch(r"The intervals include the scatter from touch to touch \(2\.\d %\)\.", lines[6])
    together = re.search(r"one object: [\d.]+ MPa \(([\d.]+) to ([\d.]+)\)", lines[5])
    assert together
    low, high = map(float, together.groups())
    assert low < 1.1 < high


def test_replay_as_json(folder: Path) -> None:
    document = json.loads(
        run("replay", folder / "gel" / "gel.csv", "--calibration", folder / "probe.toml", "--json").stdout
    )
    for touch in document["touches"]:
        modulus = touch["modulus"]
        assert modulus["low_MPa"] < modulus["value_MPa"] < modulus["high_MPa"]
        assert modulus["extrapolated"] is False
    together, mean = document["agreement"], document["modulus_of_mean"]
    assert together["agree"] is True
    assert together["standard_error"] == pytest.approx(together["scatter"] * together["ratio"] / 2, rel=1e-2)
    assert mean["high_MPa"] - mean["low_MPa"] < modulus["high_MPa"] - modulus["low_MPa"]


def test_an_object_that_is_too_stiff_and_one_beyond(folder: Path, tmp_path: Path) -> None:
    run("simulate", "-o", tmp_path, "--object", "steel=200000", "--object", "foam=0.02", "--touches", "1")
    steel = run("replay", tmp_path / "steel.csv", "--calibration", folder / "probe.toml").stdout
    assert "stiffer than" in steel
    assert "beyond the calibrated moduli" in steel
    document = json.loads(
        run("replay", tmp_path / "steel.csv", "--calibration", folder / "probe.toml", "--json").stdout
    )
    assert document["touches"][0]["modulus"]["high_MPa"] is None
    assert document["modulus_of_mean"] is None
    assert "beyond" in run("replay", tmp_path / "foam.csv", "--calibration", folder / "probe.toml").stdout


def test_another_scene_is_said(folder: Path) -> None:
    result = run("replay", folder / "gel" / "gel.csv", "--scene", "paper", "--calibration", folder / "probe.toml")
    assert result.exit_code == 0
    assert "was made with scene handheld, but this is scene paper" in result.stderr


def test_a_doubt_goes_into_the_calibration(folder: Path, tmp_path: Path) -> None:
    """A calibration from rows that were changed says so wherever it is used."""
    ten = tmp_path / "ten"
    shutil.copytree(folder / "ten", ten)
    changed = files(tmp_path)[0]
    changed.write_bytes(changed.read_bytes().replace(b",0\n", b",1\n", 1))
    probe = tmp_path / "probe.toml"
    made = run("calibrate", *files(tmp_path), "--moduli", ten / "moduli.csv", "-o", probe)
    assert made.exit_code == 5
    result = run("replay", folder / "gel" / "gel.csv", "--calibration", probe)
    assert "was made from recordings that were not as written, so the moduli may be wrong" in result.stderr
    assert f"{changed.name}: the rows were changed" in result.stderr


def test_calibrate_as_json(folder: Path, tmp_path: Path) -> None:
    result = run(
        "calibrate", *files(folder), "--moduli", folder / "ten" / "moduli.csv", "-o", tmp_path / "p.toml", "--json",
        "--by", "covariance", "--scene", "paper",
    )  # fmt: skip
    document = json.loads(result.stdout)
    assert document["sound"] is True
    assert document["about"] == {"scene": "paper", "fitted on": "covariance"}
    assert len(document["specimens"]) == 10
    assert document["specimens"][0]["smallest error"] is None  # the scene has no standard error
    assert len(document["data"]["ratios"]) == 10


def test_a_calibration_that_is_not_to_be_relied_on(folder: Path, tmp_path: Path) -> None:
    moduli = tmp_path / "moduli.csv"
    moduli.write_text((folder / "ten" / "moduli.csv").read_text().replace("30 A,0.87", "30 A,5.0"))
    result = run("calibrate", *files(folder), "--moduli", moduli, "-o", tmp_path / "p.toml")
    assert result.exit_code == 5
    assert "not reliable" in result.stdout
    assert (tmp_path / "p.toml").exists()


def test_specimens_without_a_recording_and_touches_with_a_flag(folder: Path, tmp_path: Path) -> None:
    table = folder / "ten" / "moduli.csv"
    few = run("calibrate", *files(folder)[:7], "--moduli", table, "-o", tmp_path / "p.toml")
    assert few.stderr.count("the specimen is left out") == 3
    assert "7 specimens, " in few.stdout
    assert values(few.stdout) == 28 - few.stderr.count(" is left out: ") >= 25
    short = ["--samples", "400"]
    flagged = run("calibrate", *files(folder), "--moduli", table, "-o", tmp_path / "q.toml", *short, "--scene", "paper")
    assert flagged.exit_code == 4
    assert (
        "30 OO: touch 4 of 30OO.csv is left out: short, below 16 samples or without a standard error\n"
        in flagged.stderr
    )
    assert "30 OO: no usable touch among 4: the specimen is left out\n" in flagged.stderr
    assert "got 0 specimens" in flagged.stderr
    assert not (tmp_path / "q.toml").exists()
    weighed = run("calibrate", *files(folder), "--moduli", table, "-o", tmp_path / "r.toml", *short)
    assert weighed.exit_code == 0
    assert "short" not in weighed.stderr
    assert values(weighed.stdout) == 40 - weighed.stderr.count(" is left out: ") >= 36
    short += ["--scene", "paper", "--accept", "short", "--accept", "gap"]
    accepted = run("calibrate", *files(folder), "--moduli", table, "-o", tmp_path / "s.toml", *short)
    assert accepted.exit_code == 0
    assert accepted.stderr == "--accept gap: no touch has this flag; those found: short\n"
    assert palpate.Calibration.load(tmp_path / "s.toml").about["accepted flags"] == "short gap"


def test_several_objects_have_no_mean(folder: Path) -> None:
    four = ROOT / "tests" / "data" / "four-specimens.csv"
    result = run("replay", four, "--calibration", folder / "probe.toml")
    assert result.exit_code == 0
    assert "the 4 touches differ" in result.stdout
    assert "mean of" not in result.stdout
    document = json.loads(run("replay", four, "--calibration", folder / "probe.toml", "--json").stdout)
    assert (document["agreement"]["agree"], document["agreement"]["ratio"]) == (False, None)
    assert document["modulus_of_mean"] is None


MODEL = ("offset", "drift", "lag", "curve", "creep")


def test_the_cord(recordings: Path, tmp_path: Path) -> None:
    """Real touches, all of them short: those with a standard error are used; of each other one the flag is printed."""
    gestures = {"m": 0.07, "l": 4.2, "ca": 4.6, "h": 12.8}  # no moduli: the places have none; these follow eq. (2)
    (tmp_path / "moduli.csv").write_text("place,MPa\n" + "".join(f"{name},{E}\n" for name, E in gestures.items()))
    files, used = [], 0
    for name in gestures:
        for number in range(1, 16):
            file = tmp_path / f"{name}-{number}.csv"
            file.symlink_to(recordings / "cord" / f"{name}{number}.csv")
            files.append(file)
            found = palpate.touches(palpate.read(file, columns={"soft": 4, "hard": 8}))
            assert all("short" in touch.flags for touch in found)
            used += sum(not objections(touch, MODEL) for touch in found)
    accept = [text for flag in MODEL for text in ("--accept", flag)]
    result = run(
        "calibrate", *files, "--moduli", tmp_path / "moduli.csv", "-o", tmp_path / "cord.toml", "--map", "soft=4,hard=8",
        "--free-soft-ratio", *accept,
    )  # fmt: skip
    assert result.exit_code == 5, result.output  # written; a cord has no modulus, and does not follow eq. (2)
    assert "This calibration is not reliable. 4 specimens" in result.stdout
    made = palpate.Calibration.load(tmp_path / "cord.toml")
    assert len(made.ratios) == used > 30
    assert (made.standard_errors > 0).all()
    assert made.accepted == set(MODEL)
    left_out = re.findall(r"^\w+: touch 1 of \S+ is left out: (.+)$", result.stderr, re.MULTILINE)
    assert len(left_out) == 60 - used
    assert result.stderr.count("; hard = ") == len(files)  # how each table was understood


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["--by", "luck"], 2, "by: got 'luck'"),
        (["--plot", "p.jpeg"], 2, "plot: got 'p.jpeg'"),
        (["--scene", "moon"], 2, "scene: got 'moon'"),
        (["--unit", "parsec"], 2, "unit: got 'parsec'"),
        (["--free-soft-ratio"], 4, "got 3 specimens, allowed: 4 or more"),
    ],
)
def test_errors(folder: Path, tmp_path: Path, arguments: list[str], code: int, message: str) -> None:
    table = folder / "ten" / "moduli.csv"
    result = run("calibrate", *files(folder)[:3], "--moduli", table, "-o", tmp_path / "p.toml", *arguments)
    assert result.exit_code == code
    assert message in result.stderr
    assert "Traceback" not in result.output
    assert not (tmp_path / "p.toml").exists()


def test_wrong_files(folder: Path, tmp_path: Path) -> None:
    letter = tmp_path / "gel.csv"
    letter.write_text("Dear colleague\n")
    table = folder / "ten" / "moduli.csv"
    result = run("calibrate", letter, "--moduli", table, "-o", tmp_path / "p.toml")
    assert (result.exit_code, "no specimen has this name" in result.stderr) == (4, True)
    result = run("calibrate", *files(folder), "--moduli", letter, "-o", tmp_path / "p.toml")
    assert (result.exit_code, "no specimens found" in result.stderr) == (4, True)
    result = run("replay", folder / "gel" / "gel.csv", "--calibration", letter)
    assert (result.exit_code, "not a calibration" in result.stderr) == (4, True)
    again = run("simulate", "-o", folder / "ten")
    assert (again.exit_code, "already exists" in again.stderr) == (4, True)
    for text in ("gel", "gel=soft", "gel=-1", "a/b=1", "=1"):
        assert run("simulate", "-o", tmp_path / "x", "--object", text).exit_code == 2


WITHOUT = """
import importlib.abc, sys
class Without(importlib.abc.MetaPathFinder):
    def find_spec(self, name, path, target=None):
        if name == {package!r}:
            raise ModuleNotFoundError(name=name)
sys.meta_path.insert(0, Without())
from palpate.cli import main
main({arguments!r})
"""


@pytest.mark.parametrize("package", ["scipy", "matplotlib", "tomli_w"])
def test_a_missing_extra(folder: Path, tmp_path: Path, package: str) -> None:
    table = folder / "ten" / "moduli.csv"
    paths = ["--moduli", table, "-o", tmp_path / "p.toml", "--plot", tmp_path / "p.png"]
    arguments = ["calibrate", *map(str, [*files(folder)[:4], *paths])]
    code = WITHOUT.format(package=package, arguments=arguments)
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 6, done.stderr
    assert done.stderr.splitlines()[-1] == f"Error: {package} is not installed; type: pip install 'palpate[science]'"
