"""The C++ programs of tests/cpp on other processors and systems: compiled by the include path alone, run, and hashed.

    python tests/tools/targets.py [NAME...]

Products may be fused everywhere (-ffp-contract=fast, without PALPATE_CONTRACTION_OFF): the headers see to the same bits.
Prints a line for each target: a hash of all that each program says, and the CPU time. QEMU runs the Linux programs, Wine those of Windows,
Node.js WebAssembly, and QEMU's boards the firmware of bench/embedded.
"""

import hashlib
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from wine import wine_home

ROOT = Path(__file__).parents[2]
CPP = ROOT / "tests" / "cpp"
FLAGS = ("-std=c++17", "-ffp-contract=fast", f"-I{ROOT / 'cpp' / 'include'}")
# Programs whose output is the same everywhere, and those that check by themselves.
PRINTING = ("bits", "hostile", "scenes")
QUICK = PRINTING[:2]
CHECKING = ("bank", "touch", "stages", "handover", "elasticity", "square_root", "ring", "one_definition")
MORE_SOURCES = {"one_definition": ("one_definition_again",)}
WASI = """import {readFileSync} from 'node:fs'; import {WASI} from 'node:wasi';
const wasi = new WASI({version: 'preview1', returnOnExit: true});
const {instance} = await WebAssembly.instantiate(readFileSync(process.argv[1]), wasi.getImportObject());
process.exitCode = wasi.start(instance);"""
NODE = ("node", "--no-warnings", "--input-type=module", "-e", WASI)


@dataclass(frozen=True)
class Target:
    """A processor with its compiler, and what runs its programs here."""

    name: str
    compiler: tuple[str, ...]
    runner: tuple[str, ...] = ()
    checking: tuple[str, ...] = ()  # beside the programs that print
    printing: tuple[str, ...] = PRINTING
    libraries: tuple[str, ...] = ("-static",)

    @property
    def tools(self) -> tuple[str, ...]:
        """Programs that must be installed."""
        return (self.compiler[0], *self.runner[:1], *self._cross())

    def _cross(self) -> tuple[str, ...]:
        """Name the cross compiler of g++ whose libraries clang++ uses."""
        triples = [word.removeprefix("--target=") for word in self.compiler if word.startswith("--target=")]
        return tuple(f"{triple}-g++" for triple in triples if triple.endswith("linux-gnu"))


def _of_clang(triple: str, *flags: str) -> tuple[str, ...]:
    return ("clang++", f"--target={triple}", *flags)


# What clang does not find by itself.
_RISCV = Path("/usr/riscv64-linux-gnu/include")
_RISCV_FLAGS: tuple[str, ...] = (
    f"-isystem{_RISCV}/c++/12",
    f"-isystem{_RISCV}/c++/12/riscv64-linux-gnu",
    f"-isystem{_RISCV}",
)
_RISCV_FLAGS += ("-B/usr/lib/gcc-cross/riscv64-linux-gnu/12", "-L/usr/lib/gcc-cross/riscv64-linux-gnu/12")
_RISCV_FLAGS += (
    "-B/usr/riscv64-linux-gnu/lib",
    "-L/usr/riscv64-linux-gnu/lib",
    "-fuse-ld=/usr/bin/riscv64-linux-gnu-ld",
)

TARGETS = (
    Target("x86-64", ("g++", "-O2", "-march=x86-64-v3")),
    Target("x86-64", ("clang++", "-O2", "-march=x86-64-v3")),
    Target("i386", ("i686-linux-gnu-g++", "-O2", "-msse2", "-mfpmath=sse"), ("qemu-i386",)),
    Target("aarch64", ("aarch64-linux-gnu-g++", "-O2"), ("qemu-aarch64",), ("bank", "ring")),
    Target("aarch64", _of_clang("aarch64-linux-gnu", "-O2"), ("qemu-aarch64",), printing=QUICK),
    Target("armhf", ("arm-linux-gnueabihf-g++", "-O2", "-mfpu=neon-vfpv4"), ("qemu-arm",)),
    Target("riscv64", ("riscv64-linux-gnu-g++", "-O2"), ("qemu-riscv64",)),
    Target("riscv64", _of_clang("riscv64-linux-gnu", "-O2", *_RISCV_FLAGS), ("qemu-riscv64",), printing=QUICK),
    Target("ppc64le", ("powerpc64le-linux-gnu-g++", "-O2", "-mcpu=power9"), ("qemu-ppc64le",)),
    Target("ppc64le", _of_clang("powerpc64le-linux-gnu", "-O2"), ("qemu-ppc64le",), printing=QUICK),
    Target("s390x", ("s390x-linux-gnu-g++", "-O2", "-march=z14"), ("qemu-s390x",)),
    Target("windows", ("x86_64-w64-mingw32-g++-posix", "-O2", "-mfma"), ("wine",), CHECKING),
    Target("wasm32", _of_clang("wasm32-wasi", "-O2"), NODE, libraries=()),
)
BOARDS = ("m0", "m3", "m4f", "m7")


