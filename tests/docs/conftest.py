"""The built site, for all tests of it."""

from pathlib import Path

import pytest
from made_once import made_once
from site_build import build_site


@pytest.fixture(scope="session")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return made_once(tmp_path_factory, "site", build_site)
