"""How commands begin and end: what they import, one line and an exit code after an error, and no half file."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import palpate
import pytest
from command_lines import run
from palpate import SourceTimeout, check
from palpate.cli import COMMANDS
from project import ROOT

FOUR = ROOT / "tests" / "data" / "four-specimens.csv"
PATIENCE_S = 120


def process(*words: str, before: str = "", **environment: str) -> "subprocess.CompletedProcess[str]":
    """Run the program in a process of its own, after some lines of Python."""
    code = f"import sys; sys.argv = ['palpate', *{words!r}]\n{before}\nfrom palpate.__main__ import main; main()"
    given = {**os.environ, **environment}
    return subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, env=given, timeout=PATIENCE_S, check=False
    )


def imported(*words: str) -> set[str]:
    """Return the modules that the program has imported when it ends, without those of `site`."""
    before = (
        "import atexit; b = set(sys.modules); atexit.register(lambda: print(*set(sys.modules) - b, file=sys.stderr))"
    )
    done = process(*words, before=before)
    assert (done.returncode, bool(done.stdout)) == (0, True), done.stderr
    return set(done.stderr.splitlines()[-1].split())


@pytest.mark.parametrize(
    ("words", "heavy"),
    [
        (["--help"], "numpy usb serial smbus2 asyncio jinja2 pandas palpate.sources palpate.stream"),
        (["record", "--help"], "numpy usb serial smbus2 asyncio jinja2 pandas palpate.sources palpate.stream"),
        (["replay", str(FOUR)], "importlib.metadata email tempfile pandas palpate.afterwards palpate.sources"),
    ],
)
def test_only_what_is_needed_is_imported(words: list[str], heavy: str) -> None:
    assert not [name for name in imported(*words) if name.startswith(tuple(heavy.split()))]


def test_the_version_and_what_it_goes_with() -> None:
    by_click = run("--version")
    assert (by_click.exit_code, by_click.stdout) == (0, f"palpate, version {palpate.__version__}\n")
    assert process("--version", "replay").stdout == process("--version").stdout == by_click.stdout


def test_a_wrong_instruction_set_is_one_line() -> None:
    done = process("--version", PALPATE_SIMD="sse9")
    assert (done.returncode, done.stdout, len(done.stderr.splitlines())) == (2, "", 1)
    assert done.stderr.startswith("Error: environment variable PALPATE_SIMD: got 'sse9', allowed: ")


def test_ctrl_c_during_the_imports_is_no_traceback() -> None:
    before = """
class Pressed:
    def find_spec(self, name, *_):
        if name == "palpate.cli.group":
            raise KeyboardInterrupt
sys.meta_path.insert(0, Pressed())"""
    done = process("replay", before=before)
    assert (done.returncode, done.stderr) == (130, "interrupted\n")


@pytest.mark.parametrize(
    ("error", "code", "said"),
    [
        (ZeroDivisionError("by\nzero"), 1, "Error: unexpected: ZeroDivisionError: by zero; please report it with the output of --debug"),
        (PermissionError(13, "Permission denied", "there.csv"), 4, "Error: there.csv: Permission denied"),
        (SourceTimeout("no answer"), 3, "Error: no answer"),
        (KeyboardInterrupt(), 130, "interrupted"),
    ],
)  # fmt: skip
def test_errors_are_one_line(error: BaseException, code: int, said: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object, **__: object) -> None:
        raise error

    monkeypatch.setattr("palpate.benchmark.compare", fail)
    result = run("bench")
    assert (result.exit_code, result.stdout, result.stderr) == (code, "", f"{said}\n")
    for arguments in (["--debug", "bench"], ["bench", "--debug"]) if code == 1 else ():
        assert "Traceback (most recent call last)" in run(*arguments).stderr


@pytest.mark.parametrize("arguments", [["--colour"], ["replay"], ["bench", "x"], ["replay", ""]])
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
    "report": [str(FOUR), "-o", "b.html"],
    "bench": ["--seeds", "1", "--scenario", "step-up"],
    "doctor": [],
    "kit": ["scan", "sim:"],
}


@pytest.mark.parametrize("name", sorted({*COMMANDS} - {"live"}))  # which ends when it is interrupted
def test_json_is_one_document(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    arguments = JSON[name]
    Path("table.csv").write_text("t_s,C1,C2\n" + "".join(f"{i / 40},{6 + i % 3},{4 + i % 2}\n" for i in range(40)))
    if name == "calibrate":
        assert run("simulate", "-o", "ten", "--touches", "1").exit_code == 0
        arguments = [*map(str, Path("ten").glob("*.csv")), *arguments]
    result = run(name, *arguments, "--json")
    assert result.exit_code in (0, 3, 5), result.stderr
    assert isinstance(json.loads(result.stdout), dict)


def piped(words: list[str], output: object, folder: Path) -> "subprocess.CompletedProcess[str]":
    program = [sys.executable, "-m", "palpate", *words]
    return subprocess.run(program, stdout=output, stderr=subprocess.PIPE, text=True, cwd=folder, check=False)  # type: ignore[call-overload,no-any-return]


def test_a_pipe_that_is_closed(tmp_path: Path) -> None:
    reader, writer = os.pipe()
    os.close(reader)
    assert piped(["record", "sim:four-specimens", "-o", "run.csv"], writer, tmp_path).returncode == 1
    assert check(tmp_path / "run.csv").clean
    done = piped(["--version"], writer, tmp_path)
    assert (done.returncode, done.stderr) == (1, "")
    os.close(writer)


HANGS = """
import os, time
from pathlib import Path
def hang(_):
    Path("writing").touch()
    for _ in range(6000):
        time.sleep(0.1)  # a signal just before a sleep is noticed after it
