"""Folder of the project, and the programs and packages that its tests need."""

import os
import shutil
from importlib.util import find_spec
from pathlib import Path
from typing import NoReturn

import pytest

ROOT = Path(__file__).parents[2]


def need(tool: str) -> str:
    """Return the path of a program. If it is missing, the test is skipped, or fails if no test may be skipped."""
    path = shutil.which(tool)
    if path is None:
        _without(tool)
    return path


def need_file(path: Path) -> None:
    """As `need`, for a file or a folder."""
    if not path.exists():
        _without(str(path))


def need_package(name: str) -> None:
    """As `need`, for a package that is imported."""
    if find_spec(name) is None:
        _without(name)


def _without(name: str) -> NoReturn:
    message = f"{name} is not installed"
    if os.environ.get("PALPATE_NO_SKIP"):
        pytest.fail(message)
    pytest.skip(message)
