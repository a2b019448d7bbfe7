"""Functions for tests that run programs and build projects."""

import subprocess
import sys
from pathlib import Path

from project import need

STRICT = ("-std=c++17", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Werror")


def run(*command: str | Path) -> str:
    """Run a program, which must succeed, and return its output."""
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{command}\n{done.stdout}\n{done.stderr}"
    return done.stdout


def configure(cmake: str, source: Path, build: Path, *options: str) -> None:
    """Configure and build a CMake project."""
    run(cmake, "-S", source, "-B", build, "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release", *options)
    run(cmake, "--build", build)


def asked(option: str) -> str:
    """Return the output of the installed command `palpate` with this option."""
    return run(sys.executable, "-m", "palpate", option).strip()


def compiles(compiler: str, text: str, folder: Path) -> None:
    """Check that a compiler accepts a program, with all warnings as errors."""
    source = folder / "block.cpp"
    source.write_text(text)
    run(need(compiler), *STRICT, asked("--includes"), "-fsyntax-only", source)
