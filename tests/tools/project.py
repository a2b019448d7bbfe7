"""Where the project lies, and the programs that its tests need."""

import os
import shutil
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


def need(tool: str) -> str:
    """Path of a program that a test cannot do without: missing, it is a skip, or a failure where all must run."""
    path = shutil.which(tool)
    if path is None:
        message = f"{tool} is not installed"
        if os.environ.get("PALPATE_NO_SKIP"):
            pytest.fail(message)
        pytest.skip(message)
    return path
