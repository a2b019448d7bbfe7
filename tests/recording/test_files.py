"""Files that anyone may have made: only regular files are read, and a file is replaced as a whole or not at all."""

import errno
import os
import socket
import stat
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import palpate
import pytest
from palpate import Calibration, CalibrationError, ProtocolError, RecordingError
from palpate.ad7746.evalkit.firmware import read_hex
from palpate.calibration.specimen_files import read_moduli
from palpate.cli import COMMANDS, config
from palpate.files import open_regular, read_bytes, replacing
from palpate.recording.exchange.binary_data import is_binary_data
from palpate.recording.foreign import recorded
from project import ROOT

FOUR = ROOT / "tests" / "data" / "four-specimens.csv"
NODES = ["pipe", "socket", "folder", "device"]


def node(tmp_path: Path, kind: str, suffix: str = ".csv") -> Path:
    """Return something that is no file."""
    path = tmp_path / f"x{suffix}"
    if kind == "pipe":
        os.mkfifo(path)
    elif kind == "socket":
        bound = socket.socket(socket.AF_UNIX)
        bound.bind(str(path))
        bound.close()
    elif kind == "device":
        path.symlink_to("/dev/zero")
    else:
        path.mkdir()
    return path


@pytest.fixture(autouse=True)
def _has_such() -> None:
    if not hasattr(os, "mkfifo"):
        pytest.skip("needs pipes in the file system")


READERS: dict[str, tuple[Callable[[Path], object], type[Exception]]] = {
    "check": (palpate.check, RecordingError),
    "read": (palpate.read, RecordingError),
    "read, columns": (lambda path: palpate.read(path, columns={"hard": 1, "soft": 2}), RecordingError),
    "recorded": (recorded, RecordingError),
    "open": (lambda path: palpate.open(str(path)), RecordingError),
    "codes": (is_binary_data, RecordingError),
    "calibration": (Calibration.load, CalibrationError),
    "moduli": (read_moduli, CalibrationError),
    "firmware": (read_hex, ProtocolError),
}


@pytest.mark.parametrize("kind", NODES)
@pytest.mark.parametrize("reader", READERS)
def test_no_reader_waits(reader: str, kind: str, tmp_path: Path) -> None:
    """On the code before, a pipe hung, and a device ended in MemoryError."""
    read, error = READERS[reader]
    said = {"folder": "Is a directory", "pipe": "a pipe, not a file", "socket": "a socket", "device": "a device"}[kind]
    with pytest.raises(error, match=said):
        read(node(tmp_path, kind))


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        (["check", "x.csv"], 4),
        (["replay", "x.csv"], 4),
        (["convert", "x.csv", "-o", "out.csv"], 4),
        (["convert", FOUR, "-o", "x.csv", "--force"], 4),
        (["record", "./x.csv", "-o", "out.csv"], 4),
        (["calibrate", FOUR, "--moduli", "x.csv", "-o", "out.toml"], 4),
        (["calibrate", "x.csv", "--moduli", "moduli.csv", "-o", "out.toml"], 4),
        (["replay", FOUR, "--calibration", "x.csv"], 4),
        (["--config", "x.csv", "replay", FOUR], 4),
    ],
)
def test_no_command_waits(arguments: list[str | Path], code: int, tmp_path: Path) -> None:
    pipe = node(tmp_path, "pipe")
    (tmp_path / "moduli.csv").write_text("name,modulus\nx,1\n")
    command = [sys.executable, "-m", "palpate", *map(str, arguments)]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False, timeout=300)
    assert (done.returncode, len(done.stderr.splitlines())) == (code, 1), done.stderr
    assert "a pipe, not a file" in done.stderr
    assert stat.S_ISFIFO(pipe.stat().st_mode)
    assert not list(tmp_path.glob("out*"))


def test_a_sidecar_that_is_a_pipe(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    path.write_bytes(FOUR.read_bytes())
    os.mkfifo(tmp_path / "run.json")
    assert "a pipe, not a file" in str(palpate.read(path).notes)


def test_a_config_in_the_folder_that_is_a_pipe(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    os.mkfifo(tmp_path / "palpate.toml")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(OSError, match="a pipe, not a file"):
        config.read(config.places()[1], COMMANDS)


def test_sizes(tmp_path: Path) -> None:
    path = tmp_path / "a"
    path.write_bytes(b"12345")
    assert read_bytes(path, 5) == b"12345"
    with pytest.raises(OSError, match="larger than 4 bytes"):
        read_bytes(path, 4)
    with path.open("wb") as file:
        file.truncate(10**12)  # sparse
    with pytest.raises(OSError, match="larger than 1,000,000,000 bytes"):
        read_bytes(path, 10**9)
    if Path("/proc/self/status").exists():  # says that it has 0 bytes
        assert b"VmRSS" in read_bytes(Path("/proc/self/status"), 10**6)
    with pytest.raises(FileNotFoundError):
        open_regular(tmp_path / "nowhere")


def write(path: Path, data: bytes = b"new") -> None:
    with replacing(path) as file:
        file.write(data)


def test_what_is_replaced(tmp_path: Path) -> None:
    path, other = tmp_path / "a", tmp_path / "b"
    before = os.umask(0o027)
    try:
        write(path)
        assert stat.S_IMODE(path.stat().st_mode) == 0o640  # as the umask says
        path.chmod(0o4604)
        write(path, b"newer")
        assert (path.read_bytes(), stat.S_IMODE(path.stat().st_mode)) == (b"newer", 0o604)  # as before, but no set-id
        other.write_bytes(b"other")
        other.chmod(0o666)
        path.unlink()
        path.symlink_to(other)
        write(path)  # the link is replaced; what it pointed to, and its permissions, stay apart
        assert (path.is_symlink(), path.read_bytes(), other.read_bytes()) == (False, b"new", b"other")
        assert stat.S_IMODE(path.stat().st_mode) == 0o640
    finally:
        os.umask(before)
    assert sorted(tmp_path.iterdir()) == [path, other]


@pytest.mark.parametrize("kind", NODES)
def test_what_is_never_replaced(kind: str, tmp_path: Path) -> None:
    path = node(tmp_path, kind)
    with pytest.raises(OSError, match=r"not a file|Is a directory"):
        write(path)
    assert list(tmp_path.iterdir()) == [path]


def test_an_error_leaves_the_old_file(tmp_path: Path) -> None:
    path = tmp_path / ("é" * 100)
    write(path, b"old")

    def fail() -> None:
        with replacing(path) as file:
            file.write(b"half")
            raise OSError(errno.ENOSPC, "full")

    with pytest.raises(OSError, match="full") as caught:
        fail()
    assert caught.value.filename == str(path)
    assert (path.read_bytes(), list(tmp_path.iterdir())) == (b"old", [path])
    with pytest.raises(FileNotFoundError) as missing:
        write(tmp_path / "nowhere" / "a")
    assert missing.value.filename == str(tmp_path / "nowhere" / "a")


def test_a_file_is_synced_before_and_after_it_gets_its_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """On FAT the name stands for an empty file until the file is synced once more; then the folder."""
    path, sync = tmp_path / "a", os.fsync
    path.write_bytes(b"old")
    synced: list[tuple[int, bytes]] = []

    def fsync(descriptor: int) -> None:
        synced.append((os.fstat(descriptor).st_ino, path.read_bytes()))
        sync(descriptor)

    monkeypatch.setattr(os, "fsync", fsync)
    write(path)
    file, folder = path.stat().st_ino, tmp_path.stat().st_ino
    assert synced == [(file, b"old"), (file, b"new"), (folder, b"new")]
