"""What a user reads: text from outside never reaches the terminal as control sequences; a table of mistakes, each with a way out."""

import json
import re
import shlex
from pathlib import Path

import pytest
from command_lines import run
from palpate import touches
from palpate.errors import SomeFailed
from project import FOUR, ROOT
from report_session import change

BAD = "\x1b]0;t\x07\x9b2J\u202e\r"  # a window title, a cleared screen, a changed direction, a line begun again


def test_no_control_sequence_from_outside_reaches_the_terminal(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    rows = "".join(f"{k / 40:.3f},{6.9 + k % 7 / 100},{4.6 + k % 5 / 100},x\n" for k in range(60))
    Path("a.csv").write_text(f"time (s),C{BAD}1 (pF),C{BAD}2 (pF),w{BAD}\n{rows}".replace("\r", ""))
    Path("b.csv").write_text(
        f"time (s),C1 (pF),C2 (pF)\n{rows.replace(',x', '')}0.9,6{BAD[:-1]},4\n"
    )
    week = Path(f"week{BAD}")
    week.mkdir()
    for name, text in {
        "good": FOUR.read_text(),
        "cut": FOUR.read_text()[:-9],
        "none": BAD,
        "table": rows,
    }.items():
        (week / f"{name}{BAD}.csv").write_text(text)
    own = week / f"own{BAD}.csv"
    assert run("record", "sim:step-up", "-o", own, "--note", BAD).exit_code == 0
    change(own, {"device": {"name": BAD, BAD: BAD}, "marks": [{"t_s": 1.0, "seq": 3, "text": BAD}]})
    Path("moduli.csv").write_text("name,MPa\n\u202egel,1\n")
    Path("palpate.toml").write_text(
        '[plot]\n"k\\u001b[2J" = "\\u202e"\n[devices]\nlsl = "\\u001b[2J"\n'
    )
    lines: list[list[str | Path]] = [
        *(["replay", name] for name in ("a.csv", "b.csv", week, f"none{BAD}.csv", f"{BAD}/*.csv", own)),
        ["replay", "a.csv", "--map", f"hard=C{BAD}1,soft=3"], ["import", "a.csv"], ["import", "b.csv"],
        ["import", "a.csv", "--map", "hard=2,soft=3"], ["check", *sorted(week.glob("*.csv")), "--repair"],
        ["convert", "a.csv", "--map", "hard=2,soft=3", "-o", f"c{BAD}.csv"], ["convert", own, "-o", f"{BAD}/c.csv"],
        ["convert", own, "-o", own], ["plot", own, "-o", f"c{BAD}.png"], ["devices"], ["report", own, "-o", f"r{BAD}.html"],
        ["calibrate", own, "--moduli", "moduli.csv", "-o", "p.toml"], ["record", f"sim:{BAD}", "-o", "r.csv"],
        ["record", str(own), "-o", f"again{BAD}.csv"], ["simulate", "-o", str(week), "--touches", "1"],
    ]  # fmt: skip
    for words in lines:
        done = run(*words)
        shown = (done.stdout + done.stderr).split("\n")
        assert [line for line in shown if not line.isprintable()] == [], words
        assert "".join(shown)


ERRORS = r"""
record                                                        2  palpate record --help
record sim:                                                   2  Missing option '-o'
record serial: -o r.csv                                       2  `palpate devices` lists the ports
record serial:/dev/ttyNo7 -o r.csv                            3  `palpate devices` lists the ports
record "serial:/dev/ttyNo7?baud=9k" -o r.csv                  2  allowed: a whole number from 50 to 4000000
record "serial:/dev/ttyNo7?columns=a,b" -o r.csv              2  names of all cells in order, as t_ms,hard,soft
record "serial:/dev/ttyNo7?pattern=(" -o r.csv                2  allowed: a regular expression
record usb: -o r.csv                                          3  `palpate doctor`.* sim: needs no board
record i2c: -o r.csv                                          2  for example i2c:/dev/i2c-1
record i2c:/dev/i2c-77 -o r.csv                               3  `sudo raspi-config`
record iio: -o r.csv                                          3  i2c:/dev/i2c-1
record ubs: -o r.csv                                          2  did you mean 'usb:'
record sim:four -o r.csv                                      2  allowed: soft-steady, stiff-steady
record sim:?sed=1 -o r.csv                                    2  did you mean 'seed'
record sim:?seed=x -o r.csv                                   2  allowed: a whole number from 0
record sim: -o four.csv                                       4  choose another name
record sim: -o none/r.csv                                     4  is no folder: make it, or name another one
record sim: -o r.txt                                          2  a name that ends in .csv
record sim: -o r.csv --seconds 1m                             2  '1m' is not a number: write it as 1.5, without a unit
record sim: -o r.csv --touches two                            2  'two' is not a whole number: write it as 3
record sim: -o r.csv --set clip                               2  allowed: NAME=NUMBER, for example smallest_shift=1
record sim: -o r.csv --set smalest_shift=1                    2  did you mean 'smallest_shift'
record sim: -o r.csv --scene papper                           2  did you mean 'paper'
record sim: -o r.csv --samples 5 --touch-seconds 1            2  allowed: only one of them
record sim: -o r.csv --lsl a:b                                2  allowed: a name without a colon
record lsl: -o r.csv                                          2  `palpate devices --lsl`
relay four.csv                                                2  did you mean 'replay'
replay                                                        2  Missing argument 'FILE...'
replay none.csv                                               4  No such file
replay ''                                                     2  allowed: a file, a folder or a pattern
replay empty                                                  4  allowed: a folder or pattern with tables
replay text.csv                                               4  no row of numbers
replay old.xls                                                4  save a .xls, .mat, .h5 or .npy as one of them
replay names.csv                                              2  --map hard=COL,soft=COL
replay names.csv --map hrad=2,soft=3                          2  hard=COL,soft=COL\[,time=COL\]
replay names.csv --map hard=2,soft=9                          2  allowed: one of 1 \(time
replay names.csv --map hard=2,soft=3 --unit pG                2  allowed: aF, fF, pF
replay names.csv --map hard=2,soft=3 --time-unit h            2  allowed: s, sec, ms
replay comma.csv                                              2  \(--decimal\)
replay stats.csv                                              4  take these rows out
replay four.csv --calibration four.csv                        4  not a calibration
replay four.csv --calibration p.toml --offline                2  allowed one of them
check                                                         2  palpate check --help
check four.csv --yes                                          2  allowed: both
import four.csv                                               2  allowed: a table of another program
convert four.csv                                              2  Missing option '-o'
convert four.csv -o r.xls                                     2  \.csv or \.parquet
plot four.csv -o r.gif                                        2  allowed: a name that ends in .png, .pdf, .svg
calibrate four.csv -o p2.toml                                 2  --moduli
calibrate four.csv --moduli none.csv -o p2.toml               4  No such file
calibrate four.csv --moduli text.csv -o p2.toml               4  text.csv
live sim: --port 70000                                        2  0<=x<=65535
live sim: --host 0.0.0.0 --no-token                           2  allowed
live names.csv --no-open --record r.csv                       2  with a source that measures
kit noise four.csv                                            2  allowed: usb:, i2c:, or sim: for a simulated board
kit nose                                                      2  did you mean 'noise'
simulate -o four.csv                                          4  four.csv
simulate -o new --object gel                                  2  gel=
doctor now                                                    2  palpate doctor --help
--config none.toml replay four.csv                            4  No such file
"""
"""A line, its exit code, and what the user can type or change, as a regular expression."""
CASES = [re.split(r" {2,}", line) for line in ERRORS.strip().splitlines()]


@pytest.fixture(scope="module")
def desk(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("desk")
    rows = "".join(f"{k / 40},{6.9 + k % 7 / 100},{4.6 + k % 5 / 100}\n" for k in range(60))
    files = {
        "four.csv": FOUR.read_text(),
        "text.csv": "shopping list\n",
        "old.xls": "\0\0",
        "names.csv": f"time (s),A,B\n{rows}",
        "stats.csv": f"Mean,Max,Min\ntime (s),C1,C2\n{rows}",
        "comma.csv": "C1;C2\n" + "6,901;4,612\n" * 60,
        "p.toml": (ROOT / "tests/fuzz/corpus/calibration/probe.toml").read_text(),
    }
    for name, text in files.items():
        (folder / name).write_text(text)
    (folder / "empty").mkdir()
    return folder


@pytest.mark.parametrize(("line", "code", "way_out"), CASES, ids=[line for line, *_ in CASES])
def test_a_mistake_is_one_line_with_a_way_out(
    line: str, code: str, way_out: str, desk: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(desk)
    before = sorted(desk.rglob("*"))
    done = run(*shlex.split(line))
    assert (done.exit_code, done.exception.__class__) == (int(code), SystemExit), done.output
    assert re.search(way_out, done.stderr.splitlines()[-1]), done.stderr
    found = json.loads(run(*shlex.split(line), "--json").stdout)["error"]
    assert (found["code"], found["message"] in done.stderr) == (int(code), True)
    assert ("Traceback" in done.output, sorted(desk.rglob("*"))) == (False, before)


def test_things_that_are_no_recordings_are_named() -> None:
    assert len(CASES) >= 60
    with pytest.raises(
        SomeFailed,
        match=r"3 of 3 recordings failed; the first: recording: got <object .*, without .*, allowed: ",
    ) as caught:
        touches([object(), object(), object()])  # type: ignore[list-item]
    assert len(caught.value.results) == 3
