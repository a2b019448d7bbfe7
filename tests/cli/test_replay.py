"""`palpate replay`: of one recording and of several; its output, exit codes and messages."""

import importlib
from pathlib import Path
from typing import Any

import numpy as np
import palpate
import pytest
from command_lines import document, run
from palpate import Uncertainty, number_format
from palpate.recording.session import Entry, Plan
from palpate.simulation import scenarios
from project import FOUR, copied
from report_session import change, softened

replay = importlib.import_module("palpate.cli.replay")
MAP = ("--map", "hard=3,soft=4,time=1,soft_time=2")


def table(folder: Path, name: str, unit: str = "pF", *, from_s: float = 0.0) -> Path:
    """Write a table of a simulated scenario, as another logger would."""
    simulated, path = scenarios.run(name, seed=1), folder / f"{name}.csv"
    rows = zip(simulated.t_hard_s, simulated.t_soft_s, simulated.hard, simulated.soft, strict=True)
    factor, limit = (1e3 if unit == "fF" else 1.0), simulated.full_scale_pF
    lines = [f"time (s),soft time (s),hard ({unit}),soft ({unit})"]
    for t, u, *pair in (map(float, row) for row in rows):
        cells = ["" if abs(each) >= limit else repr(factor * each) for each in pair]
        lines += [",".join([f"{t:.9f}", f"{u:.9f}", *cells])] * (t >= from_s)
    path.write_text("\n".join(lines) + "\n")
    return path


def test_one_row_a_touch_or_one_document() -> None:
    head, *lines = run("replay", FOUR).stdout.splitlines()
    assert (
        " ".join(head.split())
        == "touch start_s samples ratio ± uncertainty (k=1) covariance alarm result flags"
    )
    touches = palpate.touches(palpate.read(FOUR))
    for line, touch in zip(lines, touches, strict=True):
        assert line.split()[1:7] == [
            f"{touch.start_s:.3f}",
            str(touch.samples),
            *str(Uncertainty.of(touch)).split(),
        ]
    found = document("replay", FOUR, "--scene", "paper")
    touches = palpate.touches(palpate.read(FOUR), scene="paper")
    assert (found["scene"], found["rows"]) == ("paper", 1411)
    none: dict[str, Any] = {
        "flags": [],
        "advice": [],
        "uncertainty": None,
        "uncertainty_from": "assumed",
    }
    assert found["touches"] == [touch.as_dict() | none for touch in touches]


def test_a_trend_over_the_touches_has_a_sentence(tmp_path: Path) -> None:
    """By specimen, if the session names them; four objects whose ratios rise show none."""
    path = softened(tmp_path)
    sentence = "the ratio falls by 7.1 % from the first touch to the last (trend, p = 0.006)"
    assert run("replay", path).stdout.splitlines()[-1].startswith(f"all touches: {sentence}")
    [trend] = document("replay", path)["trends"]
    assert (trend["specimen"], round(trend["change"], 3)) == (None, -0.071)
    assert "trends" not in document("replay", FOUR)
    touches = palpate.touches(palpate.read(path))
    entries = [Entry(touch.start_s, "gel") for touch in touches]
    for left_out, is_shown in (("", True), ("slipped", False)):
        entries[0] = Entry(touches[0].start_s, "gel", left_out)
        change(path, {"session": Plan(touches=tuple(entries)).as_dict()})
        assert (f"gel: {sentence}" in run("replay", path).stdout) is is_shown


def test_windows_are_touches() -> None:
    found = document("replay", FOUR, "--window", "3:7.5", "--window", "12.0:16")
    assert found["windows"] == [[3.0, 7.5], [12.0, 16.0]]
    cut = palpate.touches(FOUR, windows=[(3.0, 7.5), (12.0, 16.0)])
    assert [touch["ratio"] for touch in found["touches"]] == [touch.ratio for touch in cut]
    for wrong, text in (("3", "BEGIN:END"), ("3:x", "BEGIN:END"), ("8.9:9.9", "nothing rises")):
        done = run("replay", FOUR, "--window", wrong)
        assert (done.exit_code, text in done.stderr) == (2, True)
    assert "allowed one of them" in run("replay", FOUR, "--window", "3:7", "--offline").stderr
    assert (
        "recordings, allowed: with one FILE"
        in run("replay", FOUR, FOUR.parent, "--window", "3:7").stderr
    )


