"""On the command line: simulate, calibrate, and replay with a calibration."""

import re
import shutil
from pathlib import Path

import palpate
import pytest
from command_lines import document, run
from palpate.calibration.specimen_files import read_moduli
from palpate.materials import KnownModulus
from palpate.recording import sidecar
from palpate.recording.session import Entry, Plan
from project import FOUR, made_once
from report_session import recorded, softened, specimens


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Ten specimens by four touches, an eleventh object, and the calibration."""
    return made_once(tmp_path_factory, "report", recorded)


def values(printed: str) -> int:
    """Return how many touches a calibration used."""
    [found] = re.findall(r"specimens, (\d+) values", printed)
    return int(found)


def test_the_session(folder: Path, tmp_path: Path) -> None:
    written = ("-o", tmp_path / "probe.toml", "--plot", tmp_path / "probe.png")
    result = run(
        "calibrate", *specimens(folder), "--moduli", folder / "ten" / "moduli.csv", *written
    )
    lines = result.stdout.splitlines()
    assert lines[0].split()[:3] == ["specimen", "MPa", "touches"]
    assert [line.split()[:3] for line in lines[1:3]] == [
        ["30", "OO", "0.143"],
        ["40", "OO", "0.186"],
    ]
    assert lines[11].split() == ["rises", "yes", "yes", "yes", "yes"]
    assert lines[-1].startswith("The curve fits. 10 specimens, ")
    # the gauges are not quite linear: some touches have the flag "curve"
    assert 36 <= values(lines[-1]) <= 40
    for name, true in {"rigid_ratio": 10.0, "half_modulus": 2.0}.items():
        [(low, high)] = re.findall(
            rf"^{name} .*?([\d.]+) to ([\d.]+)", "\n".join(lines), re.MULTILINE
        )
        assert float(low) < true < float(high)
    assert (tmp_path / "probe.png").read_bytes().startswith(b"\x89PNG")


def test_replay_adds_the_modulus(folder: Path) -> None:
    plain = run("replay", folder / "gel" / "gel.csv").stdout.splitlines()
    given = ("replay", folder / "gel" / "gel.csv", "--calibration", folder / "probe.toml")
    result = run(*given)
    assert (result.exit_code, result.stderr.split(": ", 1)[1]) == (
        0,
        "simulated: no probe was used\n",
    )
    lines = result.stdout.splitlines()
    assert len(lines) == len(plain) + 2 == 7
    for before, after in zip(plain, lines, strict=False):
        assert after.split()[:3] == before.split()[:3]
        assert len(after) <= 80
    assert lines[1].split()[3:6] == ["4.15", "±", "0.12"]
    for touch in document(*given)["touches"]:  # which the narrow table leaves out
        assert touch["uncertainty_from"] == "calibration"
        assert touch["covariance"] > 0
    assert lines[5].startswith("mean of 4 touches: 4.20")
    assert re.fullmatch(
        r"The intervals are of 95 %, and include the scatter from touch to touch \(2\.\d %\)\.",
        lines[6],
    )
    [(low, high)] = re.findall(r"one object: [\d.]+ MPa \(([\d.]+) to ([\d.]+)\)", lines[5])
    assert float(low) < 1.1 < float(high)


def test_replay_adds_the_trend_below_the_mean(folder: Path, tmp_path: Path) -> None:
    given = ("replay", softened(tmp_path), "--calibration", folder / "probe.toml")
    mean, trend, intervals = run(*given).stdout.splitlines()[-3:]
    assert mean.startswith("mean of 4 touches: 4.02")
    assert "if all are on one object: 1.0" in mean
    assert trend.startswith("the ratio falls by 7.1 % from the first touch to the last (trend, ")
    assert intervals.startswith("The intervals are of 95 %")
    found = document(*given)
    assert found["agreement"]["trend"]["change"] == pytest.approx(-0.071, abs=0.003)
    assert "trends" not in found


def test_an_object_beyond_and_touches_on_several_objects(folder: Path, tmp_path: Path) -> None:
    run("simulate", "-o", tmp_path, "--object", "steel=200000", "--touches", "1")
    probe = ("--calibration", folder / "probe.toml")
    steel = run("replay", tmp_path / "steel.csv", *probe).stdout
    assert re.search("stiffer than.*beyond the calibrated moduli", steel)
    found = document("replay", tmp_path / "steel.csv", *probe)
    assert (found["touches"][0]["modulus"]["high_MPa"], found["modulus_of_mean"]) == (None, None)
    several = document("replay", FOUR, *probe)
    assert (several["agreement"]["agree"], several["modulus_of_mean"]) == (False, None)


def test_doubts_of_a_calibration_are_told(folder: Path, tmp_path: Path) -> None:
    """Another scene; rows that were changed, wherever the calibration is used."""
    gel = folder / "gel" / "gel.csv"
    other = run("replay", gel, "--scene", "paper", "--calibration", folder / "probe.toml")
    assert (other.exit_code, "with scene handheld, but this is scene paper" in other.stderr) == (
        0,
        True,
    )
    shutil.copytree(folder / "ten", tmp_path / "ten")
    changed = specimens(tmp_path)[0]
    changed.write_bytes(changed.read_bytes().replace(b",0\n", b",1\n", 1))
    probe = tmp_path / "probe.toml"
    assert (
        run(
            "calibrate",
            *specimens(tmp_path),
            "--moduli",
            tmp_path / "ten" / "moduli.csv",
            "-o",
            probe,
        ).exit_code
        == 5
    )
    result = run("replay", gel, "--calibration", probe)
    assert (
        "was made from recordings that were not as written, so the moduli may be wrong"
        in result.stderr
    )
    assert f"{changed.name}: the rows were changed" in result.stderr


def test_calibrate_as_json(folder: Path, tmp_path: Path) -> None:
    options = ("--by", "covariance", "--scene", "paper", "-o", tmp_path / "p.toml")
    found = document(
        "calibrate", *specimens(folder), "--moduli", folder / "ten" / "moduli.csv", *options
    )
    assert (found["sound"], found["about"]) == (True, {"scene": "paper", "fitted on": "covariance"})
    assert [len(each) for each in (found["specimens"], found["data"]["ratios"])] == [10, 10]
    assert found["specimens"][0]["smallest error"] is None  # the scene has no standard error


def test_a_calibration_that_is_not_to_be_relied_on(folder: Path, tmp_path: Path) -> None:
    moduli = tmp_path / "moduli.csv"
    moduli.write_text((folder / "ten" / "moduli.csv").read_text().replace("30 A,0.87", "30 A,5.0"))
    result = run("calibrate", *specimens(folder), "--moduli", moduli, "-o", tmp_path / "p.toml")
    assert (result.exit_code, "not reliable" in result.stdout, (tmp_path / "p.toml").exists()) == (
        5,
        True,
        True,
    )
    later = run("replay", folder / "gel" / "gel.csv", "--calibration", tmp_path / "p.toml")
    assert (later.exit_code, "calibration: This calibration is not reliable." in later.stderr) == (
        5,
        True,
    )
    moduli.write_text((folder / "ten" / "moduli.csv").read_text().replace("modulus_MPa", "modulus"))
    assumed = run("calibrate", *specimens(folder), "--moduli", moduli, "-o", tmp_path / "q.toml")
    assert (
        f"{moduli}: no unit of the moduli is named in its first line, MPa is assumed\n"
        in assumed.stderr
    )


@pytest.fixture(scope="module")
def wrong_moduli(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a table of moduli that are 12 % wrong, by turns too large and too small."""
    table = tmp_path_factory.mktemp("moduli") / "moduli.csv"
    rows = ["specimen,modulus_MPa"]
    for number, (name, known) in enumerate(read_moduli(folder / "ten" / "moduli.csv").items()):
        factor = 1.12 if number % 2 else 1 / 1.12
        rows.append(f"{name},{known.modulus * factor}")
    table.write_text("\n".join(rows))
    return table


