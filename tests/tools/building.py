"""Programs run, and projects built, by tests."""

import subprocess
import sys
from pathlib import Path

from project import need

STRICT = ("-std=c++17", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Werror")


def run(*command: str | Path) -> str:
    """Run a program, which must succeed, and return what it printed."""
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{command}\n{done.stdout}\n{done.stderr}"
    return done.stdout


def configure(cmake: str, source: Path, build: Path, *options: str) -> None:
    """Configure and build a CMake project."""
    run(cmake, "-S", source, "-B", build, "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release", *options)
    run(cmake, "--build", build)


def asked(option: str) -> str:
    """Ask the installed package, from elsewhere than the sources."""
    return run(sys.executable, "-m", "palpate", option).strip()


def compiles(compiler: str, text: str, folder: Path) -> None:
    """Have a compiler read a program of so many lines."""
    source = folder / "block.cpp"
    source.write_text(text)
    run(need(compiler), *STRICT, asked("--includes"), "-fsyntax-only", source)
