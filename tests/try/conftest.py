"""The core of docs/try, for all tests of it in a process."""

from collections.abc import Iterator

import pytest
from try_core import Node, built


@pytest.fixture(scope="session")
def node(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Node]:
    """Run the core in node."""
    node = Node(built(tmp_path_factory.mktemp("core")))
    yield node
    node.close()
