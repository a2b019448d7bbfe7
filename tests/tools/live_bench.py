"""A simulated measurement and its live page, without a browser."""

from pathlib import Path

import palpate
from palpate.live.recordings import Recordings
from palpate.live.server import Server
from palpate.live.session import Session
from palpate.live.summary import Summary
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
    app = Server(session, Summary(session), "sim:four-specimens").app(host, PORT, token)
    return TestClient(app, base_url=ORIGIN, follow_redirects=False)
