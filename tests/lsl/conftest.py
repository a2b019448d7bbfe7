"""Streams of Lab Streaming Layer between the processes of these tests only, without a network."""

import os
from collections.abc import Iterator
from pathlib import Path
from uuid import uuid4

import pytest
from project import need_package

_CONFIGURATION = """[ports]
IPv6 = disable
[multicast]
ResolveScope = machine
MachineAddresses = {{127.0.0.1}}
[lab]
KnownPeers = {{127.0.0.1}}
SessionID = {session}
[log]
level = -3
"""


@pytest.fixture(scope="session", autouse=True)
def configuration(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Let liblsl, here and in child processes, look at this machine only; it reads this once in a process."""
    need_package("pylsl")
    path = tmp_path_factory.mktemp("lsl") / "lsl_api.cfg"
    path.write_text(_CONFIGURATION.format(session=uuid4().hex))
    before = os.environ.get("LSLAPICFG")
    os.environ["LSLAPICFG"] = str(path)
    yield
    if before is None:
        del os.environ["LSLAPICFG"]
    else:
        os.environ["LSLAPICFG"] = before


@pytest.fixture
def name(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    """Return a name that no other stream has."""
    return f"palpate-test-{uuid4().hex[:12]}"
