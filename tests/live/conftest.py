"""Fixtures of several tests of the live page."""

from collections.abc import Callable, Iterator
from contextlib import ExitStack

import pytest
from live_browser import Browser
from live_server import Live
from page_data import state
from page_states import Canned, opened


@pytest.fixture
def serve() -> Iterator[Callable[..., Live]]:
    with ExitStack() as running:
        yield lambda *options, **more: running.enter_context(Live(*options, **more))


@pytest.fixture
def page(chromium: Browser) -> Browser:
    chromium.reset()
    return chromium


@pytest.fixture
def shown(page: Browser) -> Iterator[Callable[..., Canned]]:
    """Return a function that shows a canned state in the page, at a size."""
    with ExitStack() as running:

        def show(name: str, size: str = "desk", theme: str = "light", depth: str = "lab") -> Canned:
            server = running.enter_context(Canned(state(name)))
            page.size(size)
            opened(page, server, name, theme, depth)
            return server

        yield show
        page.driver.get("about:blank")


@pytest.fixture
def idle(shown: Callable[..., Canned]) -> Canned:
    return shown("idle")
