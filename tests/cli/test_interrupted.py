"""A command that is ended while it writes: by SIGTERM, or by a closed terminal. No file is half there."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from shutil import copytree

import pytest
from click.testing import CliRunner
from effort import NIGHTLY
from palpate.cli import main
from project import ROOT

FOUR = ROOT / "tests" / "data" / "four-specimens.csv"
PATIENCE_S = 120
HANGS = """
import os, time
from pathlib import Path
def hang(_):
    Path("writing").touch()
    time.sleep(600)
os.fsync = hang  # when all is written, and the file does not have its name yet
from palpate.cli import main
main(prog_name="palpate")
"""
COMMANDS = {
    "convert": ["convert", str(FOUR), "-o", "run.parquet"],
    "simulate": ["simulate", "-o", "ten", "--object", "gel=1.1"],
    "calibrate": ["calibrate", "made", "--moduli", "made/moduli.csv", "-o", "probe.toml"],
    "report": ["report", str(FOUR), "-o", "r.html"],
    "figures": ["figures", "-o", "figures"],
}
SIGNALS = [signal.SIGTERM, getattr(signal, "SIGHUP", signal.SIGTERM)]
CASES = [
    (name, number)
    for place, name in enumerate(COMMANDS)
    for number in (SIGNALS if NIGHTLY or name == "convert" else SIGNALS[place % 2 :][:1])
    if NIGHTLY or name != "figures"
]


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with recordings of four objects, and their moduli."""
    folder = tmp_path_factory.mktemp("simulated") / "made"
    objects = [word for modulus in ("0.1", "0.4", "1.5", "6") for word in ("--object", f"g{modulus}={modulus}")]
    done = CliRunner().invoke(main, ["simulate", "-o", str(folder), "--touches", "1", *objects])
    assert done.exit_code == 0, done.stderr
    return folder


def given(arguments: list[str], made: Path) -> list[str]:
    """Return a command line with its inputs in the working folder: those for calibrate are copied to it."""
    if arguments[0] != "calibrate":
        return arguments
    copytree(made, "made")
    return ["calibrate", *map(str, Path("made").glob("g*.csv")), *arguments[2:]]


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no signals of this kind on this system")
@pytest.mark.parametrize(("name", "number"), CASES)
def test_no_file_is_half_there(
    name: str, number: signal.Signals, made: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    arguments = given(COMMANDS[name], made)
    before = files(tmp_path)
    process = subprocess.Popen([sys.executable, "-c", HANGS, *arguments], stderr=subprocess.PIPE, text=True)
    end = time.monotonic() + PATIENCE_S
    while not Path("writing").exists():
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < end
        time.sleep(0.02)
    assert files(tmp_path) - before > {Path("writing")}
    process.send_signal(number)
    told = process.communicate(timeout=PATIENCE_S)[1]
    assert (process.returncode, told.splitlines()[-1]) == (130, "interrupted")
    assert files(tmp_path) - before == {Path("writing")}


def files(folder: Path) -> set[Path]:
    return {path.relative_to(folder) for path in folder.rglob("*") if path.is_file()}


BLOCKED = {
    "figures, matplotlib": ("matplotlib", ["figures", "-o", "new/figures"]),
    "figures, scipy": ("scipy", ["figures", "-o", "new/figures"]),
    "convert": ("pyarrow", ["convert", str(FOUR), "-o", "run.parquet"]),
    "calibrate": ("scipy", ["calibrate", "made", "--moduli", "made/moduli.csv", "-o", "p.toml", "--report", "r.html"]),
    "calibrate --plot": ("matplotlib", ["calibrate", "made", "--moduli", "made/moduli.csv", "-o", "p.toml", "--plot", "p.png"]),
    "report": ("scipy", ["report", str(FOUR), "-o", "r.html"]),
    "live": ("uvicorn", ["live", "sim:", "--record", "run.csv"]),
    "live --calibration": ("scipy", ["live", "sim:", "--record", "run.csv", "--calibration", "probe.toml"]),
    "record --lsl": ("pylsl", ["record", "sim:step-up", "-o", "run.csv", "--lsl", "lab"]),
    "record": ("usb", ["record", "usb:", "-o", "run.csv"]),
    "record serial:": ("serial", ["record", "serial:/dev/ttyUSB0", "-o", "run.csv"]),
    "kit accept": ("usb", ["kit", "accept", "usb:", "-o", "report.json"]),
}  # fmt: skip


WITHOUT = """
import importlib.abc, sys
package = sys.argv.pop(1)
class Missing(importlib.abc.MetaPathFinder):
    def find_spec(self, name, *_):
        if name.partition(".")[0] == package:
            raise ModuleNotFoundError(f"No module named {package!r}", name=package)
sys.meta_path.insert(0, Missing())
from palpate.cli import main
main(prog_name="palpate")
"""


@pytest.mark.parametrize(("package", "arguments"), BLOCKED.values(), ids=BLOCKED)
def test_a_missing_extra_leaves_nothing(
    package: str, arguments: list[str], made: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "probe.toml").write_bytes((ROOT / "tests/fuzz/corpus/calibration/probe.toml").read_bytes())
    arguments = given(arguments, made)
    before = set(tmp_path.rglob("*"))
    command = [sys.executable, "-c", WITHOUT, package, *arguments]
    done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE_S, check=False)
    assert (done.returncode, done.stdout) == (6, ""), done
    assert "pip install 'palpate[" in done.stderr.splitlines()[-1]
    assert set(tmp_path.rglob("*")) == before
