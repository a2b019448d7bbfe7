"""What a user writes in C++: the examples compile and print what is expected, and each compiler error has its sentence."""

import re
import subprocess
from pathlib import Path

import numpy as np
import palpate
import pytest
from project import ROOT, STRICT, asked, need, run

COMPILERS = pytest.mark.parametrize("compiler", ["g++", "clang++"])
PAGE = (ROOT / "docs" / "compiler_errors.md").read_text(encoding="utf-8")
ERRORS = re.findall(
    r"^## `+(.+?) ?`+\n\n```cpp\n(?:// with (\S+)\n)?(.+?)^```$", PAGE, re.DOTALL | re.MULTILINE
)
PRINTED = {
    "page_hinkley": "alarm at sample 200, then ratio 3.00, mean |e| 0.010 pF\n",
    "fortescue": "sample 199: ratio 2.50, lambda 1.00\nsample 200: ratio 2.50, lambda 0.20\n"
    "sample 220: ratio 3.00, lambda 1.00\n",
    "mean_of_two": "ratio 2.5000, without an alignment 2.4932\n",
}


def made(compiler: str, name: str, folder: Path) -> Path:
    """Compile an example with all warnings as errors."""
    source = ROOT / "cpp" / "examples" / f"{name}.cpp"
    run(
        need(compiler),
        *STRICT,
        "-O1",
        "-ffp-contract=off",
        asked("--includes"),
        source,
        "-o",
        folder / name,
    )
    return folder / name


@COMPILERS
@pytest.mark.parametrize("name", PRINTED)
def test_an_example_prints_what_is_expected(name: str, compiler: str, tmp_path: Path) -> None:
    assert run(made(compiler, name, tmp_path)) == PRINTED[name]


@COMPILERS
def test_the_ratio_of_a_file_is_that_of_python(compiler: str, tmp_path: Path) -> None:
    noise = np.random.default_rng(1).normal(0, 1e-4, 300)
    regressor = 0.25 + 0.01 * np.sin(np.arange(300))
    output = 2.5 * regressor + noise
    np.savetxt(tmp_path / "columns.txt", np.transpose([output, regressor]), fmt="%.17g")
    estimator = palpate.HandoverRls()
    estimator.process(output, regressor)
    program = made(compiler, "ratio_of_file", tmp_path)
    printed = re.findall(r"\d[\d.e-]*", run(program, tmp_path / "columns.txt").replace(",", ""))
    assert [float(number) for number in printed] == [
        estimator.ratio,
        estimator.standard_error,
        300,
        300,
    ]
    (tmp_path / "columns.txt").write_text("2.5 1\ntwo 1\n")
    done = subprocess.run(
        [program, tmp_path / "columns.txt"], capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (2, "not a file of two columns of numbers: line 2\n")


@COMPILERS
@pytest.mark.parametrize(
    ("sentence", "flag", "text"), ERRORS, ids=[sentence for sentence, _, _ in ERRORS]
)
def test_a_compiler_error_has_its_sentence(
    sentence: str, flag: str, text: str, compiler: str, tmp_path: Path
) -> None:
    (tmp_path / "error.cpp").write_text(f"#include <palpate/palpate.hpp>\n{text}")
    command = [
        need(compiler),
        "-std=c++17",
        *filter(None, [flag]),
        asked("--includes"),
        "-fsyntax-only",
        "error.cpp",
    ]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode != 0
    first = next(line for line in done.stderr.splitlines() if "error:" in line)
    assert sentence in first


def test_every_error_of_the_page_is_compiled() -> None:
    assert len(ERRORS) == PAGE.count("\n## ") == 22
