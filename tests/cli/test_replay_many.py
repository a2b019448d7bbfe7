"""`palpate replay` of several files, folders and patterns; and Ctrl-C in the middle."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner, Result
from palpate.cli import main
from palpate.simulation import scenarios
from project import ROOT

FOUR = ROOT / "tests" / "data" / "four-specimens.csv"
posix = pytest.mark.skipif(not hasattr(os, "fork"), reason="no such signals on this system")


def run(*arguments: str | Path) -> Result:
    return CliRunner().invoke(main, [str(a) for a in arguments])


def own(path: Path) -> Path:
    """Copy a recording of palpate, with its sidecar."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(FOUR.read_bytes())
    path.with_suffix(".json").write_bytes(FOUR.with_suffix(".json").read_bytes())
    return path


def table(path: Path, name: str, unit: float = 1.0) -> Path:
    """Write a simulated scenario as a table of another program."""
    simulated = scenarios.run(name, seed=1)
    rows = zip(simulated.t_hard_s, simulated.hard * unit, simulated.soft * unit, strict=True)
    path.parent.mkdir(exist_ok=True)
    path.write_text("t;x;y\n" + "".join(f"{t};{h!r};{s!r}\n" for t, h, s in (map(float, row) for row in rows)))
    return path


@pytest.fixture
def week(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Make recordings in two folders below another one, with all that is not a recording beside them."""
    monkeypatch.chdir(tmp_path)
    for name in ("b.csv", "a.csv", "tuesday/c.CSV"):
        own(Path("week") / name)
    for name in ("b.torn", "b.csv.unrepaired", "b.json.unrepaired", ".d.csv", "moduli.csv", "notes.md"):
        (Path("week") / name).write_text("no recording")
    own(Path("week/.ipynb_checkpoints/a-checkpoint.csv"))
    Path("week/a-folder.csv").mkdir()
    return Path("week")


def files(result: Result) -> list[str]:
    return [Path(document["file"]).as_posix() for document in json.loads(result.stdout)]


def test_folders_and_patterns_stand_for_the_recordings_in_them(week: Path) -> None:
    below = ["week/a.csv", "week/b.csv", "week/tuesday/c.CSV"]
    assert files(run("replay", week, "--json")) == below
    assert files(run("replay", "week/**.[cC][sS][vV]", "--json")) == below
    assert files(run("replay", "week/**/*.[cC]*", "--json")) == below
    assert files(run("replay", "week/*", "--json")) == below[:2]
    assert files(run("replay", week.resolve() / "?.csv", "--json")) == [
        str(week.resolve() / n) for n in ("a.csv", "b.csv")
    ]
    assert files(run("replay", "week/b.csv", "week", "week/tuesday", "--json")) == [below[1], below[0], below[2]]
    assert files(run("replay", "week/a.*", "--json")) == ["week/a.csv"]  # a pattern is a list, also of one


def test_a_name_with_brackets_is_a_name(week: Path) -> None:
    (week / "a.csv").rename("run[1].csv")
    assert json.loads(run("replay", "run[1].csv", "--json").stdout)["file"] == "run[1].csv"


@pytest.mark.parametrize("name", ["nothing*.csv", "week/.ipynb_checkpoints/*.txt"])
def test_a_pattern_without_a_recording_is_an_error(week: Path, name: str) -> None:
    result = run("replay", name, week)
    assert (result.exit_code, result.stdout) == (4, "")
    assert f"{name}: no recording there, allowed: a folder or pattern with tables" in result.stderr


@pytest.mark.parametrize("jobs", ["1", "3"])
def test_the_table_has_the_rows_of_each_file(week: Path, jobs: str) -> None:
    head, *rows = run("replay", FOUR).stdout.splitlines()
    result = run("replay", week, "--jobs", jobs)
    assert (result.exit_code, result.stderr) == (0, "")
    names = ("week/a.csv", "week/b.csv", "week/tuesday/c.CSV")
    expected = [f"{Path(name)!s:18}  {row}" for name in names for row in rows]
    assert result.stdout.splitlines() == [f"{'file':18}  {head}", *expected]


def test_the_documents_are_those_of_each_file(week: Path) -> None:
    options = ("--scene", "paper", "--set", "threshold=0.1", "--json")
    one = json.loads(run("replay", "week/a.csv", *options).stdout)
    assert isinstance(one, dict)
    [first, second, _] = json.loads(run("replay", week, *options, "--jobs", "2").stdout)
    assert first == one
    assert second == one | {"file": str(Path("week/b.csv"))}


def test_the_reading_options_hold_for_every_file_and_are_said_once(tmp_path: Path) -> None:
    paths = [table(tmp_path / f"{name}.csv", name, 1e3) for name in ("tremor", "not-level")]
    options = ("--map", "hard=x,soft=y,time=t", "--unit", "fF", "--time-unit", "s")
    result = run("replay", *paths, *options, "--json")
    ones = [json.loads(run("replay", path, *options, "--json").stdout) for path in paths]
    assert json.loads(result.stdout) == ones
    assert [len(one["touches"]) for one in ones] == [1, 1]
    shown = run("replay", *paths, *options)
    sentences = shown.stdout.splitlines()[3:]
    assert sentences
    assert sentences == [
        f"{path}: {line}" for path in paths for line in run("replay", path, *options).stdout.splitlines()[2:]
    ]
    [said] = {line.partition(": ")[2] for line in run("replay", paths[0], *options).stderr.splitlines()[:1]}
    assert (shown.stderr.count(said), shown.exit_code) == (1, 0)


def test_a_bad_file_does_not_stop_the_others(week: Path) -> None:
    (week / "aa.csv").write_text("Dear colleague,\nhere are the data.\n")
    table(week / "ab.csv", "tremor")
    result = run("replay", week, "--jobs", "2")
    rows = run("replay", FOUR).stdout.splitlines()[1:]
    assert result.exit_code == 4
    assert len(result.stdout.splitlines()) == 1 + 3 * len(rows)
    letter, open_table = result.stderr.splitlines()
    assert letter.startswith(f"Error: {week / 'aa.csv'}, line 1: not a recording")
    assert letter == run("replay", week / "aa.csv").stderr.strip()
    assert open_table.startswith(f"Error: {week / 'ab.csv'}: columns: got ")
    listed = run("replay", week, "--json")
    assert listed.exit_code == 4
    assert [sorted(document) == ["error", "file"] for document in json.loads(listed.stdout)] == [
        False,
        True,
        True,
        False,
        False,
    ]


def test_a_file_without_a_touch_is_said_and_in_the_code(week: Path) -> None:
    (week / "idle.csv").write_text(
        "t (s),hard (pF),soft (pF)\n" + "".join(f"{t / 40},1.0,1.{t % 2}\n" for t in range(90))
    )
    result = run("replay", week)
    assert result.exit_code == 5
    assert f"{week / 'idle.csv'}: no touch found: " in result.stderr
    assert [len(document["touches"]) for document in json.loads(run("replay", week, "--json").stdout)] == [4, 4, 0, 4]


def test_a_wrong_setting_is_said_once(week: Path) -> None:
    for arguments in (["--set", "treshold=6"], ["--scene", "moon"], ["--scene", "paper", "--set", "drift=-1"]):
        result = run("replay", week, *arguments)
        assert (result.exit_code, result.stdout, len(result.stderr.splitlines())) == (2, "", 1)
    result = run("replay", week, "--soft", FOUR)
    assert result.exit_code == 2
    assert "--soft: got it with 3 recordings, allowed: with one FILE" in result.stderr


def test_offline_and_calibration_have_the_column_too(week: Path, tmp_path: Path) -> None:
    one = run("replay", FOUR, "--offline").stdout.splitlines()
    lines = run("replay", week, "--offline").stdout.splitlines()
    assert [line[20:] for line in lines[1:5]] == one[1:5]
    assert lines[-1] == one[-1]  # the same for all files: once
    specimens = tmp_path / "specimens"
    assert run("simulate", "-o", specimens, "--seed", "1").exit_code == 0
    paths = sorted(specimens.glob("*O.csv"))
    calibration = tmp_path / "probe.toml"
    assert run("calibrate", *paths, "--moduli", specimens / "moduli.csv", "-o", calibration).exit_code in (0, 5)
    several = run("replay", paths[0], paths[1], "--calibration", calibration).stdout.splitlines()
    alone = run("replay", paths[1], "--calibration", calibration).stdout.splitlines()
    width = len(str(paths[1])) + 2
    assert [line[width:].split() for line in several[5:9]] == [line.split() for line in alone[1:5]]
    assert several[-1] == alone[-1]
    assert f"{paths[1]}: {alone[5]}" in several


SLOW = """
import os, sys, time
from palpate.cli import main, replaying
whole = replaying.replayed

def replayed(file, how, begin):
    found = whole(file, how, begin)
    if file.name > "f002":
        os.write(2, b"waiting\\n")
        time.sleep(0.3)
    return found

replaying.replayed = replayed
main(sys.argv[1:])
"""


@posix
@pytest.mark.parametrize("as_json", [False, True])
@pytest.mark.parametrize("jobs", ["1", "2"])
def test_ctrl_c_prints_what_is_done(tmp_path: Path, jobs: str, *, as_json: bool) -> None:
    count = 200  # would take 50 s or more
    for number in range(count):
        own(tmp_path / f"f{number:03}.csv")
    command = [sys.executable, "-c", SLOW, "replay", str(tmp_path), "--jobs", jobs, *(["--json"] if as_json else [])]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert process.stderr
    assert [process.stderr.readline() for _ in range(4)] == ["waiting\n"] * 4
    process.send_signal(signal.SIGINT)
    printed, told = process.communicate(timeout=60)
    assert process.returncode == 130
    *_, said, last = told.splitlines()
    done = int(said.split()[0])
    assert 1 <= done < count
    assert (said, last) == (f"{done} of {count} recordings are done", "interrupted")
    if as_json:
        assert [len(document["touches"]) for document in json.loads(printed)] == [4] * done
    else:
        assert len(printed.splitlines()) == 1 + 4 * done


def test_a_file_that_is_not_there_is_told_and_the_others_are_done(tmp_path: Path) -> None:
    good = own(tmp_path / "good.csv")
    result = run("replay", good, tmp_path / "goof.csv")
    assert result.exit_code == 4
    assert "goof.csv" in result.stderr
    assert result.stdout.count("good.csv") == 4
    assert run("replay", tmp_path / "goof.csv").exit_code == 4


def test_an_empty_name_is_refused() -> None:
    result = run("replay", "")
    assert (result.exit_code, "got an empty name" in result.stderr) == (2, True)
