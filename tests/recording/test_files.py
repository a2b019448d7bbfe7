"""Files that anyone may have made: only regular files are read, up to a limit; a file is replaced as a whole or not at all."""

import errno
import os
import re
import stat
import subprocess
import sys
import tomllib
from collections.abc import Callable
from pathlib import Path

import palpate
import pytest
from palpate import Calibration
from palpate.ad7746.evalkit.usb_bus import read_hex
from palpate.calibration.specimen_files import read_moduli
from palpate.errors import CalibrationError, ProtocolError, RecordingError
from palpate.file_locks import try_lock
from palpate.files import parse_toml, replacing, replacing_both, write_file

NODES = ["pipe", "folder"]


def node(tmp_path: Path, kind: str, suffix: str = ".csv") -> Path:
    """Return something that is no file."""
    path = tmp_path / f"x{suffix}"
    if kind == "pipe":
        os.mkfifo(path)
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
    "read, columns": (
        lambda path: palpate.read(path, columns={"hard": 1, "soft": 2}),
        RecordingError,
    ),
    "open": (lambda path: palpate.open(str(path)), RecordingError),
    "calibration": (Calibration.load, CalibrationError),
    "moduli": (read_moduli, CalibrationError),
    "firmware": (read_hex, ProtocolError),
}


@pytest.mark.parametrize(
    ("reader", "kind"), [*((reader, "pipe") for reader in READERS), ("read", "folder")]
)
def test_no_reader_waits(reader: str, kind: str, tmp_path: Path) -> None:
    read, error = READERS[reader]
    with pytest.raises(
        error, match={"folder": "Is a directory", "pipe": "a pipe, not a file"}[kind]
    ):
        read(node(tmp_path, kind))


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
        # as before, but no set-id
        assert (path.read_bytes(), stat.S_IMODE(path.stat().st_mode)) == (b"newer", 0o604)
        other.write_bytes(b"other")
        other.chmod(0o666)
        path.unlink()
        path.symlink_to(other)
        write(path)  # the link is replaced; what it pointed to, and its permissions, stay apart
        assert (path.is_symlink(), path.read_bytes(), other.read_bytes()) == (
            False,
            b"new",
            b"other",
        )
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


def test_a_file_is_synced_before_and_after_it_gets_its_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
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


KILLED = """
import os, sys
from pathlib import Path
from palpate.files import replacing
with replacing(Path(sys.argv[1])) as file:
    file.write(b"half")
    file.flush()
    os.kill(os.getpid(), 9)
"""


def test_the_next_program_removes_what_a_killed_one_left(tmp_path: Path) -> None:
    """No file of a program that lives, and no other file."""
    done = subprocess.run([sys.executable, "-c", KILLED, str(tmp_path / "run.json")], check=False)
    assert done.returncode == -9
    [left] = tmp_path.iterdir()
    others = [
        f"{left.name}.txt",
        left.name.replace("palpate", "other"),
        f"x{left.name}",
        ".a.palpate-12",
    ]
    for name in others:
        (tmp_path / name).write_text("precious")
    alive = left.with_name(left.name[:-1] + ("0" if left.name[-1] != "0" else "1"))
    with alive.open("xb") as file:
        assert try_lock(file)
        write_file(tmp_path / "b.json", b"new")
        assert sorted(path.name for path in tmp_path.iterdir()) == sorted(
            [*others, alive.name, "b.json"]
        )


def test_a_file_whose_lock_another_program_takes_gets_another_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It takes the file for left, as it is not locked yet."""
    taken = iter([False, True])
    monkeypatch.setattr("palpate.files.try_lock", lambda _: next(taken))
    monkeypatch.setattr("palpate.files._remove_left", lambda _: None)
    write_file(tmp_path / "a", b"new")
    assert (tmp_path / "a").read_bytes() == b"new"
    assert next(taken, None) is None


@pytest.mark.parametrize("there", [True, False])
@pytest.mark.parametrize("fails", [1, 2])
def test_two_files_are_both_replaced_or_none(
    there: bool, fails: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    paths = [tmp_path / "run.csv", tmp_path / "run.json"]
    if there:
        for path in paths:
            path.write_text("old")
    before = {path.name: path.read_text() for path in tmp_path.iterdir()}
    calls = list[Path]()
    replace = palpate.files.replace

    def failing(path: Path, target: Path) -> None:
        calls.append(target)
        if len(calls) == fails:
            raise PermissionError(errno.EACCES, "Permission denied", str(target))
        replace(path, target)

    def replace_both() -> None:
        with replacing_both(*paths) as (first, second):
            first.write(b"new")
            second.write(b"new")

    monkeypatch.setattr("palpate.files.replace", failing)
    with pytest.raises(PermissionError):
        replace_both()
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == before
    monkeypatch.undo()
    replace_both()
    assert [path.read_text() for path in paths] == ["new", "new"]
    assert len(list(tmp_path.iterdir())) == 2


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("#\n" * 100_000 + "#", "got 200,001 characters, allowed: 200,000: make it smaller"),
        ("a." * 90_000 + "a = 1", "line 1: got more than 32 levels"),
        ('"".' * 60_000 + "a = 1", "line 1: got more than 32 levels"),
        ("a = {b = {" + "c." * 30_000 + "d = 1}}", "line 1: got more than 32 levels"),
        ("[" + "a." * 90_000 + "a]", "line 1: got more than 32 levels"),
        ("a = 1\nb = " + "[" * 900, "line 2: got more than 32 levels"),
        ("a = " + "[" * 33 + "]" * 33, "line 1: got more than 32 levels"),
        ("a = " + "{a = " * 900, "line 1: got more than 32 levels"),
        ("a = " + '["]]", ' * 900, "line 1: got more than 32 levels"),
        ("a = 0x" + "f" * 9_000, "line 1: got a number or name of 9,002 characters, allowed: 100"),
        ("a = " + '"""x\\' * 30_000, "Unescaped"),
        ("'''x" * 40_000 + "''", "Expected '='"),
    ],
    ids=str.__len__,
)
def test_a_hostile_toml_is_refused_before_it_is_parsed(text: str, message: str) -> None:
    """None of them takes longer than to read the text once: dots and brackets are counted first."""
    with pytest.raises(ValueError, match=re.escape(message)):
        parse_toml(text)


@pytest.mark.parametrize(
    "value",
    [
        "[" * 32 + "]" * 32,
        '"""' + ".[" * 40 + '\\"."""""',
        "'''" + "{." * 40 + "'''",
        "[" + "1.5, " * 20_000 + "]",
    ],
    ids=["brackets", "text", "literal", "numbers"],
)
def test_a_toml_that_only_looks_deep_is_read(value: str) -> None:
    document = parse_toml("#\n" * 1_000 + f"a = {value} # {'.' * 40}\n[c.d]\ne = 1\n")
    assert document["c"] == {"d": {"e": 1}}
    assert tomllib.loads(f"a = {value}")["a"] == document["a"]
