"""Single stages of the core, through tests/cpp/drive.cpp."""

import subprocess
import tempfile
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from building import run
from numpy.typing import ArrayLike, NDArray
from project import ROOT, need


@cache
def _program() -> tuple[Path, tempfile.TemporaryDirectory[str]]:
    folder = tempfile.TemporaryDirectory()
    made = Path(folder.name) / "drive"
    flags = ("-std=c++17", "-O1", "-ffp-contract=off", "-DPALPATE_CONTRACTION_OFF")
    run(need("c++"), *flags, f"-I{ROOT / 'cpp' / 'include'}", ROOT / "tests" / "cpp" / "drive.cpp", "-o", made)
    return made, folder


def drive(stage: str, values: ArrayLike, columns: int, real: str = "double") -> NDArray[Any]:
    """Return the rows that a stage makes of these numbers."""
    data = np.ascontiguousarray(values, float).tobytes()
    done = subprocess.run([_program()[0], stage, real], input=data, capture_output=True, check=True)
    return np.frombuffer(done.stdout).reshape(-1, columns)
