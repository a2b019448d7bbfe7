"""How commands begin and end: what they import, one line and an exit code after an error, and no half file."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import palpate
import pytest
from command_lines import document, run
from palpate import check
from palpate.cli.exit_codes import ExitCode
from palpate.cli.main import COMMANDS
from palpate.errors import SourceTimeout
from project import FOUR, ROOT


def process(
    *words: str, before: str = "", **environment: str
) -> "subprocess.CompletedProcess[str]":
    """Run the program in a process of its own, after some lines of Python."""
    code = f"import sys; sys.argv = ['palpate', *{words!r}]\n{before}\nfrom palpate.__main__ import main; main()"
    variables = {**os.environ, **environment}
    return subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, env=variables, check=False
    )


def no_space(*_: object) -> None:
    raise OSError(28, "No space left on device")


def raising(error: str, name: str) -> str:
    """Return lines of Python: the import of a module with a name that begins so raises an error."""
    return f"""
class Finder:
    def find_spec(self, name, *_):
        if name.startswith({name!r}):
            raise {error}
sys.meta_path.insert(0, Finder())"""


def imported(*words: str) -> set[str]:
    """Return the modules that the program has imported when it ends, without those of `site`."""
    show = "atexit.register(lambda: print(*set(sys.modules) - b, file=sys.stderr))"
    done = process(*words, before=f"import atexit; b = set(sys.modules); {show}")
    assert (done.returncode, bool(done.stdout)) == (0, True), done.stderr
    return set(done.stderr.splitlines()[-1].split())


@pytest.mark.parametrize(
    ("words", "heavy"),
    [
        (
            ["--help"],
            "numpy usb serial smbus2 asyncio jinja2 pandas palpate.sources palpate.stream",
        ),
        (
            ["record", "--help"],
            "numpy usb serial smbus2 pylsl asyncio jinja2 pandas palpate.sources palpate.stream",
        ),
        (
            ["replay", str(FOUR)],
            "importlib.metadata email tempfile pandas palpate.offline_touches palpate.sources",
        ),
    ],
)
def test_only_what_is_needed_is_imported(words: list[str], heavy: str) -> None:
    assert not [name for name in imported(*words) if name.startswith(tuple(heavy.split()))]


def test_the_version_and_what_it_goes_with() -> None:
    by_click = run("--version")
    assert (by_click.exit_code, by_click.stdout) == (0, f"palpate, version {palpate.__version__}\n")
    assert process("--version", "replay").stdout == process("--version").stdout == by_click.stdout


def test_ctrl_c_during_the_imports_is_no_traceback() -> None:
    done = process("replay", before=raising("KeyboardInterrupt", "palpate.cli.main"))
    assert (done.returncode, done.stderr) == (130, "interrupted\n")


def test_the_documentation_has_every_exit_code() -> None:
    page = (ROOT / "docs" / "cli.md").read_text(encoding="utf-8")
    assert {int(code) for code in re.findall(r"^\| (\d+) \|", page, re.MULTILINE)} == {*ExitCode}


@pytest.mark.parametrize(
    ("error", "code", "message"),
    [
        (ZeroDivisionError("by\nzero"), 1, "Error: unexpected: ZeroDivisionError: by zero; please report it with the output of --debug"),
        (PermissionError(13, "Permission denied", "there.csv"), 4, "Error: there.csv: Permission denied"),
        (SourceTimeout("no answer"), 3, "Error: no answer"),
        (KeyboardInterrupt(), 130, "interrupted"),
    ],
)  # fmt: skip
def test_errors_are_one_line(
    error: BaseException, code: int, message: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object, **__: object) -> None:
        raise error

    monkeypatch.setattr("palpate.sources.devices.devices", fail)
    result = run("devices")
    assert (result.exit_code, result.stdout, result.stderr) == (code, "", f"{message}\n")
    for arguments in (["--debug", "devices"], ["devices", "--debug"]) if code == 1 else ():
        assert "Traceback (most recent call last)" in run(*arguments).stderr


@pytest.mark.parametrize("arguments", [["--colour"], ["replay"], ["devices", "x"], ["replay", ""]])
def test_usage_errors_are_one_line(arguments: list[str]) -> None:
    result = run(*arguments)
    assert (result.exit_code, result.stdout, len(result.stderr.splitlines())) == (2, "", 1)
    assert " see palpate" in result.stderr.lower()


JSON = {
    "record": ["sim:step-up", "-o", "a.csv"],
    "replay": [str(FOUR)],
    "check": [str(FOUR)],
    "import": ["table.csv", "--map", "hard=2,soft=3", "--unit", "pF"],
    "convert": [str(FOUR), "-o", "b.csv"],
    "plot": [str(FOUR), "-o", "b.png"],
    "devices": [],
    "simulate": ["-o", "gel", "--object", "gel=1", "--touches", "1"],
    "calibrate": ["--moduli", "ten/moduli.csv", "-o", "probe.toml"],
    "verify": ["30 A", "ten/30A.csv", "--moduli", "ten/moduli.csv", "--calibration", "probe.toml"],
    "report": [str(FOUR), "-o", "b.html"],
    "bench": ["--seeds", "1", "--scenario", "step-up"],
    "doctor": [],
    "kit": ["scan", "sim:"],
}


def test_an_error_is_a_document_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also one of several files, and one that ends a measurement; test_user_errors.py has those of one line."""
    monkeypatch.chdir(tmp_path)
    Path("no.csv").write_text("no table\n")
    assert "error" in json.loads(run("replay", "nope.csv", PALPATE_REPLAY_JSON="1").stdout)
    for command, several in (("replay", None), ("check", "unreadable")):
        found = document(command, str(FOUR), "no.csv")
        [failed] = [each for each in (found[several] if several else found) if "error" in each]
        assert (failed["file"], failed["error"]["code"], "touches" in failed) == (
            "no.csv",
            4,
            False,
        )
    monkeypatch.setattr("palpate.recording.writer.write", no_space)
    # one document with what was measured until then
    found = document("record", "sim:step-up", "-o", "b.csv")
    assert found["error"]["code"] == 4


