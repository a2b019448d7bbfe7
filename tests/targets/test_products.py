"""Where a compiler may fuse a product into a sum: `product` keeps it, on every processor that these compilers know."""

import re
import subprocess
from pathlib import Path

import pytest
from project import ROOT, need

INCLUDE = f"-I{ROOT / 'cpp' / 'include'}"
SOURCE = """
#include <palpate/contraction.hpp>
extern "C" double plain(double a, double b, double c) { return a * b + c; }
extern "C" double apart(double a, double b, double c) { return palpate::product(a, b) + c; }
extern "C" float plain32(float a, float b, float c) { return a * b + c; }
extern "C" float apart32(float a, float b, float c) { return palpate::product(a, b) + c; }
"""
FUSED = re.compile(r"\t(v?fn?madd|vfma|fma\.|xsmadd|ma[de]br|wfma|maddf|madd)")


def fused(compiler: str, *flags: str, folder: Path) -> set[str]:
    """Return the functions in which a compiler has fused a product and a sum."""
    source, made = folder / "product.cpp", folder / "product.s"
    source.write_text(SOURCE)
    command = [
        need(compiler),
        *flags,
        "-nostdinc",
        INCLUDE,
        "-std=c++17",
        "-O2",
        "-ffp-contract=fast",
        "-S",
        str(source),
    ]
    subprocess.run([*command, "-o", str(made)], check=True, capture_output=True)
    found, function = set(), ""
    for line in made.read_text().splitlines():
        if label := re.match(r"_?(plain|apart)(32)?:", line):
            function = label[0].strip("_:")
        elif FUSED.match(line):
            found.add(function)
    return found


BOTH, FLOAT = {"plain", "plain32"}, {"plain32"}
TRIPLES = {
    "x86_64-linux-gnu -mfma": BOTH,
    "x86_64-linux-gnu -mfma4": BOTH,
    "x86_64-pc-windows-msvc -mfma": BOTH,
    "aarch64-linux-gnu": BOTH,
    "aarch64-apple-darwin": BOTH,
    "arm-linux-gnueabihf -mfpu=vfpv4": BOTH,
    "riscv64-linux-gnu -march=rv64gc": BOTH,
    "riscv32-none-elf -march=rv32imafc -mabi=ilp32f": FLOAT,
    "powerpc64le-linux-gnu": BOTH,
    "powerpc64-linux-gnu": BOTH,  # without VSX: in memory
    "powerpc-linux-gnu": BOTH,
    "s390x-linux-gnu": BOTH,
}


@pytest.mark.parametrize("triple", TRIPLES)
def test_clang_fuses_what_is_written_plainly_alone(triple: str, tmp_path: Path) -> None:
    processor, *flags = triple.split()
    assert fused("clang++", f"--target={processor}", *flags, folder=tmp_path) == TRIPLES[triple]


@pytest.mark.parametrize("flags", ["-mfma", "-mfma4", "-mavx512f"])
def test_gcc_fuses_what_is_written_plainly_alone(flags: str, tmp_path: Path) -> None:
    """-mavx512f has instructions that fuse, and does not define __FMA__."""
    assert fused("g++", flags, folder=tmp_path) == BOTH


def said(compiler: str, *flags: str, header: str = "arithmetic", folder: Path) -> str:
    """Return what a compiler's preprocessor says of a header: empty if it takes it."""
    source = folder / "said.cpp"
    source.write_text(f"#include <palpate/{header}.hpp>\n")
    command = [need(compiler), *flags, INCLUDE, "-std=c++17", "-E", str(source), "-o", str(folder / "said.i")]
    return subprocess.run(command, check=False, capture_output=True, text=True).stderr


def test_what_cannot_be_mended_is_an_error_that_says_what_to_pass(tmp_path: Path) -> None:
    neon = ("--target=arm-linux-gnueabihf", "-mfpu=neon-vfpv4")
    assert "add -msse2 -mfpmath=sse" in said("g++", "-m32", "-mno-sse", folder=tmp_path)
    assert "vectors of 32-bit ARM" in said("clang++", *neon, folder=tmp_path)
    assert said("clang++", *neon, "-DPALPATE_VECTORS_OFF", folder=tmp_path).count("palpate needs") == 0
    unknown = ("-U__GNUC__", "-nostdinc")
    assert "does not know this compiler" in said("g++", *unknown, header="contraction", folder=tmp_path)
    assert said("g++", *unknown, "-DPALPATE_CONTRACTION_OFF", header="contraction", folder=tmp_path) == ""
    assert said("g++", *unknown, "-D_MSC_VER=1930", header="contraction", folder=tmp_path) == ""
    assert "fp_contract(off)" in (tmp_path / "said.i").read_text()
    assert "needs IEEE arithmetic" in said("g++", "-D_M_FP_FAST=1", folder=tmp_path)
