"""Folder of the project, and the programs that its tests need."""

import os
import shutil
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


def need(tool: str) -> str:
    """Return the path of a program. If it is missing, the test is skipped, or fails if no test may be skipped."""
    path = shutil.which(tool)
    if path is None:
        message = f"{tool} is not installed"
        if os.environ.get("PALPATE_NO_SKIP"):
            pytest.fail(message)
        pytest.skip(message)
    return path