# which ends when it is interrupted
@pytest.mark.parametrize("name", sorted({*COMMANDS} - {"live"}))
def test_json_is_one_document(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    arguments = JSON[name]
    Path("table.csv").write_text(
        "t_s,C1,C2\n" + "".join(f"{i / 40},{6 + i % 3},{4 + i % 2}\n" for i in range(40))
    )
    if name in ("calibrate", "verify"):
        assert run("simulate", "-o", "ten", "--touches", "1").exit_code == 0
        calibrating = [*map(str, Path("ten").glob("*.csv")), *JSON["calibrate"]]
        if name == "calibrate":
            arguments = calibrating
        else:
            assert run("calibrate", *calibrating).exit_code == 0
    assert isinstance(document(name, *arguments), dict)


def test_a_pipe_that_is_closed(tmp_path: Path) -> None:
    """It ends no recording, as after `record ... | head`; the true cause is said."""
    reader, writer = os.pipe()
    os.close(reader)
    path = tmp_path / "run.csv"
    said = []
    for words in (["record", "sim:four-specimens", "-o", str(path)], ["--version"]):
        command = [sys.executable, "-m", "palpate", *words]
        done = subprocess.run(
            command, stdout=writer, stderr=subprocess.PIPE, text=True, check=False
        )
        assert done.returncode == 1
        said.append(done.stderr)
    os.close(writer)
    closed = "standard output was closed: rows of touches are not printed; the recording goes on"
    assert said == [f"{closed}\n{path}: 1185 rows; file closed\n", ""]
    assert check(path).findings == check(path).faults == ()
    assert (check(path).clean, check(path).survey.rows) == (True, 1185)


@pytest.mark.skipif(os.name == "nt", reason="a shell of Unix closes the streams")
@pytest.mark.parametrize("closed", ["2>&-", ">&-", "<&- >&- 2>&-"])
def test_closed_standard_streams_end_no_recording(closed: str, tmp_path: Path) -> None:
    """No file of the program gets their numbers: a library that writes there would write into it."""
    path = tmp_path / "run.csv"
    writes = "import os; [os.write(n, b'x') for n in (1, 2)]"
    code = (
        f"import sys, atexit; sys.argv = ['palpate', 'record', 'sim:four-specimens', '-o', {str(path)!r}]\n"
        f"from palpate.__main__ import main\n"
        f"from palpate.recording import recorder\n"
        f"recorder.Recorder.popped = lambda: exec({writes!r})\nmain()"
    )
    shell = f'"$0" -c "$1" {closed}'
    done = subprocess.run(["sh", "-c", shell, sys.executable, code], check=False)
    assert done.returncode == 0
    assert (check(path).clean, check(path).survey.rows) == (True, 1185)


@pytest.mark.skipif(sys.platform != "linux", reason="/dev/full is Linux's")
def test_a_standard_output_that_is_full_is_named_and_ends_no_recording(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    words = [sys.executable, "-m", "palpate", "record", "sim:four-specimens", "-o", str(path)]
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(words, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert done.returncode == 4
    assert done.stderr.endswith("Error: standard output: No space left on device\n")
    assert (check(path).clean, check(path).survey.rows) == (True, 1185)


MISSING = [
    ("tables", "pyarrow", ["convert", str(FOUR), "-o", "run.parquet"]),
    ("science", "scipy", ["calibrate", str(FOUR), "--moduli", "moduli.csv", "-o", "p.toml"]),
    ("live", "uvicorn", ["live", "sim:", "--record", "run.csv"]),
    ("lsl", "pylsl", ["record", "sim:step-up", "-o", "run.csv", "--lsl", "lab"]),
    ("lsl", "pylsl", ["record", "lsl:x", "-o", "run.csv"]),
    ("i2c", "smbus2", ["record", "i2c:/dev/i2c-1", "-o", "run.csv"]),
    ("usb", "usb", ["record", "sim:", "-o", "run.csv"]),
    ("usb", "usb", ["kit", "accept", "usb:", "-o", "report.json"]),
]


@pytest.mark.parametrize(("extra", "package", "words"), MISSING)
def test_a_missing_extra_leaves_nothing(
    extra: str, package: str, words: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "probe.toml").write_bytes(
        (ROOT / "tests/fuzz/corpus/calibration/probe.toml").read_bytes()
    )
    (tmp_path / "moduli.csv").write_text("name,MPa\nfour,1\n")
    before = set(tmp_path.rglob("*"))
    done = process(*words, before=raising(f"ModuleNotFoundError(name={package!r})", package))
    assert (done.returncode, done.stdout) == (6, ""), done
    assert f"pip install 'palpate[{extra}]'" in done.stderr.splitlines()[-1]
    assert set(tmp_path.rglob("*")) == before
