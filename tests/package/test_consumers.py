"""A foreign C++ project, built in each way that is offered."""

import json
import subprocess
import tarfile
from pathlib import Path

import palpate
import pytest
from project import ROOT, STRICT, asked, configure, need, of_a_wheel, run

CONSUMER = ROOT / "tests" / "cpp" / "consumer"
EXPECTED = f"palpate {palpate.__version__}: ratio 2.000\n"
COMPILERS = ("c++", "clang++")


@of_a_wheel
def test_the_package_under_test_is_installed() -> None:
    assert (
        ROOT not in Path(palpate.get_include()).relative_to(Path(palpate.__file__).parent).parents
    )
    assert (
        Path(palpate.__file__).parents[1] / f"palpate-{palpate.__version__}.dist-info" / "RECORD"
    ).is_file()
    assert asked("--includes") == f"-I{palpate.get_include()}"
    assert asked("--cmakedir") == palpate.get_cmake_dir()


def test_find_package_in_the_folder_that_the_package_tells(cmake: str, tmp_path: Path) -> None:
    configure(cmake, CONSUMER, tmp_path, f"-Dpalpate_DIR={asked('--cmakedir')}")
    assert run(tmp_path / "consumer") == EXPECTED


@pytest.mark.parametrize("source", ["package", "sources", "archive"])
def test_add_subdirectory_and_fetch_content(cmake: str, tmp_path: Path, source: str) -> None:
    """The archive is as a forge makes of a tag: everything below one folder."""
    archive = tmp_path / "v1.tar.gz"
    with tarfile.open(archive, "w:gz") as made:
        for name in ("CMakeLists.txt", "LICENSE", "cpp"):
            made.add(ROOT / name, f"palpate-1/{name}")
    wanted = {
        "package": f"SOURCE={asked('--cmakedir')}",
        "sources": f"SOURCE={ROOT}",
        "archive": f"ARCHIVE={archive}",
    }
    configure(cmake, CONSUMER, tmp_path / "build", f"-DPALPATE_{wanted[source]}")
    assert run(tmp_path / "build" / "consumer") == EXPECTED


def test_without_a_compiler_the_error_names_the_package(cmake: str, tmp_path: Path) -> None:
    programs = tmp_path / "bin"
    programs.mkdir()
    (programs / "cmake").symlink_to(cmake)
    done = subprocess.run(
        # of a program that builds, CMake only asks whether it exists
        [
            programs / "cmake",
            f"-DCMAKE_MAKE_PROGRAM={need('sh')}",
            "-S",
            ROOT,
            "-B",
            tmp_path / "build",
        ],
        env={"PATH": str(programs)},
        capture_output=True,
        text=True,
        check=False,
    )
    message = " ".join(done.stderr.split())
    assert done.returncode != 0
    assert "no C++ compiler found, allowed: one of C++17: sudo apt install g++" in message
    assert "xcode-select --install (macOS)" in message


def test_cmake_install(cmake: str, tmp_path: Path) -> None:
    prefix = tmp_path / "prefix"
    configure(
        cmake, ROOT, tmp_path / "palpate", "-DBUILD_TESTING=OFF", f"-DCMAKE_INSTALL_PREFIX={prefix}"
    )
    run(cmake, "--install", tmp_path / "palpate")
    licence = prefix / "share" / "licenses" / "palpate" / "LICENSE"
    assert licence.read_bytes() == (ROOT / "LICENSE").read_bytes()
    configure(cmake, CONSUMER, tmp_path / "consumer", f"-DCMAKE_PREFIX_PATH={prefix}")
    assert run(tmp_path / "consumer" / "consumer") == EXPECTED


MIXED = """
cmake_minimum_required(VERSION 3.21)
project(mixed LANGUAGES C CXX)
add_subdirectory(${PALPATE_SOURCE} palpate)
add_library(mixed OBJECT part.c part.cpp)
target_link_libraries(mixed palpate::palpate)
"""


def test_the_flags_are_for_cpp_only(cmake: str, tmp_path: Path) -> None:
    """A program in C and C++ keeps its own floating-point flags in C."""
    need("gcc")
    (tmp_path / "CMakeLists.txt").write_text(MIXED)
    (tmp_path / "part.c").write_text(
        "#ifdef PALPATE_CONTRACTION_OFF\n#error of another language\n#endif\nint part;\n"
    )
    (tmp_path / "part.cpp").write_text("#include <palpate/palpate.hpp>\n")
    build = tmp_path / "build"
    configure(
        cmake, tmp_path, build, f"-DPALPATE_SOURCE={ROOT}", "-DCMAKE_EXPORT_COMPILE_COMMANDS=ON"
    )
    commands = json.loads((build / "compile_commands.json").read_text())
    flags = {Path(c["file"]).name: "-ffp-contract=off" in c["command"] for c in commands}
    assert flags == {"part.c": False, "part.cpp": True}


@pytest.mark.parametrize("compiler", COMPILERS)
def test_include_folder(tmp_path: Path, compiler: str) -> None:
    program = tmp_path / "consumer"
    run(need(compiler), *STRICT, asked("--includes"), CONSUMER / "main.cpp", "-o", program)
    assert run(program) == EXPECTED


@pytest.mark.parametrize(
    "flag", ["-ffast-math", "-ffinite-math-only", "-fassociative-math", "-freciprocal-math"]
)
def test_arithmetic_that_is_not_ieee_is_refused(flag: str) -> None:
    more = [
        "-fno-signed-zeros",
        "-fno-trapping-math",
        flag,
        asked("--includes"),
        "-std=c++17",
        "-fsyntax-only",
    ]
    command = [need("g++"), *more, "-x", "c++", "-include", "palpate/palpate.hpp", "/dev/null"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert "palpate needs IEEE arithmetic" in done.stderr
