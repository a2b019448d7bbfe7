"""Fixtures of several tests of the live page."""

from collections.abc import Callable, Iterator
from contextlib import ExitStack

import pytest
from live_server import Live


@pytest.fixture
def serve() -> Iterator[Callable[..., Live]]:
    with ExitStack() as running:
        yield lambda *options, **more: running.enter_context(Live(*options, **more))
