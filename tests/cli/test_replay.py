"""The command line: output, exit codes, messages."""

import json
import subprocess
import sys
from pathlib import Path

import palpate
import pytest
from click.testing import CliRunner, Result
from palpate import digits
from palpate.cli import main
from palpate.simulation import scenarios
from project import ROOT

FOUR = ROOT / "tests" / "data" / "four-specimens.csv"


def run(*arguments: str | Path) -> Result:
    return CliRunner().invoke(main, [str(a) for a in arguments])


def foreign(folder: Path) -> Path:
    """Make the same touches as another logger would have written them."""
    rows = [line.split(",") for line in FOUR.read_text().splitlines()[1:]]
    path = folder / "foreign.csv"
    body = "".join(f"{t};{float(h) * 1e3:.4f};{float(s) * 1e3:.4f}\r\n" for _, t, _, _, _, h, s, _ in rows)
    path.write_bytes(("\ufeffDevice;7\r\n;Hard, left;Soft\r\nTime (s);C (fF);C (fF)\r\n" + body).encode())
    return path


def test_replay_prints_one_row_a_touch() -> None:
    result = run("replay", FOUR)
    assert result.exit_code == 0
    lines = result.stdout.splitlines()
    assert lines[0].split() == [
        "touch",
        "start_s",
        "samples",
        "ratio",
        "std.",
        "error",
        "covariance",
        "alarm",
        "result",
        "flags",
    ]
    assert len(lines) == 5
    touches = palpate.touches(palpate.read(FOUR))
    for line, touch in zip(lines[1:], touches, strict=True):
        assert line.split()[1:4] == [
            f"{touch.start_s:.3f}",
            str(touch.samples),
            digits.number(touch.ratio, touch.standard_error),
        ]


def test_replay_offline_shows_its_method_and_the_live_result_beside() -> None:
    found = palpate.offline(palpate.read(FOUR))
    lines = run("replay", FOUR, "--offline").stdout.splitlines()
    head = ["touch", "start_s", "samples", "ratio", "std.", "error", "live", "std.", "error", "flags"]
    assert lines[0].split() == head
    assert lines[-1] == "All touches: offline: matched pair of 5 + 6 points, baseline before and after."
    for line, touch in zip(lines[1:-1], found, strict=True):
        numbers = line.split()
        assert numbers[3] == digits.number(touch.ratio, touch.standard_error)
        assert numbers[5] == digits.number(touch.live.ratio, touch.live.standard_error)
    document = json.loads(run("replay", FOUR, "--offline", "--json").stdout)
    assert [record.pop("offline") for record in document["touches"]] == [touch.as_dict() for touch in found]
    assert document == json.loads(run("replay", FOUR, "--json").stdout)


def test_replay_offline_says_what_it_needs(tmp_path: Path) -> None:
    untimed = tmp_path / "untimed.csv"
    rows = [line.split(",") for line in FOUR.read_text().splitlines()[1:]]
    untimed.write_text("hard;soft\n" + "".join(f"{row[5]};{row[6]}\n" for row in rows))
    result = run("replay", untimed, "--map", "hard=1,soft=2", "--unit", "pF", "--offline")
    assert result.exit_code == 2
    assert "got one without times, allowed: one with times; name its column, as time=COL" in result.stderr
    calibrated = run("replay", FOUR, "--offline", "--calibration", FOUR)
    assert calibrated.exit_code == 2
    assert "allowed one of them" in calibrated.stderr


def test_replay_offline_gives_a_reason_for_no_result(tmp_path: Path) -> None:
    saturated = palpate.simulation.scenarios.run("saturating")
    path = tmp_path / "saturated.csv"
    columns = (saturated.t_hard_s, saturated.t_soft_s, saturated.hard, saturated.soft)
    limit = saturated.full_scale_pF
    body = "".join(
        f"{a:.6f};{b:.6f};{'' if abs(c) >= limit else f'{c:.7f}'};{d:.7f}\n"
        for a, b, c, d in zip(*columns, strict=True)
    )
    path.write_text("t_hard;t_soft;hard pF;soft pF\n" + body)
    result = run("replay", path, "--map", "time=1,soft_time=2,hard=3,soft=4", "--offline")
    assert result.exit_code == 0, result.stderr
    assert result.stdout.splitlines()[1].split()[3] == "-"
    assert "offline: none, too few pairs" in result.stdout.splitlines()[-1]


