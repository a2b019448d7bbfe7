"""A simulated measurement and its live page, without a browser."""

from pathlib import Path
from typing import Any
from weakref import WeakKeyDictionary

import palpate
from palpate.live.protocol import Command
from palpate.live.recordings import Recordings
from palpate.live.server import Server
from palpate.live.session import Session
from palpate.live.workbench import Workbench
from starlette.testclient import TestClient

HOST, PORT = "127.0.0.1", 8746
OWN = f"{HOST}:{PORT}"
ORIGIN = f"http://{OWN}"
SOURCE = "sim:four-specimens"


_BENCHES: WeakKeyDictionary[Session, Workbench] = WeakKeyDictionary()


def begun(folder: Path, *, speed: float | None = 1, record: bool = True, source: str = SOURCE) -> Session:
    recordings = Recordings(folder / "run.csv" if record else None, folder)
    pace = {"speed": speed} if speed else {}
    session = Session(lambda: palpate.open(f"{source}?seed=1", **pace), recordings, {"scene": "handheld"})
    session.start()
    return session


def bench_of(session: Session) -> Workbench:
    """Return the workbench of a session, always the same one."""
    if session not in _BENCHES:
        _BENCHES[session] = Workbench(session, SOURCE)
    return _BENCHES[session]


def client(session: Session, host: str = HOST, token: str | None = None) -> TestClient:
    return TestClient(Server(bench_of(session)).app(host, PORT, token), base_url=ORIGIN, follow_redirects=False)


def answer(session: Session, do: str, **given: object) -> dict[str, Any]:
    """Let a page order this; return the answer."""
    return bench_of(session).do(Command(do, given))


def obey(session: Session, do: str, **given: object) -> str:
    """Let a page order this; return the message."""
    return str(answer(session, do, **given)["message"])
