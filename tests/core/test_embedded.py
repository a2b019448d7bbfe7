"""The headers on a microcontroller: the same bits as here, and what they may cost there."""

import subprocess
import sys
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from kept import kept_json
from project import ROOT, need

EMBEDDED = ROOT / "bench" / "embedded"
SIMULATED = ("m0", "m3", "m4f", "m7")


@cache
def table(target: str) -> dict[str, Any]:
    """Run bench/embedded/size.py for one target."""
    need("arm-none-eabi-g++")
    programs = need("c++"), need("riscv64-unknown-elf-g++" if target.startswith("rv") else "qemu-system-arm")

    def measure(made: Path) -> None:
        command = [sys.executable, "-m", "bench.embedded.size", "--target", target, "--json", str(made)]
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
        assert made.exists(), done.stdout + done.stderr

    inputs = EMBEDDED, ROOT / "cpp" / "include"
    tables: dict[str, dict[str, Any]] = kept_json(
        f"embedded {target}", inputs, ("arm-none-eabi-g++", *programs), measure
    )
    return tables[target]


@pytest.mark.parametrize("target", SIMULATED)
def test_the_same_bits_as_on_this_machine(target: str) -> None:
    found = table(target)
    assert found["same_bits"], found["results"]
    hashes = dict(line.split() for line in found["results"] if " touch " not in line)
    assert list(hashes) == list(found["subjects"])
    assert hashes.pop("HandheldRuntime") == hashes["HandheldFull"]
    assert hashes.pop("FullContactStage") == hashes["ContactStage"]
    assert hashes.pop("PaperRuntime") == hashes["PaperSafe"]
    assert len(set(hashes.values())) == len(hashes)
    for scene in ("PaperScene", "Handheld", "HandheldMatched", "HandheldUnfitted", "HandheldFull", "Sliding"):
        expected = 4 if scene == "HandheldFull" else 2  # each one again when it is revised
        assert sum(line.startswith(f"{scene} touch ") for line in found["results"]) == expected


@pytest.mark.parametrize("target", [*SIMULATED, "rv32imafc"])
def test_no_heap_no_unwinder_no_double(target: str) -> None:
    subjects = table(target)["subjects"]
    assert {name: row["foreign"] for name, row in subjects.items() if row["foreign"]} == {}


@pytest.mark.parametrize(
    ("subject", "text", "instructions", "state"),
    [("Fixed", 64, 12, 8), ("Paper", 160, 36, 12), ("PaperSafe", 220, 54, 12), ("Gated", 440, 80, 28)],
)
def test_what_it_may_cost_on_a_cortex_m4f(subject: str, text: int, instructions: int, state: int) -> None:
    row = table("m4f")["subjects"][subject]
    assert row["text"]["-Os"] <= text
    assert row["worst"] <= instructions
    assert row["state"] <= state
    assert row["stack"] == 0


def test_what_handheld_may_cost_on_a_cortex_m4f() -> None:
    """The lean scene, and the full one with the matched pair, the fit and the revision."""
    lean, full = (table("m4f")["subjects"][name] for name in ("Handheld", "HandheldFull"))
    assert lean["state"] <= 548
    assert lean["text"]["-Os"] <= 5200
    assert lean["mean"] <= 445  # QEMU counts ticks of 40 instructions
    assert lean["worst"] <= 645
    assert lean["stack"] <= 208
    assert full["state"] <= 832
    assert full["text"]["-Os"] <= 10700
    assert full["worst"] <= 12500  # once, at the end of a touch: the flags
    assert full["mean"] <= 840
    assert full["stack"] <= 712


def test_what_paper_may_cost_without_an_fpu() -> None:
    assert table("m0")["subjects"]["Paper"]["worst"] <= 1700


FLAGS = ["-std=c++17", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Werror", "-fno-exceptions", "-fno-rtti"]
INCLUDE = f"-I{ROOT / 'cpp' / 'include'}"


def test_the_example_of_a_loop_measures(tmp_path: Path) -> None:
    program, sources = tmp_path / "loop", [EMBEDDED / "ad7746" / name for name in ("loop.cpp", "simulated.cpp")]
    subprocess.run([need("c++"), *FLAGS, INCLUDE, *sources, "-o", program], check=True)
    done = subprocess.run([program], capture_output=True, text=True, check=True)
    warned, *touches, centred = done.stdout.splitlines()
    assert warned == "EXCERR: the pin EXCB is shorted or has too large a load"
    assert [line.split(",")[1:] for line in touches] == [
        [" 250 samples", " 0 saturated", " 1 refused", " 0 dropped"],
        [" 139 samples", " 0 saturated", " 0 refused", " 0 dropped"],
    ]
    assert [round(float(line.split()[1]), 1) for line in touches] == [3.2, 7.9]
    # The largest step that leaves the idle gauges above the middle: 7.545 and 4.315 pF, 0.171 pF a step.
    assert centred == f"CAPDAC {int(7.545 / 0.171)}, {int(4.315 / 0.171)}"


def test_the_example_of_a_loop_compiles_for_a_cortex_m4f(tmp_path: Path) -> None:
    compiler, made = need("arm-none-eabi-g++"), tmp_path / "loop.o"
    processor = ["-mthumb", "-mcpu=cortex-m4", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard", "-ffreestanding"]
    source = EMBEDDED / "ad7746" / "loop.cpp"
    subprocess.run([compiler, *FLAGS, *processor, INCLUDE, "-Os", "-c", source, "-o", made], check=True)
    symbols = subprocess.run([need("arm-none-eabi-nm"), "-Cu", made], capture_output=True, text=True, check=True)
    needed = [line.split("U ")[1] for line in symbols.stdout.splitlines()]
    assert all(name.startswith("hal::") or name in {"memset", "memcpy"} for name in needed), needed
    sizes = subprocess.run([need("arm-none-eabi-size"), made], capture_output=True, text=True, check=True)
    text, data, bss = (int(word) for word in sizes.stdout.splitlines()[1].split()[:3])
    assert (text <= 6800, data + bss <= 900) == (True, True), (text, data, bss)