def test_replay_as_json_is_one_document_with_every_digit() -> None:
    document = json.loads(run("replay", FOUR, "--json", "--scene", "paper").stdout)
    touches = palpate.touches(palpate.read(FOUR), scene="paper")
    assert document["scene"] == "paper"
    assert document["rows"] == 1411 == len(FOUR.read_text().splitlines()) - 1
    assert [t["ratio"] for t in document["touches"]] == [t.ratio for t in touches]
    assert document["touches"][0] == touches[0].as_dict() | {"flags": [], "advice": []}


def test_a_foreign_table_gives_the_same_touches(tmp_path: Path) -> None:
    own = json.loads(run("replay", FOUR, "--json", "--scene", "paper").stdout)["touches"]
    for columns in ("hard=Hard, left,soft=Soft", "soft=3,hard=2", "time=1,hard=2,soft=Soft"):
        other = json.loads(run("replay", foreign(tmp_path), "--map", columns, "--json", "--scene", "paper").stdout)[
            "touches"
        ]
        assert [t["start_s"] for t in other] == [t["start_s"] for t in own]
        assert [t["ratio"] for t in other] == pytest.approx([t["ratio"] for t in own], rel=1e-5)


def test_settings_and_samples() -> None:
    document = json.loads(
        run(
            "replay",
            FOUR,
            "--json",
            "--scene",
            "paper",
            "--samples",
            "50",
            "--set",
            "threshold=inf",
            "--set",
            "drift=0.02",
        ).stdout
    )
    assert {(t["samples"], t["alarm_share"]) for t in document["touches"]} == {(50, 0.0)}


def test_no_times_are_null_and_a_dash(tmp_path: Path) -> None:
    path = tmp_path / "no_times.csv"
    lines = foreign(tmp_path).read_text(encoding="utf-8-sig").splitlines()[3:]
    path.write_text("a;b\n" + "\n".join(line.split(";", 1)[1] for line in lines) + "\n")
    assert (
        json.loads(run("replay", path, "--map", "hard=a,soft=b", "--unit", "fF", "--json").stdout)["touches"][0][
            "start_s"
        ]
        is None
    )
    assert run("replay", path, "--map", "hard=a,soft=b", "--unit", "fF").stdout.splitlines()[1].split()[1] == "-"


def test_a_recording_without_a_touch_says_so(tmp_path: Path) -> None:
    path = tmp_path / "idle.csv"
    path.write_text("\n".join(FOUR.read_text().splitlines()[:55]) + "\n")
    result = run("replay", path)
    assert (result.exit_code, result.stdout) == (5, "")
    assert "no touch found" in result.stderr
    assert "The channels span hard 0.000" in result.stderr
    result = run("replay", path, "--json")
    assert result.exit_code == 5
    assert json.loads(result.stdout)["touches"] == []


def test_a_channel_without_any_value_says_so(tmp_path: Path) -> None:
    path = tmp_path / "overload.csv"
    path.write_text("time,hard,soft\n" + "".join(f"{i / 40},OL,OL\n" for i in range(60)))
    result = run("replay", path, "--map", "hard=2,soft=3")
    assert result.exit_code == 5
    assert "60 of 60 rows have no value" in result.stderr
    assert "a channel has no values" in result.stderr


def test_what_is_not_a_recording(tmp_path: Path) -> None:
    path = tmp_path / "letter.csv"
    path.write_text("Dear colleague,\nhere are the data.\n")
    result = run("replay", path, "--map", "hard=1,soft=2")
    assert (result.exit_code, result.stdout) == (4, "")
    assert (
        result.stderr
        == f"Error: {path}, line 1: not a recording: no row of numbers; 'Dear colleague,' is not a number\n"
    )


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--map", "hard=1"], "columns: got hard, allowed: hard, soft"),
        (["--map", "x=1,hard=1,soft=2"], "allowed: hard=COL,soft=COL"),
        (["--map", "hard=nothing,soft=2"], "got 'nothing', allowed: 1 (seq)"),
        (["--unit", "parsec"], "unit: got 'parsec', allowed: aF"),
        (["--scene", "moon"], "scene: got 'moon', allowed: fixed, paper, handheld, sliding"),
        (["--set", "drift"], "got 'drift', allowed: NAME=NUMBER"),
        (["--set", "drift=-1"], "drift: got -1.0, allowed: 0 <= drift"),
        (["--map", "hard=1,soft=2,hard=3"], "each once"),
        (["--set", "colour=1"], "got an unexpected keyword 'colour', allowed: samples"),
        (["--samples", "0"], "0 is not in the range"),
        (["--colour"], "No such option"),
    ],
)
def test_usage_errors(arguments: list[str], message: str) -> None:
    result = run("replay", FOUR, *arguments)
    assert (result.exit_code, result.stdout) == (2, "")
    assert message in result.stderr
    assert "Traceback" not in result.stderr


