"""Programs run, and projects built, by tests."""

import subprocess
from pathlib import Path


def run(*command: str | Path) -> str:
    """Run a program, which must succeed, and return what it printed."""
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{command}\n{done.stdout}\n{done.stderr}"
    return done.stdout


def configure(cmake: str, source: Path, build: Path, *options: str) -> None:
    """Configure and build a CMake project."""
    run(cmake, "-S", source, "-B", build, "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release", *options)
    run(cmake, "--build", build)
