"""All headers as one file: the same code, once, for every compiler that the headers are for."""

import re
from pathlib import Path

import palpate
import pytest
from building import STRICT, run
from project import ROOT, need

from bench.embedded.firmware import Target, library_headers
from release.one_header import in_order, one_header

SCENE = """#include "palpate_one.hpp"
palpate::embedded::HandheldTracker<float> probe;
bool feed(std::uint32_t a, std::uint32_t b, float hard, float soft) { return probe.feed(a, b, hard, soft).finished; }
"""
FREESTANDING = ("-std=c++17", "-Os", "-ffreestanding", "-fno-exceptions", "-fno-rtti", "-Wall", "-Wextra", "-Werror")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Give an include folder with the one header."""
    made = tmp_path_factory.mktemp("one")
    (made / "palpate_one.hpp").write_text(one_header(), encoding="utf-8")
    return made


def test_it_has_every_header_once_and_each_standard_header_once() -> None:
    text, headers = one_header(), in_order()
    assert set(headers) == {
        path.relative_to(ROOT / "cpp" / "include").as_posix() for path in (ROOT / "cpp" / "include").rglob("*.hpp")
    }
    assert re.findall(r"^// (palpate/\S+\.hpp)$", text, re.MULTILINE) == headers
    includes = re.findall(r"^\s*#\s*include (.*)", text, re.MULTILINE)
    assert len(includes) == len(set(includes)) > 4
    assert not [name for name in includes if "palpate" in name]
    assert text.count("#pragma once") == 1
    assert f'#define PALPATE_VERSION "{palpate.__version__}"' in text
    assert "Permission is hereby granted" in text
    for header in headers:  # what stands in a header, stands in it
        body = (ROOT / "cpp" / "include" / header).read_text(encoding="utf-8").partition("namespace palpate")[2]
        assert body.strip() in text, header


@pytest.mark.parametrize("compiler", ["c++", "clang++"])
def test_two_units_of_one_program(folder: Path, tmp_path: Path, compiler: str) -> None:
    main = (
        (ROOT / "tests" / "cpp" / "consumer" / "main.cpp")
        .read_text()
        .replace("<palpate/palpate.hpp>", '"palpate_one.hpp"')
    )
    for name, text in (("main", main), ("scene", SCENE)):
        (tmp_path / f"{name}.cpp").write_text(text)
    program = tmp_path / "program"
    run(need(compiler), *STRICT, f"-I{folder}", tmp_path / "main.cpp", tmp_path / "scene.cpp", "-o", program)
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
    for program in (target.compiler[0], "arm-none-eabi-g++"):  # which has the C++ headers for those that have none
        need(program)
    source, made = tmp_path / "scene.cpp", tmp_path / "scene.o"
    source.write_text(SCENE)
    run(*target.compiler, *FREESTANDING, *library_headers(target), f"-I{folder}", "-c", source, "-o", made)
    names = re.findall(r" U (.*)", run(f"{target.tools}nm", "-u", made))
    assert not [name for name in names if not re.match(r"__|mem(cpy|set|move)$", name)], names


def test_the_bits_are_those_of_the_headers(folder: Path, tmp_path: Path) -> None:
    for header in in_order():  # tests/cpp/bits.cpp includes headers: each is the one header here
        path = tmp_path / "include" / header
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text('#include "palpate_one.hpp"\n')
    printed = []
    for name, include in (("one", tmp_path / "include"), ("many", ROOT / "cpp" / "include")):
        flags = ("-std=c++17", "-O0", f"-I{include}", f"-I{folder}")
        run(need("c++"), *flags, ROOT / "tests" / "cpp" / "bits.cpp", "-o", tmp_path / name)
        printed.append(run(tmp_path / name))
    assert len(printed[0].splitlines()) > 10
    assert printed[0] == printed[1]


def test_it_does_not_stand_beside_the_headers(folder: Path, tmp_path: Path) -> None:
    source = tmp_path / "both.cpp"
    source.write_text('#include <palpate/palpate.hpp>\n#include "palpate_one.hpp"\n')
    with pytest.raises(AssertionError, match="not both"):
        run(need("c++"), "-std=c++17", "-fsyntax-only", f"-I{ROOT / 'cpp' / 'include'}", f"-I{folder}", source)