def test_bench_knows_its_scenarios() -> None:
    result = run("bench", "--scenario", "moon")
    assert result.exit_code == 2
    assert "--scenario: got 'moon', allowed: soft-steady, " in result.stderr


def test_bench_prints_the_truth_beside_the_time() -> None:
    result = run("bench", "--seeds", "2")
    assert result.exit_code == 0
    rows = {tuple(line.split()[:3]): line.split() for line in result.stdout.splitlines() if "scene" in line}
    assert float(rows["tremor", "handheld", "scene"][3]) < float(rows["tremor", "paper", "scene"][3])


@pytest.mark.parametrize(("argument", "expected"), [("--version", palpate.__version__), ("--help", "replay")])
def test_version_and_help_need_no_numpy(argument: str, expected: str) -> None:
    code = f"""
import sys
sys.argv = ["palpate", "{argument}"]
try:
    import palpate.__main__
finally:
    assert "numpy" not in sys.modules
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert expected in done.stdout


def test_the_module_runs() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "palpate", "replay", str(FOUR)], capture_output=True, text=True, check=True
    )
    assert done.stdout == run("replay", FOUR).stdout


def simulated(folder: Path, name: str, *, from_s: float = 0.0) -> Path:
    """Write a table of a simulated scenario, as another logger would."""
    run, path = scenarios.run(name, seed=1), folder / f"{name}.csv"
    rows = zip(run.t_hard_s, run.t_soft_s, run.hard, run.soft, strict=True)
    lines = [f"{t:.9f},{ts:.9f},{h!r},{s!r}" for t, ts, h, s in (map(float, row) for row in rows) if t >= from_s]
    path.write_text("time (s),soft time (s),hard (pF),soft (pF)\n" + "\n".join(lines) + "\n")
    return path


MAP = ("--map", "hard=3,soft=4,time=1,soft_time=2")


def test_a_sentence_for_each_flag_stands_below_the_table_and_in_json(tmp_path: Path) -> None:
    path = simulated(tmp_path, "not-level")
    result = run("replay", path, *MAP)
    table, sentence = result.stdout.splitlines()[1:]
    assert table.endswith("revised  offset")
    assert sentence.startswith("touch 1: offset: the soft bump is reached 2.1 % of the mean depth before the hard one")
    [touch] = json.loads(run("replay", path, *MAP, "--json").stdout)["touches"]
    assert f"touch 1: {touch['advice'][0]}" == sentence
    assert (touch["flags"], touch["revised"], touch["effects"]["drift"] < 0.002) == (["offset"], True, True)
    assert touch["offset_ratio"] == pytest.approx(2.843, abs=0.002)


def test_a_baseline_measured_in_contact_is_noted(tmp_path: Path) -> None:
    path = simulated(tmp_path, "four-specimens", from_s=4.0)
    result = run("replay", path, *MAP)
    assert "the channels fell far below the baseline" in result.stderr
    assert "measured again (once)" in result.stderr
    notes = json.loads(run("replay", path, *MAP, "--json").stdout)["notes"]
    assert [note for note in notes if "fell far below the baseline" in note]


def test_a_length_in_seconds_or_in_samples(tmp_path: Path) -> None:
    def samples(*options: str) -> list[int]:
        return [t["samples"] for t in json.loads(run("replay", FOUR, "--json", *options).stdout)["touches"]]

    assert all(abs(n - 2 / 0.026) < 3 for n in samples("--touch-seconds", "2"))
    assert samples("--samples", "70") == samples("--set", "samples=70") == [70] * 4
    assert samples("--set", "seconds=2") == samples("--touch-seconds", "2")
    both = run("replay", FOUR, "--samples", "70", "--touch-seconds", "2")
    assert (both.exit_code, "allowed: only one of them" in both.stderr) == (2, True)
    untimed = tmp_path / "untimed.csv"
    untimed.write_text("\n".join(",".join(line.split(",")[5:7]) for line in FOUR.read_text().splitlines()) + "\n")
    columns = ("--map", "hard=1,soft=2")
    found = json.loads(run("replay", untimed, *columns, "--json").stdout)["touches"]
    assert [t["samples"] for t in found] == [250] * 4
    refused = run("replay", untimed, *columns, "--touch-seconds", "2")
    assert (refused.exit_code, "recording without times, allowed: samples" in refused.stderr) == (2, True)
