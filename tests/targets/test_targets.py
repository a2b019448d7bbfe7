"""The headers by their include path alone on other processors and systems: the same bits as here, fusing allowed."""

import hashlib
import json
import re
import subprocess
from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest
import targets
from effort import ALL
from project import ROOT, kept_json, need, run
from targets import QUICK, TARGETS, Target

INPUTS = ROOT / "cpp" / "include", ROOT / "tests" / "cpp", ROOT / "bench" / "embedded"


def kept(
    name: str, compiler: str, make: Callable[[], dict[str, list[str]]]
) -> dict[str, list[str]]:
    """Return the lines of each program, compiled and run again if a source or the compiler has changed."""
    found: dict[str, list[str]] = kept_json(
        name,
        INPUTS,
        (need(compiler),),
        lambda made: made.write_text(json.dumps(make()), encoding="utf-8"),
    )
    return found


@cache
def expected() -> dict[str, list[str]]:
    return kept("targets here", "g++", lambda: targets.reference("g++"))


# Of a commit: both compilers, 32 bits, another processor, the other order of bytes, another system, no system.
CHOSEN = (
    TARGETS
    if ALL
    else [
        t for t in TARGETS if t.name not in ("armhf", "riscv64", "ppc64le") and t.printing != QUICK
    ]
)


@pytest.mark.parametrize("target", CHOSEN, ids=lambda t: f"{t.name}-{t.compiler[0]}")
def test_the_same_bits_by_the_include_path_alone(target: Target) -> None:
    for tool in target.tools:
        need(tool)
    made = kept(f"target {target}", target.compiler[0], lambda: targets.outputs(target))
    assert list(made) == [*target.printing, *target.checking]
    for program in target.printing:
        assert made[program] == expected()[program], (target.name, program)


def test_the_bits_are_as_they_were() -> None:
    printed = {program: "\n".join(expected()[program]).encode() for program in targets.PRINTING}
    hashes = {program: hashlib.sha256(text).hexdigest()[:12] for program, text in printed.items()}
    assert hashes == {
        "bits": "9e203e94a97c",
        "hostile": "998bd523cfdd",
        "vectors": "86ff9831bc0b",
        "scenes": "dd040f12c59d",
    }


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
    flags = (*flags, "-nostdinc", INCLUDE, "-std=c++17", "-O2", "-ffp-contract=fast")
    run(need(compiler), *flags, "-S", source, "-o", made)
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
    command = [
        need(compiler),
        *flags,
        INCLUDE,
        "-std=c++17",
        "-E",
        str(source),
        "-o",
        str(folder / "said.i"),
    ]
    return subprocess.run(command, check=False, capture_output=True, text=True).stderr


def test_vectors_of_32_bit_arm_are_refused(tmp_path: Path) -> None:
    neon = ("-D__arm__", "-D__ARM_NEON")  # the headers of such a target need not be here
    assert "vectors of 32-bit ARM" in said("clang++", *neon, folder=tmp_path)
    assert (
        said("clang++", *neon, "-DPALPATE_VECTORS_OFF", folder=tmp_path).count("palpate needs") == 0
    )


def test_other_arithmetic_is_refused_with_the_flags_to_add(tmp_path: Path) -> None:
    assert "add -msse2 -mfpmath=sse" in said(
        "g++", "-U__FLT_EVAL_METHOD__", "-D__FLT_EVAL_METHOD__=2", folder=tmp_path
    )
    unknown = ("-U__GNUC__", "-nostdinc")
    assert "does not know this compiler" in said(
        "g++", *unknown, header="contraction", folder=tmp_path
    )
    assert (
        said("g++", *unknown, "-DPALPATE_CONTRACTION_OFF", header="contraction", folder=tmp_path)
        == ""
    )
    assert said("g++", *unknown, "-D_MSC_VER=1930", header="contraction", folder=tmp_path) == ""
    assert "fp_contract(off)" in (tmp_path / "said.i").read_text()
    assert "needs IEEE arithmetic" in said("g++", "-D_M_FP_FAST=1", folder=tmp_path)