def test_offline_shows_its_method_and_the_live_result_beside(tmp_path: Path) -> None:
    found = palpate.offline(palpate.read(FOUR))
    head, *lines, last = run("replay", FOUR, "--offline").stdout.splitlines()
    assert " ".join(head.split()) == "touch start_s samples ratio std. error live std. error flags"
    assert (
        last == "touch 1, 2, 3, 4: offline: matched pair of 5 + 6 points, baseline before and after"
    )
    for line, touch in zip(lines, found, strict=True):
        live = touch.live
        assert line.split()[3] == number_format.number(touch.ratio, touch.standard_error)
        assert line.split()[5] == number_format.number(live.ratio, live.standard_error)
    whole = document("replay", FOUR, "--offline")
    assert [record.pop("offline") for record in whole["touches"]] == [
        touch.as_dict() for touch in found
    ]
    assert whole == document("replay", FOUR)


def test_a_length_in_seconds_or_in_samples(tmp_path: Path) -> None:
    def samples(*options: str | Path) -> list[int]:
        return [touch["samples"] for touch in document("replay", *options)["touches"]]

    assert all(abs(n - 2 / 0.026) < 3 for n in samples(FOUR, "--touch-seconds", "2"))
    assert samples(FOUR, "--samples", "70") == samples(FOUR, "--set", "samples=70") == [70] * 4
    both = run("replay", FOUR, "--samples", "70", "--touch-seconds", "2")
    assert (both.exit_code, "allowed: only one of them" in both.stderr) == (2, True)
    untimed = tmp_path / "untimed.csv"
    untimed.write_text(
        "".join(",".join(line.split(",")[5:7]) + "\n" for line in FOUR.read_text().splitlines())
    )
    columns = ("--map", "hard=1,soft=2")
    assert samples(untimed, *columns) == [250] * 4
    assert run("replay", untimed, *columns).stdout.splitlines()[1].split()[1] == "-"
    refused = run("replay", untimed, *columns, "--offline")
    assert (refused.exit_code, "without times, allowed: " in refused.stderr) == (2, True)


def test_a_baseline_measured_in_contact_is_noted(tmp_path: Path) -> None:
    message = run("replay", table(tmp_path, "four-specimens", from_s=4.0), *MAP).stderr
    assert "something was touched while the baseline was measured" in message
    assert "measured again (once)" in message


def presses(folder: Path, period_s: float, rows: tuple[int, ...]) -> Path:
    """Write a table of presses: numbers of rows idle, pressed, idle, ...; a period of 0: without times."""
    down = np.repeat(np.arange(len(rows)) % 2, rows)
    random, path = np.random.default_rng(1), folder / f"{period_s}.csv"
    t = period_s * np.arange(len(down))
    columns = [
        t,
        t + period_s / 2,
        *(4 + np.outer([0.75, 0.25], down) + 7e-5 * random.standard_normal((2, len(down)))),
    ]
    names = ["time (s)", "soft time (s)", "hard (pF)", "soft (pF)"]
    keep = slice(0 if period_s else 2, 4)
    np.savetxt(
        path, np.transpose(columns[keep]), delimiter=",", header=",".join(names[keep]), comments=""
    )
    return path


@pytest.mark.parametrize(
    ("period_s", "takes"),
    [
        (0.0, "32 pairs without contact"),
        (0.001, "32 pairs without contact, 0.8 s here"),
        (0.01, "32 pairs without contact, 0.32 s here"),
        (0.1, "10 pairs without contact, 1 s here"),
        (0.3, "5 pairs without contact, 1.5 s here"),
    ],
)
def test_a_pause_that_is_too_short_for_a_baseline_is_noted(
    period_s: float, takes: str, tmp_path: Path
) -> None:
    scale = 25 if period_s == 0.001 else 1
    short = 10 if period_s >= 0.1 else 20
    soon, late = (tuple(scale * n for n in (60, 60, pause, 60, 60)) for pause in (short, 170))
    message = (
        f"1 of 2 touches were followed too soon by the next one: a baseline takes {takes}; a drift"
    )
    assert message in run("replay", presses(tmp_path, period_s, soon)).stderr
    assert "too soon" not in run("replay", presses(tmp_path, period_s, late)).stderr


