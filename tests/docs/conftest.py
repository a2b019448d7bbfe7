"""The built site, for all tests of it."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from made_once import made_once
from project import need
from site_browser import Site, site_browser
from site_build import build_site


@pytest.fixture(scope="session")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return made_once(tmp_path_factory, "site", build_site)


@pytest.fixture(scope="module")
def opened(site: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    need("chromium")
    need("chromedriver")
    with site_browser(site, tmp_path_factory.mktemp("downloads")) as opened:
        yield opened
