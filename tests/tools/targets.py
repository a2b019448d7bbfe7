"""The C++ programs of tests/cpp on other processors and systems: compiled by the include path alone, run, and hashed.

Products may be fused everywhere (-ffp-contract=fast, without PALPATE_CONTRACTION_OFF): the headers see to the same bits.
QEMU runs the Linux programs, Wine those of Windows, Node.js WebAssembly. The firmware of bench/embedded on QEMU's boards: test_embedded.py.
"""

import os
import shutil
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

from project import ROOT, run

CPP = ROOT / "tests" / "cpp"
FLAGS = ("-std=c++17", "-ffp-contract=fast", f"-I{ROOT / 'cpp' / 'include'}")
# Programs whose output is the same everywhere, and those that check by themselves.
PRINTING = ("bits", "hostile", "vectors", "scenes")
QUICK = PRINTING[:3]
CHECKING = ("stages", "square_root", "ring")
WASI = """import {readFileSync} from 'node:fs'; import {WASI} from 'node:wasi';
const wasi = new WASI({version: 'preview1', returnOnExit: true});
const {instance} = await WebAssembly.instantiate(readFileSync(process.argv[1]), wasi.getImportObject());
process.exitCode = wasi.start(instance);"""
# where distributions have its libraries
WINE = ("usr/lib/*/wine", "usr/lib*/wine", "opt/wine*/lib*/wine")
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
        triples = [
            word.removeprefix("--target=") for word in self.compiler if word.startswith("--target=")
        ]
        # whose libraries clang++ uses
        crosses = (f"{triple}-g++" for triple in triples if triple.endswith("linux-gnu"))
        return (self.compiler[0], *self.runner[:1], *crosses)


def _of_clang(triple: str, *flags: str) -> tuple[str, ...]:
    return ("clang++", f"--target={triple}", *flags)


# What clang does not find by itself.
_RISCV = "/usr/riscv64-linux-gnu"
_RISCV_FLAGS = [
    f"-isystem{_RISCV}/include{more}" for more in ("/c++/12", "/c++/12/riscv64-linux-gnu", "")
]
_RISCV_FLAGS += [f"-B{_RISCV}/lib", "-fuse-ld=/usr/bin/riscv64-linux-gnu-ld"]
_RISCV_FLAGS += [f"{option}/usr/lib/gcc-cross/riscv64-linux-gnu/12" for option in ("-B", "-L")]

TARGETS = (
    Target("x86-64", ("g++", "-O2", "-march=x86-64-v3")),
    Target("x86-64", ("clang++", "-O2", "-march=x86-64-v3")),
    Target("i386", ("i686-linux-gnu-g++", "-O2", "-msse2", "-mfpmath=sse"), ("qemu-i386",)),
    Target("aarch64", ("aarch64-linux-gnu-g++", "-O2"), ("qemu-aarch64",), ("ring",)),
    Target("aarch64", _of_clang("aarch64-linux-gnu", "-O2"), ("qemu-aarch64",), printing=QUICK),
    Target("armhf", ("arm-linux-gnueabihf-g++", "-O2", "-mfpu=neon-vfpv4"), ("qemu-arm",)),
    Target("riscv64", ("riscv64-linux-gnu-g++", "-O2"), ("qemu-riscv64",)),
    Target(
        "riscv64",
        _of_clang("riscv64-linux-gnu", "-O2", *_RISCV_FLAGS),
        ("qemu-riscv64",),
        printing=QUICK,
    ),
    Target("ppc64le", ("powerpc64le-linux-gnu-g++", "-O2", "-mcpu=power9"), ("qemu-ppc64le",)),
    Target("ppc64le", _of_clang("powerpc64le-linux-gnu", "-O2"), ("qemu-ppc64le",), printing=QUICK),
    Target("s390x", ("s390x-linux-gnu-g++", "-O2", "-march=z14"), ("qemu-s390x",)),
    Target("windows", ("x86_64-w64-mingw32-g++-posix", "-O2", "-mfma"), ("wine",), CHECKING),
    Target("wasm32", _of_clang("wasm32-wasi", "-O2"), NODE, libraries=()),
)


def outputs(target: Target) -> dict[str, list[str]]:
    """Compile the programs of a target and return the lines of each."""
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as name:
        folder = Path(name)
        # Wine runs this name; the other systems, too.
        made = {
            program: folder / f"{program}.exe" for program in (*target.printing, *target.checking)
        }
        for program, path in made.items():
            # as on a microcontroller, and faster to compile
            size = ("-Os",) if program == "scenes" else ()
            run(
                *target.compiler,
                *FLAGS,
                *size,
                CPP / f"{program}.cpp",
                *target.libraries,
                "-o",
                path,
            )
        if target.runner == ("wine",):
            return {program: said.splitlines() for program, said in _in_wine(made, folder).items()}
        return {program: run(*target.runner, path).splitlines() for program, path in made.items()}


def _in_wine(programs: dict[str, Path], home: Path) -> dict[str, str]:
    """Run programs for Windows in a home of their own, without a display: no window can wait for an answer.

    The home has links to Wine's libraries, where they are found: Wine would take 10 s and copy 700 MB.
    """
    libraries = [path for place in WINE for path in Path("/").glob(f"{place}/x86_64-windows")]
    if libraries:
        system = home / "wine/drive_c/windows/system32"
        drives = home / "wine/dosdevices"
        system.mkdir(parents=True)
        drives.mkdir()
        (drives / "c:").symlink_to("../drive_c")
        (drives / "z:").symlink_to("/")
        for library in libraries[0].iterdir():
            (system / library.name).symlink_to(library)
        (home / "wine/.update-timestamp").write_text("disable\n")
    # mscoree, mshtml: the parts for .NET and HTML, which Wine would ask to download.
    environment = {
        "PATH": os.environ["PATH"],
        "HOME": str(home),
        "WINEPREFIX": str(home / "wine"),
        "WINEDEBUG": "-all",
    }
    environment |= {"WINEDLLOVERRIDES": "mscoree=;mshtml="}
    # a file: Wine's own processes inherit a pipe, and its reader would wait for them, too
    said = home / "said.txt"
    found = {}
    try:
        for name, program in programs.items():
            with said.open("w") as file:
                code = subprocess.run(
                    ["wine", program], stdin=subprocess.DEVNULL, stdout=file, stderr=subprocess.STDOUT, check=False,
                    env=environment, cwd=home, timeout=600,
                ).returncode  # fmt: skip
            found[name] = said.read_text(errors="replace")
            if code:
                raise RuntimeError(f"wine {program}: exit {code}\n{found[name][-4000:]}")
    finally:
        if server := shutil.which("wineserver"):
            subprocess.run(
                [server, "-k"], check=False, env=environment, capture_output=True, timeout=60
            )
    return found


def reference(compiler: str) -> dict[str, list[str]]:
    """Return what the programs print on this machine, compiled without optimisation and without fused products."""
    return outputs(Target("here", (compiler, "-O0", "-ffp-contract=off"), libraries=()))
