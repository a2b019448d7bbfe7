"""A simulated measurement and its live page, without a browser."""

from pathlib import Path

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


def begun(folder: Path, *, speed: float | None = 1, record: bool = True) -> Session:
    recordings = Recordings(folder / "run.csv" if record else None)
    pace = {"speed": speed} if speed else {}
    session = Session(lambda: palpate.open("sim:four-specimens?seed=1", **pace), recordings, {"scene": "handheld"})
    session.start()
    return session


def client(session: Session, host: str = HOST, token: str | None = None) -> TestClient:
    app = Server(Workbench(session, "sim:four-specimens")).app(host, PORT, token)
    return TestClient(app, base_url=ORIGIN, follow_redirects=False)


def obey(session: Session, do: str, **given: object) -> str:
    """Let a page order this; return the message."""
    return str(Workbench(session, "").do(Command(do, given))["message"])