def test_a_touch_that_a_gap_cuts_was_not_followed_too_soon(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    recorded = run("record", "sim:four-specimens?seed=1&fault=sleep:3600@12", "-o", path)
    assert "slept for 1 h" in recorded.stderr
    assert "too soon" not in run("replay", path).stderr


def test_a_slow_recording_is_told_of_its_baseline_and_of_the_model(tmp_path: Path) -> None:
    short = presses(tmp_path, 0.1, (20, 40, 50, 40, 50))
    lost = run("replay", short, "--scene", "paper")
    assert lost.exit_code == 5
    assert "a baseline takes 32 pairs without contact, 3.2 s here" in lost.stderr
    pressed = run("replay", presses(tmp_path, 0.1, (3, 40)))
    assert "a baseline takes 10 pairs without contact, 1 s here" in pressed.stderr
    slow, fast = (
        run("replay", presses(tmp_path, period_s, (60, 60, 60))).stderr for period_s in (0.05, 0.03)
    )
    assert "1 of 1 touches: the model was not tested" in slow
    assert "the model was not tested" not in fast


@pytest.mark.parametrize(
    ("text", "code", "message"),
    [
        ("Dear colleague,\nhere are the data.\n", 4, ", line 1: not a recording: no row of numbers"),
        ("t,hard,soft\n" + "".join(f"{i / 40},OL,OL\n" for i in range(60)), 5, "a channel has no values"),
        ("t,hard,soft\n" + "".join(f"{i / 40},1.0,1.{i % 2}\n" for i in range(90)), 5, "no touch found: no change was above the idle noise"),
    ],
)  # fmt: skip
def test_a_file_without_touches(text: str, code: int, message: str, tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text(text)
    result = run("replay", tmp_path / "a.csv", "--map", "hard=2,soft=3,time=1", "--unit", "pF")
    assert (result.exit_code, result.stdout, message in result.stderr) == (code, "", True), (
        result.stderr
    )


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--map", "hard=1"], "columns: got hard, allowed: hard, soft"),
        (["--map", "hard=nothing,soft=2"], "got 'nothing', no column, allowed: one of 1 (seq)"),
        (["--scene", "moon"], "scene: got 'moon', allowed: fixed, paper, handheld, sliding"),
        (["--set", "clip"], "got 'clip', allowed: NAME=NUMBER"),
        (["--set", "clip=-1"], "clip: got -1.0, allowed: 1 to 100"),
        (["--offline", "--calibration", str(FOUR)], "allowed one of them"),
    ],
)
def test_usage_errors(arguments: list[str], message: str) -> None:
    result = run("replay", FOUR, *arguments)
    assert (result.exit_code, result.stdout, message in result.stderr) == (2, "", True), (
        result.stderr
    )