def test_a_stated_uncertainty_of_the_moduli(
    folder: Path, wrong_moduli: Path, tmp_path: Path
) -> None:
    line: list[str | Path] = ["calibrate", *specimens(folder), "--moduli", wrong_moduli]
    line += ["-o", tmp_path / "p.toml"]
    unstated = run(*line)
    assert unstated.exit_code == 5
    [needed] = re.findall(r"uncertainty of the moduli of (\S+ %) would explain", unstated.stdout)
    assert "state it (--moduli-uncertainty)" in unstated.stdout
    report = ("--report", tmp_path / "p.html")
    stated = run(*line, "--force", "--moduli-uncertainty", needed, *report)
    assert stated.exit_code == 0
    assert "the stated uncertainty of the moduli" in stated.stdout
    header, first, *_ = stated.stdout.splitlines()
    assert "u(E), k = 1" in header
    assert needed in first
    file = palpate.Calibration.load(tmp_path / "p.toml")
    share = float(needed.removesuffix(" %")) / 100
    assert set(file.modulus_uncertainties.tolist()) == {share}
    assert file.about.notes == {"uncertainty of moduli": f"{needed} where none was stated (k = 1)"}
    page = (tmp_path / "p.html").read_text()
    assert "u(E), %" in page
    assert "where none was stated" in page


