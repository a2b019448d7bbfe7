"""The archive of the headers: what Arduino and PlatformIO want of a library, and a sketch of it that measures."""

import json
import re
import subprocess
import sys
import zipfile
from pathlib import Path

import palpate
import pytest
from building import STRICT, run
from project import ROOT, need

from release import headers
from release.project import ADDRESS_MISSING, address, pyproject

SOURCE = "https://forge.invalid/palpate"
STUB = ROOT / "tests" / "tools" / "arduino_stub"
EMBEDDED = ROOT / "bench" / "embedded"


def make(folder: Path, *address: str) -> subprocess.CompletedProcess[str]:
    """Run the command."""
    command: list[str | Path] = [sys.executable, "-m", "release.headers", folder, *address]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Make the archive by its command, and unpack it."""
    folder = tmp_path_factory.mktemp("archive")
    made = Path(make(folder, SOURCE).stdout.strip())
    headers.write(again := folder / "again.zip", SOURCE)
    assert made.read_bytes() == again.read_bytes()
    with zipfile.ZipFile(made) as archive:
        archive.extractall(folder)
    assert {(info.date_time, info.create_system) for info in archive.infolist()} == {((1980, 1, 1, 0, 0, 0), 3)}
    assert archive.namelist() == sorted(archive.namelist())
    [only] = {name.split("/")[0] for name in archive.namelist()}
    return folder / only


def test_without_an_address_there_is_no_archive(tmp_path: Path) -> None:
    if "Source" in pyproject()["project"].get("urls", {}):
        assert f"url={address()}\n" in headers.properties(address())
        return
    done = make(tmp_path)
    assert (done.returncode, done.stderr) == (1, f"error: {ADDRESS_MISSING}\n")
    assert list(tmp_path.iterdir()) == []


def test_what_arduino_wants(library: Path) -> None:
    """Arduino library specification 1.5: the fields, their forms, and the folders."""
    fields = dict(line.split("=", 1) for line in (library / "library.properties").read_text().splitlines())
    required = {"name", "version", "author", "maintainer", "sentence", "paragraph", "category", "url", "architectures"}
    assert required <= {name for name, value in fields.items() if value.strip()}
    assert re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9_. -]{0,62}", fields["name"])
    assert not fields["name"].lower().startswith("arduino")
    assert fields["version"] == palpate.__version__
    assert re.fullmatch(r"\d+\.\d+\.\d+", fields["version"])
    assert fields["category"] in {
        "Communication", "Data Processing", "Data Storage", "Device Control", "Display", "Other", "Sensors",
        "Signal Input/Output", "Timing", "Uncategorized",
    }  # fmt: skip
    architectures = fields["architectures"].split(",")
    assert {"esp32", "samd", "stm32", "rp2040"} <= set(architectures)
    assert not {"avr", "megaavr", "*"} & set(architectures)  # no C++17
    for name in fields["includes"].split(","):
        assert (library / "src" / name).is_file()
    for sketch in (library / "examples").iterdir():
        assert (sketch / f"{sketch.name}.ino").is_file()
    assert not [name for name in ("utility", "arch") if (library / name).exists()]
    assert not list(library.rglob("*.exe"))


def test_the_keywords_are_names_of_the_headers(library: Path) -> None:
    text = (library / "palpate_one.hpp").read_text(encoding="utf-8")
    for line in (library / "keywords.txt").read_text().splitlines():
        if not line.startswith("#"):
            word, kind = line.split("\t")
            assert kind in {"KEYWORD1", "KEYWORD2", "LITERAL1"}
            assert re.search(rf"\b{word}\b", text), word


def test_what_platformio_wants(library: Path) -> None:
    manifest = json.loads((library / "library.json").read_text())
    assert (manifest["name"], manifest["version"]) == ("palpate", palpate.__version__)
    assert re.fullmatch(r"[\w.-]{1,100}", manifest["name"])
    assert all(re.fullmatch(r"[a-z\d\-+ ]{1,50}", word) for word in manifest["keywords"])
    assert 0 < len(manifest["description"]) <= 255
    assert manifest["repository"]["url"] == SOURCE
    assert "atmelavr" not in manifest["platforms"]
    assert all((library / "src" / name).is_file() for name in manifest["headers"])


def test_a_compiler_without_c17_gets_a_sentence(library: Path) -> None:
    with pytest.raises(AssertionError, match="palpate needs C\\+\\+17"):
        run(need("c++"), "-std=gnu++14", "-fsyntax-only", f"-I{library / 'src'}", library / "src" / "palpate.h")


@pytest.fixture(scope="module")
def measured(library: Path, tmp_path_factory: pytest.TempPathFactory) -> str:
    """Run the sketch on this machine; all warnings are errors, as for the headers."""
    program = tmp_path_factory.mktemp("host") / "sketch"
    run(need("c++"), *STRICT, *sources(library), "-o", program)
    return run(program)


def sources(library: Path) -> list[str | Path]:
    sketch = library / "examples" / "palpate_instrument"
    includes = [f"-I{folder}" for folder in (STUB, library / "src", sketch)]
    ino: list[str | Path] = ["-x", "c++", "-include", "Arduino.h", sketch / "palpate_instrument.ino", "-x", "none"]
    return [*includes, *ino, sketch / "loop.cpp", STUB / "board.cpp"]


def test_the_sketch_measures_both_touches(measured: str) -> None:
    lines = measured.splitlines()
    assert lines[0] == f"# palpate {palpate.__version__}: do not touch the probe"
    assert lines[1].startswith("# AD7746 at 0x48: no answer.")
    touches = [line for line in lines if line.startswith("ratio")]
    assert len(touches) == 2
    for line, ratio in zip(touches, (26 / 8, 63 / 8), strict=True):  # of bench/embedded/readings.hpp
        found, error = (float(number) for number in re.findall(r"(\d+\.\d{4}) \(", line))
        assert abs(found - ratio) < 4 * error
        assert error < 0.001 * ratio
    assert "samples 250, saturated 0, refused 2, dropped 0" in touches[0]  # a reading that is NaN, and its neighbour


def test_a_microcontroller_prints_the_same_bits(library: Path, measured: str, tmp_path: Path) -> None:
    """With the flags of an Arduino core: no -ffp-contract=off, and an M4F has a fused multiply-add."""
    program = tmp_path / "sketch.elf"
    processor = ["-mthumb", "-mcpu=cortex-m4", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard"]
    flags = [*processor, "-std=gnu++17", "-Os", "-fno-exceptions", "-fno-rtti", "-Wall", "-Werror"]
    flags += ["-fno-threadsafe-statics", "-ffunction-sections", "-fdata-sections", "-Wl,--gc-sections"]
    link: list[str | Path] = ["-nostartfiles", "-T", EMBEDDED / "firmware.ld"]
    run(need("arm-none-eabi-g++"), *flags, *sources(library), EMBEDDED / "startup.cpp", *link, "-o", program)
    quiet = ["-nographic", "-monitor", "none", "-serial", "none", "-semihosting-config", "enable=on,target=native"]
    done = subprocess.run(
        [need("qemu-system-arm"), "-M", "mps2-an386", *quiet, "-kernel", program],
        capture_output=True, text=True, check=True, stdin=subprocess.DEVNULL,
    )  # fmt: skip
    assert done.stdout + done.stderr == measured