def flags_of(target: Target) -> str:
    """Return the flags that say what is compiled, without paths."""
    return " ".join(word for word in target.compiler[1:] if "/" not in word)


def _run(words: list[str | Path]) -> str:
    """Run a program and return its output; RuntimeError with its messages if it fails, TimeoutExpired after ten minutes."""
    command = [str(word) for word in words]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=600)
    if done.returncode:
        raise RuntimeError(f"{' '.join(command)}: exit {done.returncode}\n{done.stdout[-2000:]}{done.stderr[-4000:]}")
    return done.stdout


def compile_program(target: Target, program: str, folder: Path) -> Path:
    """Compile one program of tests/cpp for a target."""
    made = folder / f"{program}.exe"  # the name that Wine runs, and the others, too
    sources = [CPP / f"{name}.cpp" for name in (program, *MORE_SOURCES.get(program, ()))]
    flags = (*FLAGS, "-Os") if program == "scenes" else FLAGS  # as on a microcontroller, and faster to compile
    _run([*target.compiler, *flags, *sources, *target.libraries, "-o", made])
    return made


def outputs(target: Target) -> dict[str, list[str]]:
    """Compile the programs of a target and return the lines of each."""
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as name:
        folder = Path(name)
        made = {p: compile_program(target, p, folder) for p in (*target.printing, *target.checking)}
        if target.runner == ("wine",):
            with wine_home() as wine:
                return {p: wine.run(program).splitlines() for p, program in made.items()}
        return {p: _run([*target.runner, program]).splitlines() for p, program in made.items()}


def reference(compiler: str) -> dict[str, list[str]]:
    """Return what the programs print on this machine, compiled without optimisation and without fused products."""
    return outputs(Target("here", (compiler, "-O0", "-ffp-contract=off"), libraries=()))


def board_lines(name: str) -> list[str]:
    """Return what the scenes print on a microcontroller."""
    from bench.embedded import firmware

    with tempfile.TemporaryDirectory() as folder:
        target = firmware.TARGETS[name]
        compiled = list(firmware.compile_subjects(target, "-Os", Path(folder)).values())
        image = firmware.link_firmware(target, "-Os", compiled, Path(folder))
        return firmware.results(firmware.run_firmware(target, image))


def digest(lines: list[str]) -> str:
    """Hash lines of text."""
    return hashlib.sha256("\n".join(lines).encode()).hexdigest()[:12]


def row(name: str, compiler: str, flags: str, made: Mapping[str, list[str]], seconds: float) -> str:
    """Print a target."""
    hashes = " ".join(f"{digest(made[p]) if p in made else '-':12}" for p in PRINTING)
    return f"{name:8} {compiler:29} {flags:36} {hashes} {seconds:4.0f}"


def _cpu_s() -> float:
    """Return the CPU time of all children so far."""
    times = os.times()
    return times.children_user + times.children_system


def main(names: list[str]) -> int:
    """Print the table, and return 1 if a hash differs."""
    expected = reference("g++")
    print(f"{'target':8} {'compiler':29} {'flags':36} {'estimators':12} {'hostile':12} {'scenes':12}    s")
    print(row("here", "g++", "-O0 -ffp-contract=off", expected, 0), flush=True)
    same = True
    for target in TARGETS:
        if names and target.name not in names:
            continue
        if missing := [tool for tool in target.tools if shutil.which(tool) is None]:
            print(f"{target.name:8} not run: {', '.join(missing)} missing")
            continue
        begun = _cpu_s()
        made = outputs(target)
        same = same and all(made[p] == expected[p] for p in target.printing)
        print(row(target.name, target.compiler[0], flags_of(target), made, _cpu_s() - begun), flush=True)
    for name in BOARDS:
        if names and name not in names:
            continue
        begun = _cpu_s()
        lines = board_lines(name)
        same = same and lines == expected["scenes"]
        print(row(name, "arm-none-eabi-g++", "-Os", {"scenes": lines}, _cpu_s() - begun), flush=True)
    print("the same bits everywhere" if same else "DIFFERENT BITS")
    return 0 if same else 1


if __name__ == "__main__":
    sys.path.insert(0, str(ROOT))
    raise SystemExit(main(sys.argv[1:]))
