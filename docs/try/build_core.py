"""The core in WebAssembly with all that its page needs: `python docs/try/build_core.py build/try`.

clang 14 or newer with wasm-ld, and the C and C++ libraries of WASI; on Debian: apt install clang lld wasi-libc
libc++-14-dev-wasm32 libclang-rt-14-dev-wasm32. The same sources give the same bytes.
"""

import shutil
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
FORMATTING = ROOT / "python" / "palpate" / "live" / "page" / "formatting.js"
PACKAGES = "clang lld wasi-libc libc++-14-dev-wasm32 libclang-rt-14-dev-wasm32"
FLAGS = ["--target=wasm32-wasi", "-std=c++17", "-fno-exceptions", "-fno-rtti", "-ffp-contract=off"]
"""With which any program of the headers has the bits of every other target."""


def build(folder: Path) -> None:
    """Write palpate.wasm, its modules of JavaScript, and what is computed for them, into a folder.

    Parameters
    ----------
    folder : pathlib.Path
        It is made if it is missing.

    Raises
    ------
    RuntimeError
        A program is missing, or failed.
    """
    folder.mkdir(parents=True, exist_ok=True)
    module(folder / "palpate.wasm")
    scripts(folder)


def module(to: Path) -> None:
    """Write the core, palpate.wasm."""
    compiled([ROOT / "cpp" / "wasm" / "palpate.cpp"], to, "-Oz", "-mexec-model=reactor")


def scripts(folder: Path) -> None:
    """Write its JavaScript, and what is computed for it."""
    from core_sample import sample
    from core_tables import tables

    (folder / "page").mkdir(exist_ok=True)
    for path in sorted((HERE / "core").glob("*.js")):
        shutil.copyfile(path, folder / path.name)
    shutil.copyfile(FORMATTING, folder / "page" / "formatting.js")
    (folder / "tables.js").write_text(tables(), encoding="utf-8")
    (folder / "sample.js").write_text(sample(), encoding="utf-8")


def compiled(sources: list[Path], to: Path, *flags: str) -> None:
    """Compile a program, or a library with `-mexec-model=reactor`, for WebAssembly.

    Raises
    ------
    RuntimeError
        A program is missing, or failed.
    """
    for tool in ("clang++", "wasm-ld"):
        if shutil.which(tool) is None:
            raise RuntimeError(f"{tool}: not found; install it, on Debian: apt install {PACKAGES}")
    includes = [f"-I{ROOT / 'cpp' / 'include'}"]
    command = ["clang++", *FLAGS, *flags, "-DPALPATE_CONTRACTION_OFF", *includes, *map(str, sources)]
    done = subprocess.run([*command, "-Wl,--strip-all", "-o", str(to)], check=False, capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(f"clang++: {done.stderr.strip()}\nOn Debian: apt install {PACKAGES}")


if __name__ == "__main__":
    try:
        build(Path(sys.argv[1]))
    except (IndexError, RuntimeError) as error:
        sys.exit(f"Usage: python docs/try/build_core.py FOLDER\n{error}")