@pytest.fixture
def week(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Make recordings in two folders below another one, with all that is not a recording beside them."""
    monkeypatch.chdir(tmp_path)
    for name in ("b.csv", "a.csv", "tuesday/c.CSV"):
        copied(Path("week") / name)
    for name in (
        "b.torn",
        "b.csv.unrepaired",
        "b.json.unrepaired",
        ".d.csv",
        "moduli.csv",
        "notes.md",
    ):
        (Path("week") / name).write_text("no recording")
    copied(Path("week/.ipynb_checkpoints/a-checkpoint.csv"))
    Path("week/a-folder.csv").mkdir()
    return Path("week")


def files(*arguments: str | Path) -> list[str]:
    return [Path(each["file"]).as_posix() for each in document("replay", *arguments)]


def test_folders_and_patterns_stand_for_the_recordings_in_them(week: Path) -> None:
    below = ["week/a.csv", "week/b.csv", "week/tuesday/c.CSV"]
    for pattern in (week, "week/**.[cC][sS][vV]", "week/**/*.[cC]*"):
        assert files(pattern) == below
    assert files("week/*") == below[:2]
    assert files(week.resolve() / "?.csv") == [str(week.resolve() / n) for n in ("a.csv", "b.csv")]
    assert files("week/b.csv", "week", "week/tuesday") == [below[1], below[0], below[2]]
    assert files("week/a.*") == ["week/a.csv"]  # a pattern is a list, also of one
    none = run("replay", "nothing*.csv", week)
    assert none.exit_code == 4
    assert "nothing*.csv: no recording there, allowed: a folder or pattern" in none.stderr
    (week / "a.csv").rename("run[1].csv")
    assert document("replay", "run[1].csv")["file"] == "run[1].csv"


@pytest.mark.parametrize("jobs", ["1", "3"])
def test_the_rows_and_documents_are_those_of_each_file(week: Path, jobs: str) -> None:
    head, *rows = run("replay", FOUR).stdout.splitlines()
    result = run("replay", week, "--jobs", jobs)
    assert (result.exit_code, result.stderr) == (
        0,
        f"{Path('week/a.csv')}: simulated: no probe was used\n",
    )
    names = ("week/a.csv", "week/b.csv", "week/tuesday/c.CSV")
    expected = [f"{Path(name)!s:18}  {row}" for name in names for row in rows]
    assert result.stdout.splitlines() == [f"{'file':18}  {head}", *expected]
    options = ("--scene", "paper", "--set", "threshold=0.1")
    one = document("replay", "week/a.csv", *options)
    assert document("replay", week, *options, "--jobs", jobs)[:2] == [
        one,
        one | {"file": str(Path("week/b.csv"))},
    ]


def test_sentences_stand_below_with_the_file_and_how_tables_are_read_once(tmp_path: Path) -> None:
    paths = [table(tmp_path, name, "fF") for name in ("tremor", "not-level")]
    shown, alone = run("replay", *paths, *MAP), [run("replay", path, *MAP) for path in paths]
    below = [
        f"{path}: {line}"
        for path, one in zip(paths, alone, strict=True)
        for line in one.stdout.splitlines()[2:]
    ]
    assert shown.stdout.splitlines()[3:] == below != []
    understood = alone[0].stderr.splitlines()[0].partition(": ")[2]
    assert (shown.stderr.count(understood), shown.exit_code) == (1, 0)


def test_a_bad_file_does_not_stop_the_others(week: Path) -> None:
    (week / "aa.csv").write_text("Dear colleague,\nhere are the data.\n")
    rows = [f"{t / 40},1.0,1.{t % 2}\n" for t in range(90)]
    (week / "idle.csv").write_text("".join(["t (s),hard (pF),soft (pF)\n", *rows]))
    result = run("replay", week, week / "none.csv", "--jobs", "2")
    assert result.exit_code == 4
    message = [
        f"Error: {week / 'aa.csv'}, line 1: not a recording",
        f"{week / 'idle.csv'}: no touch found: ",
        "none.csv",
    ]
    assert all(text in result.stderr for text in message), result.stderr
    assert ["error" in each for each in document("replay", week, week / "none.csv")].count(
        True
    ) == 2
    assert run("replay", week / "a.csv", week / "idle.csv").exit_code == 5
    wrong = run("replay", week / "a.csv", week / "b.csv", "--set", "smalest_shift=1")
    assert (
        wrong.exit_code,
        wrong.stdout,
        wrong.stderr.count("did you mean 'smallest_shift'?"),
    ) == (
        4,
        "",
        2,
    )


@pytest.mark.parametrize("jobs", ["1", "3"])
def test_ctrl_c_prints_what_is_done(week: Path, jobs: str, monkeypatch: pytest.MonkeyPatch) -> None:
    recorded = replay.recorded

    def stopped(file: Path, **options: Any) -> Any:
        if file.name == "c.CSV":
            raise KeyboardInterrupt
        return recorded(file, **options)

    monkeypatch.setattr(replay, "recorded", stopped)
    result = run("replay", week, "--jobs", jobs)
    assert (result.exit_code, len(result.stdout.splitlines())) == (130, 1 + 2 * 4)
    assert result.stderr.endswith("\n2 of 3 recordings are done\ninterrupted\n")
