"""Builds the subjects of bench/embedded for microcontrollers and for this machine, and runs them."""

import os
import re
import shutil
import subprocess
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

HERE = Path(__file__).parent
INCLUDE = HERE.parents[1] / "cpp" / "include"
# The options of the CMake target palpate::palpate, and the usual ones for a microcontroller.
FLAGS: tuple[str, ...] = (
    "-std=c++17",
    "-ffp-contract=off",
    "-DPALPATE_CONTRACTION_OFF",
    "-fno-exceptions",
    "-fno-rtti",
)
FLAGS += ("-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Werror", "-Wno-psabi")
FREESTANDING = (
    "-ffreestanding",
    "-ffunction-sections",
    "-fdata-sections",
    "-fno-asynchronous-unwind-tables",
)

# A header of the C++ library, and the number of folders from it up to the include folder.
HEADER_FOLDERS = (("/atomic", 0), ("/bits/c++config.h", 1))


@dataclass(frozen=True)
class Target:
    """A processor, with its compiler and the machine for QEMU."""

    name: str
    compiler: tuple[str, ...]
    machine: str = ""  # for QEMU; empty: compiled only
    tick: float = 0.0  # instructions for each tick of SysTick, with -icount shift=0
    repeats: int = 0  # of each reading: the resolution is tick / repeats

    @property
    def tools(self) -> str:
        """Prefix of the binutils."""
        return self.compiler[0].removesuffix("g++")


# Program -> packages of Debian that have it.
PACKAGES = {
    "arm-none-eabi-g++": "gcc-arm-none-eabi libstdc++-arm-none-eabi-newlib",
    "qemu-system-arm": "qemu-system-arm",
    "riscv64-unknown-elf-g++": "gcc-riscv64-unknown-elf",
}
ARM = ("arm-none-eabi-g++", "-mthumb")
HARD = "-mfloat-abi=hard"
TARGETS = {
    t.name: t
    for t in (
        Target("m0", (*ARM, "-mcpu=cortex-m0"), "microbit", 62.5, 25),
        Target("m3", (*ARM, "-mcpu=cortex-m3"), "mps2-an385", 40, 100),
        Target("m4f", (*ARM, "-mcpu=cortex-m4", "-mfpu=fpv4-sp-d16", HARD), "mps2-an386", 40, 100),
        Target("m7", (*ARM, "-mcpu=cortex-m7", "-mfpu=fpv5-d16", HARD), "mps2-an500", 40, 100),
        Target("rv32imafc", ("riscv64-unknown-elf-g++", "-march=rv32imafc", "-mabi=ilp32f")),
    )
}


@dataclass(frozen=True)
class Cost:
    """Costs of a subject on a target; instructions for each reading, including the return."""

    mean: float
    worst: float  # of a touch
    dearest: int  # index of this reading, from 0
    idle: float  # the largest of the other readings: the last one of the baseline
    stack: int
    state: int


def subjects() -> list[str]:
    """Return the names of the subjects, from subjects.hpp."""
    return re.findall(r'visit\("(\w+)"', (HERE / "subjects.hpp").read_text())


def missing(targets: Iterable[Target], compiler: str) -> list[str]:
    """Return the programs that are not installed, each with what installs it; all targets need the ARM compiler or its headers."""
    needed = dict.fromkeys([compiler, ARM[0], *(target.compiler[0] for target in targets)])
    needed |= dict.fromkeys("qemu-system-arm" for target in targets if target.machine)
    return [
        f"{name}: apt install {PACKAGES.get(name, 'g++')}"
        for name in needed
        if not shutil.which(name)
    ]


def run(*command: str | Path) -> str:
    """Run a program and return its output; RuntimeError with its messages if it fails."""
    words = [str(c) for c in command]
    done = subprocess.run(
        words, capture_output=True, text=True, check=False, stdin=subprocess.DEVNULL
    )
    if done.returncode:
        raise RuntimeError(f"{' '.join(words)}\n{done.stdout}{done.stderr}")
    return done.stdout or done.stderr  # semihosting of QEMU writes to stderr


