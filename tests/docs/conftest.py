"""The built site, for all tests of it."""

import os
from pathlib import Path

import pytest
from site_build import built


@pytest.fixture(scope="session")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    base = tmp_path_factory.getbasetemp()
    shared = (base.parent if os.environ.get("PYTEST_XDIST_WORKER") else base) / "docs"
    shared.mkdir(exist_ok=True)
    folder, complaints = built(shared)
    assert complaints == ""
    return folder
