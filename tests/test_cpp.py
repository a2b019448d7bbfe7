"""The header for C++ users: ctest, and a foreign project built in each way that is offered."""

import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import palpate
import pytest
from conftest import ROOT, need
from numpy.typing import NDArray

CONSUMER = ROOT / "tests" / "cpp" / "consumer"
EXPECTED = f"palpate {palpate.__version__}: ratio 2.000\n"


def run(*command: str | Path) -> str:
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{command}\n{done.stdout}\n{done.stderr}"
    return done.stdout


@pytest.fixture(scope="session")
def cmake() -> str:
    """Find cmake beside the interpreter, as the test extra installs it, or the system's."""
    os.environ["PATH"] = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    return need("cmake")


def configure(cmake: str, source: Path, build: Path, *options: str) -> None:
    run(cmake, "-S", source, "-B", build, "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release", *options)
    run(cmake, "--build", build)


def fnv(*arrays: NDArray[Any]) -> str:
    """Hash the bytes of the arrays' items in turn, as tests/cpp/bits.cpp does."""
    value = 14695981039346656037
    for row in zip(*arrays, strict=True):
        for item in row:
            for byte in item.tobytes():
                value = ((value ^ byte) * 1099511628211) & 0xFFFFFFFFFFFFFFFF
    return f"{value:016x}"


def touch_samples(ratio: int) -> tuple[list[float], list[float]]:
    """Make the samples of tests/cpp/samples.hpp."""
    output, regressor, state = [], [], 12345
    for i in range(250):
        state = (state * 1664525 + 1013904223) & 0xFFFFFFFF
        noise = (state >> 20) - 2048
        press = 400 + (4 * i if i < 100 else 400)
        regressor.append(press / 2048)
        eighths = ratio if i < 180 else ratio + 6
        output.append((press * eighths * 16 + int(noise / 8)) / 262144)
    return output, regressor


def touch_hash(name: str) -> str:
    """Hash two touches through an estimator of the extension."""
    rows = np.concatenate([getattr(palpate, name)().trace(*touch_samples(ratio)) for ratio in (20, 63)])
    return fnv(*(rows[f] for f in ("ratio", "innovation", "covariance", "statistic")))


def bank_hash(name: str) -> str:
    """Hash 21 touches through a bank of the extension, and through as many single estimators in blocks."""
    output, regressor = np.transpose([touch_samples(20 + s) for s in range(21)], (1, 2, 0))
    bank = getattr(palpate, name)(21)
    ratios = bank.process(output, regressor)
    singles = [getattr(palpate, name.replace("Bank", ""))() for _ in range(21)]
    for s, single in enumerate(singles):
        assert single.process(output[:, s], regressor[:, s]).tobytes() == ratios[:, s].tobytes()
    state = np.ravel([bank.covariance, bank.statistic], order="F")
    return fnv(np.concatenate([ratios.ravel(), state]))


@pytest.mark.parametrize("compiler", ["c++", "clang++"])
def test_ctest_and_the_bits_of_the_extension(cmake: str, tmp_path: Path, compiler: str) -> None:
    configure(cmake, ROOT, tmp_path, f"-DCMAKE_CXX_COMPILER={need(compiler)}")
    out = run("ctest", "--test-dir", tmp_path, "--output-on-failure", "--no-tests=error")
    assert "100% tests passed" in out
    hashes = dict(line.split() for line in run(tmp_path / "tests" / "cpp" / "bits").splitlines())
    print(*hashes.items(), sep="\n")
    assert len(hashes) == 10
    for name, value in hashes.items():
        assert (bank_hash if "Bank" in name else touch_hash)(name) == value, name


def test_consumer_by_find_package_in_the_installed_package(cmake: str, tmp_path: Path) -> None:
    prefix = Path(palpate.get_include()).parent
    configure(cmake, CONSUMER, tmp_path, f"-DCMAKE_PREFIX_PATH={prefix}")
    assert run(tmp_path / "consumer") == EXPECTED


def test_consumer_by_cmake_install(cmake: str, tmp_path: Path) -> None:
    configure(cmake, ROOT, tmp_path / "palpate", "-DBUILD_TESTING=OFF", f"-DCMAKE_INSTALL_PREFIX={tmp_path / 'prefix'}")
    run(cmake, "--install", tmp_path / "palpate")
    configure(cmake, CONSUMER, tmp_path / "consumer", f"-DCMAKE_PREFIX_PATH={tmp_path / 'prefix'}")
    assert run(tmp_path / "consumer" / "consumer") == EXPECTED


def test_consumer_by_add_subdirectory(cmake: str, tmp_path: Path) -> None:
    configure(cmake, CONSUMER, tmp_path, f"-DPALPATE_SOURCE={ROOT}")
    assert run(tmp_path / "consumer") == EXPECTED


def test_consumer_by_include_folder(tmp_path: Path) -> None:
    compiler = need("c++")
    program = tmp_path / "consumer"
    run(compiler, "-std=c++17", f"-I{palpate.get_include()}", CONSUMER / "main.cpp", "-o", program)
    assert run(program) == EXPECTED


@pytest.mark.parametrize("compiler", ["c++", "clang++"])
def test_the_readmes_cpp_compiles(tmp_path: Path, compiler: str) -> None:
    [block] = re.findall(r"```cpp\n(.*?)```", (ROOT / "README.md").read_text(), re.DOTALL)
    include, body = block.split("\n", 1)
    values = "std::uint32_t t_hard, std::uint32_t t_soft, float hard, float soft, float output, float regressor"
    source = tmp_path / "readme.cpp"
    source.write_text(f"{include}\nfloat use({values}) {{\n{body}\nreturn report.ratio + step.ratio;\n}}\n")
    run(
        need(compiler),
        "-std=c++17",
        "-Wall",
        "-Wextra",
        "-Werror",
        f"-I{palpate.get_include()}",
        "-fsyntax-only",
        source,
    )


def test_the_header_needs_nothing_at_link_time(tmp_path: Path) -> None:
    """No heap, no exceptions, no library: an object with a whole estimator in it leaves no symbol undefined."""
    source, program = tmp_path / "scene.cpp", tmp_path / "scene.o"
    source.write_text(
        "#include <palpate/palpate.hpp>\n"
        "bool take(palpate::AdaptiveRls<float>& e, float y, float x) { return e.update(y, x).alarm; }\n"
        "bool take(palpate::FixedRls<double>& e, double y, double x) { return e.update(y, x).accepted; }\n"
    )
    flags = ["-std=c++17", "-O2", "-ffreestanding", "-fno-exceptions", "-fno-rtti"]
    run(need("c++"), *flags, f"-I{palpate.get_include()}", "-c", source, "-o", program)
    assert run(need("nm"), "-u", program) == ""
