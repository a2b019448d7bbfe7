"""The headers of a release: all as one file, and their archive, with a sketch of it that measures."""

import json
import re
import subprocess
import sys
import zipfile
from pathlib import Path

import palpate
import pytest
from project import ROOT, STRICT, need, run

from bench.embedded.firmware import Target, library_headers
from release import headers
from release.headers import in_order, one_header

SOURCE = "https://forge.invalid/palpate"
BOARD = ROOT / "tests" / "tools" / "arduino"  # its Wire.h


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Make the archive by its command, and unpack it."""
    folder = tmp_path_factory.mktemp("archive")
    command: list[str | Path] = [sys.executable, "-m", "release.headers", folder, SOURCE]
    made = Path(subprocess.check_output(command, cwd=ROOT, text=True).strip())
    headers.write(again := folder / "again.zip", SOURCE)
    assert made.read_bytes() == again.read_bytes()
    with zipfile.ZipFile(made) as archive:
        archive.extractall(folder)
    assert {(info.date_time, info.create_system) for info in archive.infolist()} == {
        ((1980, 1, 1, 0, 0, 0), 3)
    }
    assert archive.namelist() == sorted(archive.namelist())
    [only] = {name.split("/")[0] for name in archive.namelist()}
    return folder / only


def test_what_arduino_and_platformio_want(library: Path) -> None:
    """Arduino library specification 1.5, and library.json: the fields, their forms, and the folders."""
    fields = dict(
        line.split("=", 1) for line in (library / "library.properties").read_text().splitlines()
    )
    assert all(
        fields[name].strip() for name in ("author", "maintainer", "sentence", "paragraph", "url")
    )
    assert (fields["name"], fields["version"], fields["category"]) == (
        "palpate",
        palpate.__version__,
        "Sensors",
    )
    architectures = set(fields["architectures"].split(","))
    assert {"esp32", "samd", "stm32", "rp2040"} <= architectures
    assert not {"avr", "megaavr", "*"} & architectures  # no C++17
    assert all(
        (sketch / f"{sketch.name}.ino").is_file() for sketch in (library / "examples").iterdir()
    )
    manifest = json.loads((library / "library.json").read_text())
    assert (manifest["name"], manifest["version"]) == ("palpate", palpate.__version__)
    assert manifest["repository"]["url"] == SOURCE
    assert "atmelavr" not in manifest["platforms"]
    assert all(
        (library / "src" / name).is_file()
        for name in (*fields["includes"].split(","), *manifest["headers"])
    )
    text = (library / "palpate_one.hpp").read_text(encoding="utf-8")
    for line in (library / "keywords.txt").read_text().splitlines():
        assert line.startswith("#") or re.search(rf"\b{line.split()[0]}\b", text), line


def test_a_compiler_without_c17_gets_a_sentence(library: Path) -> None:
    with pytest.raises(AssertionError, match="palpate needs C\\+\\+17"):
        run(
            need("c++"),
            "-std=gnu++14",
            "-fsyntax-only",
            f"-I{library / 'src'}",
            library / "src" / "palpate.h",
        )


def sources(library: Path) -> list[str | Path]:
    sketch = library / "examples" / "palpate_instrument"
    includes = [f"-I{folder}" for folder in (BOARD, library / "src", sketch)]
    ino: list[str | Path] = ["-x", "c++", sketch / "palpate_instrument.ino", "-x", "none"]
    return [*includes, *ino, sketch / "loop.cpp"]


def test_the_sketch_measures_both_touches(library: Path, tmp_path: Path) -> None:
    """All warnings are errors, as for the headers."""
    run(need("c++"), *STRICT, *sources(library), "-o", tmp_path / "sketch")
    lines = run(tmp_path / "sketch").splitlines()
    assert lines[0] == f"# palpate {palpate.__version__}: do not touch the probe"
    assert sum(line.startswith("# AD7746 at 0x48: no answer.") for line in lines) == 2  # 0.2 s
    assert sum(line.startswith("# EXCERR") for line in lines) == 2
    touches = [line for line in lines if line.startswith("ratio")]
    assert len(touches) == 2
    for line in touches:
        found, error = (float(number) for number in re.findall(r"\d+\.\d{4}", line))
        assert abs(found - 2.5) < 4 * error < 0.001 * 2.5  # the ratio of ../tools/arduino/chip.hpp
    assert "samples 150, saturated 0, refused 2, dropped 0" in touches[0]  # without excitation


def test_the_sketch_compiles_with_the_flags_of_an_arduino_core(library: Path) -> None:
    flags = (
        "-mthumb",
        "-mcpu=cortex-m4",
        "-std=gnu++17",
        "-Os",
        "-fno-exceptions",
        "-fno-rtti",
        "-Wall",
        "-Werror",
    )
    run(need("arm-none-eabi-g++"), *flags, "-fsyntax-only", *sources(library))


SCENE = """#include "palpate_one.hpp"
palpate::embedded::HandheldTracker<float> probe;
bool feed(std::uint32_t t_hard, std::uint32_t t_soft, float hard, float soft) {
  return probe.feed(palpate::Microseconds(t_hard), palpate::Microseconds(t_soft), hard, soft).finished;
}
"""
FREESTANDING = (
    "-std=c++17",
    "-Os",
    "-ffreestanding",
    "-fno-exceptions",
    "-fno-rtti",
    "-Wall",
    "-Wextra",
    "-Werror",
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Give an include folder with the one header."""
    made = tmp_path_factory.mktemp("one")
    (made / "palpate_one.hpp").write_text(one_header(), encoding="utf-8")
    return made