def test_the_uncertainties_of_a_table_come_before_the_option(folder: Path, tmp_path: Path) -> None:
    table = tmp_path / "moduli.csv"
    rows = (folder / "ten" / "moduli.csv").read_text().splitlines()
    rows[0] += ',"u, %"'
    rows[1] += ",2"
    table.write_text("\n".join(rows))
    out = tmp_path / "p.toml"
    line: list[str | Path] = ["calibrate", *specimens(folder), "--moduli", table, "-o", out]
    assert run(*line, "--moduli-uncertainty", "4%").exit_code == 0
    found = palpate.Calibration.load(out)
    softest = found.moduli == found.moduli.min()
    assert set(found.modulus_uncertainties[softest].tolist()) == {0.02}
    assert set(found.modulus_uncertainties[~softest].tolist()) == {0.04}
    table.write_text("\n".join([rows[0], *[f"{row},2" for row in rows[2:]]]))
    unused = run(*line[:-2], "-o", tmp_path / "q.toml", "--moduli-uncertainty", "4%")
    assert "--moduli-uncertainty 4 %: not used: each modulus has its own" in unused.stderr


@pytest.mark.parametrize("text", ["0.05", "5", "5 MPa", "100%", "-1%"])
def test_an_uncertainty_without_a_percent_sign_is_refused(
    folder: Path, tmp_path: Path, text: str
) -> None:
    table = folder / "ten" / "moduli.csv"
    options: list[str | Path] = ["--moduli", table]
    options += ["-o", tmp_path / "p.toml", f"--moduli-uncertainty={text}"]
    refused = run("calibrate", *specimens(folder), *options)
    assert refused.exit_code == 2
    assert f"got '{text}', allowed: a standard uncertainty in per cent" in refused.stderr
    assert not (tmp_path / "p.toml").exists()


def test_shore_hardnesses_in_place_of_moduli(folder: Path, tmp_path: Path) -> None:
    table = tmp_path / "moduli.csv"
    text = (folder / "ten" / "moduli.csv").read_text()
    table.write_text(text.replace("50 A,2.18", "50 A,50 A"))
    out = tmp_path / "p.toml"
    line: list[str | Path] = ["calibrate", *specimens(folder), "--moduli", table]
    found = run(*line, "-o", out, "--report", tmp_path / "p.html")
    assert found.exit_code == 0
    assert "50 A: 50 Shore A is taken as 2.46 MPa +-21 % (k = 1)\n" in found.stderr
    sentence = "Shore A is converted to a modulus by Gent's relation, with a standard uncertainty"
    assert sentence in found.stderr
    file = palpate.Calibration.load(out)
    assert file.about.notes["moduli"].startswith(sentence)
    assert file.about.notes["moduli"].endswith(": 50 A has 50")
    page = (tmp_path / "p.html").read_text()
    assert "with a standard uncertainty of 20 %" in page
    known = KnownModulus.of_shore_a(50.0)
    rows = file.moduli == known.modulus
    assert set(file.modulus_uncertainties[rows].tolist()) == {known.own}
    assert set(file.common_uncertainties[rows].tolist()) == {known.common}
    assert set(file.common_uncertainties[~rows].tolist()) == {0.0}
    table.write_text(text.replace("50 OO,0.289", "50 OO,50 OO"))
    refused = run(*line, "-o", tmp_path / "q.toml")
    assert refused.exit_code == 4
    assert "no relation between Shore OO and the modulus is known here" in refused.stderr


def test_specimens_without_a_recording_and_touches_with_a_flag(
    folder: Path, tmp_path: Path
) -> None:
    table, probe = folder / "ten" / "moduli.csv", tmp_path / "p.toml"
    few = run("calibrate", *specimens(folder)[:7], "--moduli", table, "-o", probe)
    assert few.stderr.count("the specimen is left out") == 3
    assert "7 specimens, " in few.stdout
    assert values(few.stdout) == 28 - few.stderr.count(" is left out: ") >= 25
    short = ["--samples", "400", "--scene", "paper", "--force"]
    flagged = run("calibrate", *specimens(folder), "--moduli", table, "-o", probe, *short)
    reason = "short, below 16 samples or without a standard error"
    assert (flagged.exit_code, "got none with a usable touch" in flagged.stderr) == (4, True)
    assert f"30 OO: touch 4 of 30OO.csv is left out: {reason}\n" in flagged.stderr
    short += ["--accept", "short", "--accept", "gap"]
    accepted = run("calibrate", *specimens(folder), "--moduli", table, "-o", probe, *short)
    assert (accepted.exit_code, accepted.stderr) == (
        0,
        "--accept gap: no touch has this flag; those found: short\n",
    )
    assert palpate.Calibration.load(probe).about.accepted_flags == ("short", "gap")