def library_headers(target: Target) -> list[str]:
    """Return flags for freestanding C++ headers if a compiler has none: those of the ARM compiler can be used."""
    if target.machine or not target.tools:
        return []
    used = run("arm-none-eabi-g++", "-M", "-x", "c++", "-include", "atomic", "/dev/null").split()
    folders = {
        Path(path).parents[depth]
        for path in used
        for end, depth in HEADER_FOLDERS
        if path.endswith(end)
    }
    return ["-nostdinc++", *(f"-isystem{f}" for f in sorted(folders))]


def compile_subject(target: Target, subject: str, optimise: str, folder: Path) -> Path:
    """Compile one subject separately."""
    made = folder / f"{subject}{optimise}.o"
    flags = (
        *FLAGS,
        *FREESTANDING,
        *library_headers(target),
        optimise,
        f"-I{INCLUDE}",
        f"-DSUBJECT={subject}",
    )
    run(*target.compiler, *flags, "-c", HERE / "subject.cpp", "-o", made)
    return made


def compile_subjects(target: Target, optimise: str, folder: Path) -> dict[str, Path]:
    """Compile all subjects."""
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        made = pool.map(lambda s: compile_subject(target, s, optimise, folder), subjects())
        return dict(zip(subjects(), made, strict=True))


def text_bytes(target: Target, compiled: Path) -> int:
    """Bytes of code and constants, without the library of the compiler."""
    return int(run(f"{target.tools}size", compiled).splitlines()[1].split()[0])


def undefined(target: Target, compiled: Path) -> list[str]:
    """Undefined symbols."""
    return run(f"{target.tools}nm", "-u", compiled).replace(" U ", " ").split()


def link_firmware(target: Target, optimise: str, compiled: Sequence[Path], folder: Path) -> Path:
    """Link the image that prints results and costs of all subjects."""
    made = folder / "firmware.elf"
    sources = [HERE / f"{name}.cpp" for name in ("startup", "results", "firmware")]
    flags = (*FLAGS, *FREESTANDING, optimise, f"-I{INCLUDE}", f"-DREPEATS={target.repeats}")
    link = (
        "-nostartfiles",
        "-Wl,--gc-sections",
        "-Wl,--fatal-warnings",
        "-T",
        HERE / "firmware.ld",
    )
    run(*target.compiler, *flags, *sources, *compiled, *link, "-o", made)
    return made


def run_firmware(target: Target, image: Path) -> list[str]:
    """Run an image in QEMU and return its lines."""
    quiet = (
        "-nographic",
        "-monitor",
        "none",
        "-serial",
        "none",
        "-semihosting-config",
        "enable=on,target=native",
    )
    return run(
        "qemu-system-arm", "-M", target.machine, *quiet, "-icount", "shift=0", "-kernel", image
    ).splitlines()


def results(lines: Sequence[str]) -> list[str]:
    """Return the lines that are the same on every machine."""
    return [line for line in lines if not line.startswith("cost ")]


def costs(target: Target, lines: Sequence[str]) -> dict[str, Cost]:
    """Return the costs of each subject."""
    found = {}
    scale = target.tick / target.repeats
    for line in lines:
        if line.startswith("cost "):
            name, *numbers = line.split()[1:]
            count, total, worst, dearest, idle, stack, state = map(int, numbers)
            # The empty function, which is subtracted, is one instruction.
            found[name] = Cost(
                total * scale / count + 1,
                worst * scale + 1,
                dearest,
                idle * scale + 1,
                stack,
                state,
            )
    return found


def host_results(compiler: str, folder: Path, *flags: str) -> list[str]:
    """Build and run the same program on this machine, and return its lines."""
    target = Target("host", (compiler, *flags))
    compiled = compile_subjects(target, "-O2", folder)
    program = folder / "host"
    run(
        compiler,
        *flags,
        *FLAGS,
        "-O2",
        f"-I{INCLUDE}",
        HERE / "results.cpp",
        *compiled.values(),
        "-o",
        program,
    )
    return run(program).splitlines()