def test_it_has_every_header_once_and_each_standard_header_once() -> None:
    text, headers, include = one_header(), in_order(), ROOT / "cpp" / "include"
    others = {path.relative_to(include).as_posix() for path in include.rglob("*.hpp")} - set(
        headers
    )
    assert others == {"palpate/design.hpp"}  # only for computers
    assert re.findall(r"^// (palpate/\S+\.hpp)$", text, re.MULTILINE) == headers
    includes = re.findall(r"^\s*#\s*include (.*)", text, re.MULTILINE)
    assert len(includes) == len(set(includes)) > 4
    assert not [name for name in includes if "palpate" in name]
    assert text.count("#pragma once") == 1
    assert f'#define PALPATE_VERSION "{palpate.__version__}"' in text
    assert "Permission is hereby granted" in text
    for header in headers:  # what stands in a header, stands in it
        body = (include / header).read_text(encoding="utf-8").partition("namespace palpate")[2]
        assert body.strip() in text, header


@pytest.mark.parametrize("compiler", ["c++", "clang++"])
def test_two_units_of_one_program(folder: Path, tmp_path: Path, compiler: str) -> None:
    main = (ROOT / "tests" / "cpp" / "consumer" / "main.cpp").read_text()
    units = {
        "main.cpp": main.replace("<palpate/palpate.hpp>", '"palpate_one.hpp"'),
        "scene.cpp": SCENE,
    }
    for name, text in units.items():
        (tmp_path / name).write_text(text)
    program = tmp_path / "program"
    run(need(compiler), *STRICT, f"-I{folder}", *(tmp_path / name for name in units), "-o", program)
    assert run(program) == f"palpate {palpate.__version__}: ratio 2.000\n"


@pytest.mark.parametrize(
    "target",
    [
        Target("m0+", ("arm-none-eabi-g++", "-mthumb", "-mcpu=cortex-m0plus"), "microbit"),
        Target("esp32c3", ("riscv64-unknown-elf-g++", "-march=rv32imc", "-mabi=ilp32")),
        Target("esp8266", ("xtensa-lx106-elf-g++", "-mlongcalls")),
    ],
    ids=lambda target: str(target.name),
)
def test_microcontrollers(folder: Path, tmp_path: Path, target: Target) -> None:
    # which has the C++ headers for those that have none
    for program in (target.compiler[0], "arm-none-eabi-g++"):
        need(program)
    source, made = tmp_path / "scene.cpp", tmp_path / "scene.o"
    source.write_text(SCENE)
    run(
        *target.compiler,
        *FREESTANDING,
        *library_headers(target),
        f"-I{folder}",
        "-c",
        source,
        "-o",
        made,
    )
    names = re.findall(r" U (.*)", run(f"{target.tools}nm", "-u", made))
    assert not [name for name in names if not re.match(r"__|mem(cpy|set|move)$", name)], names
