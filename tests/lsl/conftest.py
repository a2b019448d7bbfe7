"""Streams of Lab Streaming Layer between the processes of this machine, without a network."""

from collections.abc import Iterator
from uuid import uuid4

import pytest
from project import need_package

_CONFIGURATION = """[ports]
IPv6 = disable
[multicast]
ResolveScope = machine
MachineAddresses = {127.0.0.1}
[lab]
KnownPeers = {127.0.0.1}
[log]
level = -3
"""


@pytest.fixture(scope="session", autouse=True)
def configuration(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Let liblsl, here and in child processes, look at this machine only; it reads this once in a process.

    In one that used liblsl before it has its own configuration, with which it finds the streams of this machine, too.
    """
    need_package("pylsl")
    path = tmp_path_factory.mktemp("lsl") / "lsl_api.cfg"
    path.write_text(_CONFIGURATION)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("LSLAPICFG", str(path))
        yield


@pytest.fixture
def name() -> str:
    """Return a name that no other stream has."""
    return f"palpate-test-{uuid4().hex[:12]}"