os.fsync = hang  # when all is written, and the file does not have its name yet
"""
WRITING = {
    "convert": (["convert", str(FOUR), "-o", "run.parquet"], "SIGTERM"),
    "simulate": (["simulate", "-o", "ten", "--object", "gel=1.1"], "SIGHUP"),
}


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no signals of this kind on this system")
@pytest.mark.parametrize(("words", "number"), WRITING.values(), ids=WRITING)
def test_a_command_that_is_ended_leaves_no_half_file(words: list[str], number: str, tmp_path: Path) -> None:
    code = f"{HANGS}\nfrom palpate.cli import main; main({words!r}, prog_name='palpate')"
    with subprocess.Popen([sys.executable, "-c", code], stderr=subprocess.PIPE, text=True, cwd=tmp_path) as running:
        end = time.monotonic() + PATIENCE_S
        while not (tmp_path / "writing").exists():
            assert running.poll() is None
            assert time.monotonic() < end
            time.sleep(0.02)
        assert len(list(tmp_path.rglob("*"))) > 1
        running.send_signal(getattr(signal, number))
        told = running.communicate(timeout=PATIENCE_S)[1]
    assert (running.returncode, told.splitlines()[-1]) == (130, "interrupted")
    assert [path.name for path in tmp_path.rglob("*") if path.is_file()] == ["writing"]


MISSING = {
    "convert": ("pyarrow", ["convert", str(FOUR), "-o", "run.parquet"]),
    "calibrate": ("scipy", ["calibrate", str(FOUR), "--moduli", "moduli.csv", "-o", "p.toml"]),
    "live": ("uvicorn", ["live", "sim:", "--record", "run.csv"]),
    "record --lsl": ("pylsl", ["record", "sim:step-up", "-o", "run.csv", "--lsl", "lab"]),
    "kit accept": ("usb", ["kit", "accept", "usb:", "-o", "report.json"]),
}


@pytest.mark.parametrize(("package", "words"), MISSING.values(), ids=MISSING)
def test_a_missing_extra_leaves_nothing(
    package: str, words: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "probe.toml").write_bytes((ROOT / "tests/fuzz/corpus/calibration/probe.toml").read_bytes())
    (tmp_path / "moduli.csv").write_text("name,MPa\nfour,1\n")
    before = set(tmp_path.rglob("*"))
    missing = f"""
class Missing:
    def find_spec(self, name, *_):
        if name.partition(".")[0] == {package!r}:
            raise ModuleNotFoundError(name=name.partition(".")[0])
sys.meta_path.insert(0, Missing())"""
    done = process(*words, before=missing)
    assert (done.returncode, done.stdout) == (6, ""), done
    assert "pip install 'palpate[" in done.stderr.splitlines()[-1]
    assert set(tmp_path.rglob("*")) == before
