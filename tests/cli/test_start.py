"""How a command begins: what it imports, and --version, which is answered before the command line is imported."""

import os
import subprocess
import sys
from pathlib import Path

import palpate
import pytest
from click.testing import CliRunner
from palpate.cli import main
from project import ROOT

FOUR = ROOT / "tests" / "data" / "four-specimens.csv"
PALPATE = [sys.executable, "-m", "palpate"]


def imported(*arguments: str) -> set[str]:
    """Return the modules that the program has imported when it ends, in a new process without those of `site`."""
    code = f"""
import sys
before, sys.argv = set(sys.modules), ["palpate", *{arguments!r}]
from palpate.entry import main
try:
    main()
except SystemExit as end:
    assert not end.code, end.code
print(*sorted(set(sys.modules) - before), file=sys.stderr)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout
    return set(done.stderr.splitlines()[-1].split())


def test_an_empty_instruction_set_is_none() -> None:
    environment = {**os.environ, "PALPATE_SIMD": ""}
    subprocess.run([*PALPATE, "--version"], capture_output=True, check=True, env=environment)


@pytest.mark.parametrize("words", [["--version"], ["doctor"], ["replay", str(FOUR)]])
def test_a_wrong_instruction_set_is_one_line(words: list[str]) -> None:
    environment = {**os.environ, "PALPATE_SIMD": "sse9"}
    done = subprocess.run([*PALPATE, *words], capture_output=True, text=True, check=False, env=environment)
    assert (done.returncode, done.stdout) == (2, "")
    [line] = done.stderr.splitlines()
    assert line.startswith("Error: environment variable PALPATE_SIMD: got 'sse9', allowed: ")


def test_the_version_needs_the_core_and_nothing_else() -> None:
    found = imported("--version")
    assert {name for name in found if name.startswith("palpate")} == {
        "palpate",
        "palpate._core",
        "palpate.entry",
        "palpate.errors",
    }
    assert not found & {"click", "numpy", "pathlib", "re", "typing", "inspect", "enum"}


def test_a_replay_imports_what_an_own_recording_needs() -> None:
    found = imported("replay", str(FOUR))
    assert {"numpy", "palpate.recording.own_file"} <= found
    others = ("importlib.metadata", "email", "shutil", "tempfile", "palpate.afterwards", "palpate.tables.formats")
    assert not [name for name in found if name.startswith((*others, "palpate.tables.text", "palpate.tables.times"))]


def test_the_version_is_that_of_the_command_line() -> None:
    """Any other line with --version goes through click."""
    at_once = subprocess.run([*PALPATE, "--version"], capture_output=True, text=True, check=True)
    by_click = CliRunner().invoke(main, ["--version"], prog_name="palpate")
    assert (
        (by_click.exit_code, by_click.stdout) == (0, at_once.stdout) == (0, f"palpate, version {palpate.__version__}\n")
    )
    longer = subprocess.run([*PALPATE, "--version", "replay"], capture_output=True, text=True, check=True)
    assert longer.stdout == at_once.stdout


def test_the_version_has_no_options() -> None:
    found = CliRunner().invoke(main, ["--version", "--json"], prog_name="palpate")
    assert (found.exit_code, found.stdout) == (2, "")
    assert found.stderr == "Error: No such option: --json; see palpate --help\n"


def test_a_version_that_cannot_be_printed_ends_as_any_output(tmp_path: Path) -> None:
    reader, writer = os.pipe()
    os.close(reader)
    closed = subprocess.run([*PALPATE, "--version"], stdout=writer, stderr=subprocess.PIPE, text=True, check=False)
    os.close(writer)
    assert (closed.returncode, closed.stderr) == (1, "")
    code = "import sys; sys.stdout = None; sys.argv = ['palpate', '--version']; from palpate.entry import main; main()"
    none = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, stderr=subprocess.PIPE, text=True, check=False)
    assert (none.returncode, none.stderr) == (0, "")


def test_ctrl_c_during_the_imports_is_no_traceback() -> None:
    code = """import sys
from palpate.entry import main
class Pressed:
    def find_spec(self, name, *_):
        if name == "palpate.cli.group":
            raise KeyboardInterrupt
sys.meta_path.insert(0, Pressed())
main()"""
    done = subprocess.run([sys.executable, "-c", code], stderr=subprocess.PIPE, text=True, check=False)
    assert (done.returncode, done.stderr) == (130, "interrupted\n")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no device that is full")
def test_a_version_on_a_full_disk() -> None:
    with Path("/dev/full").open("wb") as full:
        done = subprocess.run([*PALPATE, "--version"], stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert done.returncode == 4
    assert done.stderr.startswith("Error: ")
    assert "No space left" in done.stderr
