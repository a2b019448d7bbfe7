"""A whole session over the web socket: ten specimens by four touches, with its recording and its calibration."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import palpate
import pytest
from click.testing import CliRunner
from live_server import PATIENCE_S, Live
from palpate.cli import main
from palpate.elasticity import SORBOTHANE_MPA
from palpate.recording.rows import HEADER, format_rows
from palpate.recording.session import plan_of
from palpate.recording.sidecar import made, text_of
from palpate.simulation.hand import ten_specimens
from palpate.simulation.probe import simulate
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Origin

SPEED, WANTED = 60, 4
NAMES = list(SORBOTHANE_MPA)
TOUCHES = len(NAMES) * WANTED


class Talk:
    """A page that has nothing but its web socket."""

    def __init__(self, socket: ClientConnection) -> None:
        self._socket, self.told = socket, dict[str, dict[str, Any]]()

    def hear(self) -> str:
        """Take the next message; return its kind."""
        message = self._socket.recv(PATIENCE_S)
        if isinstance(message, bytes):
            number = int.from_bytes(message[4:8], "little")
            if number % 4 == 0:
                self._socket.send(json.dumps({"do": "seen", "frame": number}))
            return "rows"
        document = json.loads(message)
        self.told[document["type"]] = document
        return str(document["type"])

    def do(self, do: str, **given: Any) -> dict[str, Any]:
        """Give a command; return the answer."""
        self._socket.send(json.dumps({"do": do, **given}))
        while (kind := self.hear()) not in ("done", "refused", "failed"):
            pass
        assert kind == "done", self.told[kind]
        return self.told["done"]

    def until(self, touches: int, state: str = "") -> None:
        """Wait for so many touches of this measurement in the session, and for a state."""
        while self.known < touches or (state and self.told.get("state", {}).get("state") != state):
            self.hear()

    @property
    def known(self) -> int:
        last, rows = (self.told.get(kind, {}).get(name) for kind, name in (("session", "last"), ("touches", "rows")))
        return min(last["touch"] if last else 0, len(rows or ()))


def rehearsed(folder: Path) -> dict[str, dict[str, Any]]:
    """Measure ten specimens, record to rehearsal.csv; return the last messages of each kind."""
    listed = "\n".join(f"{name}; {SORBOTHANE_MPA[name]:g}".replace(".", ",") for name in NAMES)
    block = simulate(replace(ten_specimens(), tremor=0.0), 1).block()
    data = HEADER.encode() + format_rows(block)
    (folder / "ten.csv").write_bytes(data)
    (folder / "ten.json").write_text(text_of(made({"name": "ten specimens"}, len(block), data)))
    source = f"{folder / 'ten.csv'}?speed={SPEED}"
    with Live("--no-token", "--folder", str(folder), source=source) as live:
        with connect(f"ws://127.0.0.1:{live.port}/ws", origin=Origin(live.origin.rstrip("/"))) as socket:
            talk = Talk(socket)
            talk.until(TOUCHES, "ended")
            said = talk.do("plan", text=listed, wanted=WANTED, title="Table I", operator="A. B.")["message"]
            assert said.startswith(f"{len(NAMES)} specimens, {WANTED} touch")
            talk.do("again")
            talk.told.clear()
            talk.until(1)
            mark = talk.do("mark")["id"]
            talk.do("record", name="rehearsal.csv")
            talk.until(5)
            talk.do("discard", touch=2)
            talk.do("mark text", id=mark, text="after the first touch")
            talk.do("note", text="left hand from here on")
            talk.until(TOUCHES, "ended")
        live.end()
    return talk.told


def test_a_whole_session(tmp_path: Path) -> None:
    """Each touch is on its specimen; the replay has the same touches; the calibration needs no names of files."""
    told, path = rehearsed(tmp_path), tmp_path / "rehearsal.csv"
    rows, session = told["touches"]["rows"], told["session"]
    assert [row["specimen"] for row in rows] == [NAMES[k // WANTED] for k in range(TOUCHES)]
    assert [(row["number"], row["why"]) for row in rows if not row["kept"]] == [(2, "discarded")]
    assert session["count"] == {"kept": TOUCHES - 1, "of": TOUCHES}
    assert session["next"] == {"name": NAMES[0], "modulus": SORBOTHANE_MPA[NAMES[0]], "nth": WANTED, "of": WANTED}
    assert all(abs(row["deviation"]) < 0.2 for row in rows if row["kept"])
    assert [mark["text"] for mark in told["events"]["marks"]] == ["after the first touch"]
    touches = palpate.touches(palpate.read(path))
    assert [touch.ratio for touch in touches] == [row["ratio"] for row in rows]
    plan = plan_of(json.loads(path.with_suffix(".json").read_text()))
    assert (plan.title, plan.operator, plan.moduli) == ("Table I", "A. B.", {n: SORBOTHANE_MPA[n] for n in NAMES})
    entries = [entry for entry in plan.matched(touches) if entry]
    assert [entry.specimen for entry in entries] == [row["specimen"] for row in rows]
    assert [entry.left_out for entry in entries] == ["", "discarded", *[""] * (TOUCHES - 2)]
    assert [note.text for note in plan.notes] == ["left hand from here on"]
    assert palpate.check(path).clean
    result = CliRunner().invoke(main, ["calibrate", str(path), "-o", str(tmp_path / "probe.toml")])
    assert result.exit_code == 0, result.output
    fitted = palpate.Calibration.load(tmp_path / "probe.toml").probe
    assert fitted.rigid_ratio == pytest.approx(palpate.elasticity.Elasticity().rigid_ratio, rel=0.1)
