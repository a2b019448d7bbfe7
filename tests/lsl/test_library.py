"""pylsl is imported only when it is used; what is said without it, and what liblsl prints."""

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from click.testing import CliRunner
from palpate import MissingExtra
from palpate.cli import main
from palpate.sources.lsl.library import library

LINE = "pylsl is not installed; type: pip install 'palpate[lsl]'"


@pytest.fixture
def fresh() -> Iterator[None]:
    library.cache_clear()
    yield
    library.cache_clear()


@pytest.mark.parametrize(
    "command", [["record", "sim:stiff-steady?speed=1", "--lsl", "-o", "a.csv"], ["record", "lsl:x", "-o", "a.csv"]]
)
def test_without_pylsl(command: list[str], fresh: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setitem(sys.modules, "pylsl", None)
    done = CliRunner().invoke(main, command)
    assert done.exit_code == 6
    assert LINE in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_devices_without_pylsl(fresh: None, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pylsl", None)
    assert f"not searched: {LINE}" in CliRunner().invoke(main, ["devices", "--lsl"]).stderr
    assert "pylsl" not in CliRunner().invoke(main, ["devices"]).stderr


def test_without_liblsl(fresh: None, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object) -> None:
        raise RuntimeError("LSL binary library file was not found. Please ...\nmore")

    monkeypatch.setattr("palpate.sources.lsl.library.need", fail)
    with pytest.raises(MissingExtra, match=r"pylsl finds no liblsl \(LSL binary library file was not found") as raised:
        library()
    assert "pip install --force-reinstall 'palpate[lsl]'" in str(raised.value)


def run(code: str, folder: Path, **environment: str) -> "subprocess.CompletedProcess[str]":
    given = {key: value for key, value in os.environ.items() if key != "LSLAPICFG"}
    given |= {"HOME": str(folder), "USERPROFILE": str(folder), **environment}
    return subprocess.run(
        [sys.executable, "-c", code], cwd=folder, env=given, capture_output=True, text=True, check=True
    )


def test_it_is_imported_only_when_it_is_used(tmp_path: Path) -> None:
    code = "import sys, palpate.lsl, palpate.sources.lsl.opening, palpate.cli.record; print('pylsl' in sys.modules)"
    assert run(code, tmp_path).stdout == "False\n"


def test_liblsl_prints_nothing_unless_it_is_configured(tmp_path: Path) -> None:
    code = "from palpate.sources.lsl.finding import search; search({'name': 'nothing'}, 0.1)"
    quiet, configured = tmp_path / "quiet", tmp_path / "configured"
    quiet.mkdir()
    configured.mkdir()
    (configured / "lsl_api.cfg").write_text("[multicast]\nResolveScope = machine\n")
    assert run(code, quiet).stderr == ""
    assert "Configuration loaded from lsl_api.cfg" in run(code, configured).stderr