def test_a_touch_that_was_left_out_in_the_page_leaves_the_others(
    folder: Path, tmp_path: Path
) -> None:
    """Its sidecar has touches without a specimen: the name of the file still names it, and flags can be accepted."""
    shutil.copytree(folder / "ten", tmp_path / "ten")
    path = tmp_path / "ten" / "40A.csv"
    first, second, *_ = palpate.touches(path)
    left_out = Plan(
        touches=(Entry(first.start_s, None, "discarded"), Entry(second.start_s, None, None))
    )
    sidecar.amend(path, left_out, Plan())
    printed = run(
        "calibrate",
        *specimens(tmp_path),
        "--moduli",
        folder / "ten" / "moduli.csv",
        "-o",
        tmp_path / "p.toml",
    )
    assert "10 specimens, " in printed.stdout
    assert "40 A: touch 1 of 40A.csv is left out: discarded" in printed.stderr


MODEL = ("offset", "drift", "lag", "curve", "creep")


def test_the_cord(recordings: Path, tmp_path: Path) -> None:
    """Real touches, all of them short: a calibration that eq. (2) does not describe is written, and named unreliable."""
    moduli = {"m": 0.07, "l": 4.2, "ca": 4.6, "h": 12.8}  # a cord has none: these follow eq. (2)
    (tmp_path / "moduli.csv").write_text(
        "place,MPa\n" + "".join(f"{name},{E}\n" for name, E in moduli.items())
    )
    files = [tmp_path / f"{name}-{number}.csv" for name in moduli for number in range(1, 16)]
    for file in files:
        shutil.copy(recordings / "cord" / file.name.replace("-", ""), file)
    options = [
        "--map",
        "soft=4,hard=8",
        "--free-soft-ratio",
        *(f"--accept={flag}" for flag in MODEL),
    ]
    result = run(
        "calibrate",
        *files,
        "--moduli",
        tmp_path / "moduli.csv",
        *options,
        "-o",
        tmp_path / "cord.toml",
    )
    assert (result.exit_code, "This calibration is not reliable. 4 specimens" in result.stdout) == (
        5,
        True,
    )
    calibration = palpate.Calibration.load(tmp_path / "cord.toml")
    left_out = re.findall(r": touch 1 of \S+ is left out: ", result.stderr)
    assert len(calibration.ratios) == 60 - len(left_out) > 30
    assert (calibration.standard_errors > 0).all()
    assert calibration.accepted == set(MODEL)


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["--by", "luck"], 2, "by: got 'luck'"),
        (["--plot", "p.jpeg"], 2, "plot: got 'p.jpeg'"),
        (["--free-soft-ratio"], 4, "got 3 specimens, allowed: 4 or more"),
    ],
)
def test_errors(
    folder: Path, tmp_path: Path, arguments: list[str], code: int, message: str
) -> None:
    table = folder / "ten" / "moduli.csv"
    result = run(
        "calibrate",
        *specimens(folder)[:3],
        "--moduli",
        table,
        "-o",
        tmp_path / "p.toml",
        *arguments,
    )
    assert result.exit_code == code
    assert message in result.stderr
    assert not (tmp_path / "p.toml").exists()


@pytest.mark.parametrize("text", ["gel=soft", "gel=-1", "a/b=1", "=1"])
def test_an_object_that_is_none(text: str, tmp_path: Path) -> None:
    assert run("simulate", "-o", tmp_path / "x", "--object", text).exit_code == 2


def test_touches_under_a_wrong_specimen_are_named(folder: Path, tmp_path: Path) -> None:
    shutil.copytree(folder / "ten", tmp_path / "ten")
    for suffix in ("csv", "json"):
        soft, stiff = (tmp_path / "ten" / f"{name}.{suffix}" for name in ("30OO", "50A"))
        soft.rename(tmp_path / "ten" / f"kept.{suffix}")
        stiff.rename(soft)
        (tmp_path / "ten" / f"kept.{suffix}").rename(stiff)
    moduli = tmp_path / "ten" / "moduli.csv"
    result = run("calibrate", *specimens(tmp_path), "--moduli", moduli, "-o", tmp_path / "p.toml")
    assert result.exit_code in (4, 5)
    assert "30 OO and 50 A seem to be exchanged\n" in result.stderr
