"""A whole session over the web socket: ten specimens by four touches, with its recording and its calibration."""

import json
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import palpate
import pytest
from click.testing import CliRunner
from live_bench import ORIGIN, OWN, client
from palpate import Sample
from palpate.cli import main
from palpate.elasticity import SORBOTHANE_MPA
from palpate.live.recordings import Recordings
from palpate.live.session import Session
from palpate.recording.session import plan_of
from palpate.samples import samples_of
from palpate.simulation.probe import Simulation, simulate
from palpate.simulation.sessions import ten_specimens

SPEED, WANTED = 60, 4
NAMES = list(SORBOTHANE_MPA)
TOUCHES = len(NAMES) * WANTED
_PATIENCE_S = 300


class Paced(palpate.Source):
    """A simulated measurement, faster than in real time; it loses nothing on a busy machine."""

    def __init__(self, simulated: Simulation, speed: float) -> None:
        self._simulated, self._speed, self.real_time = simulated, speed, False

    def describe(self) -> dict[str, Any]:
        return {"name": "ten specimens", "full_scale_pF": self._simulated.full_scale_pF, "period_s": 0.026}

    def __iter__(self) -> Iterator[Sample]:
        """Return the samples when their time has come."""
        begun = time.monotonic()
        for sample in samples_of(self._simulated.block()):
            time.sleep(max(begun + sample.t_hard_ns / 1e9 / self._speed - time.monotonic(), 0.0))
            yield sample


class Talk:
    """A page that has nothing but its web socket."""

    def __init__(self, socket: Any) -> None:
        self._socket, self.told = socket, dict[str, dict[str, Any]]()

    def hear(self) -> str:
        """Take the next message; return its kind."""
        message = self._socket.receive()
        if not (text := message.get("text")):
            number = int.from_bytes(message["bytes"][4:8], "little")
            if number % 4 == 0:
                self._socket.send_text(json.dumps({"do": "seen", "frame": number}))
            return "rows"
        document = json.loads(text)
        self.told[document["type"]] = document
        return str(document["type"])

    def do(self, do: str, **given: Any) -> dict[str, Any]:
        self._socket.send_text(json.dumps({"do": do, **given}))
        while (kind := self.hear()) not in ("done", "refused", "failed"):
            pass
        assert kind == "done", self.told[kind]
        return self.told["done"]

    def until(self, touches: int) -> None:
        """Wait for so many touches of this measurement, and for a session that knows them."""
        end = time.monotonic() + _PATIENCE_S
        while self.rows < touches or (self.told["session"]["last"] or {"touch": 0})["touch"] < touches:
            assert time.monotonic() < end
            assert not self.told["state"]["error"]
            self.hear()

    def until_state(self, state: str) -> None:
        """Wait for a state of the measurement."""
        end = time.monotonic() + _PATIENCE_S
        while "session" not in self.told or self.told.get("state", {}).get("state") != state:
            assert time.monotonic() < end, self.told.get("state")
            self.hear()

    @property
    def rows(self) -> int:
        return len(self.told.get("touches", {"rows": ()})["rows"])


@pytest.fixture(scope="module")
def rehearsed(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, dict[str, Any]], list[str]]:
    """Return the recording, the last messages of each kind, and the ratios of the live measurement."""
    folder = tmp_path_factory.mktemp("rehearsal")
    sources = iter(
        (palpate.open("sim:soft-steady?seed=1"), Paced(simulate(replace(ten_specimens(), tremor=0.0), 1), SPEED))
    )
    session = Session(lambda: next(sources), Recordings(None, folder), {"scene": "handheld"})
    session.start()
    listed = "\n".join(f"{name}; {SORBOTHANE_MPA[name]:g}".replace(".", ",") for name in NAMES)
    with client(session) as page, page.websocket_connect("/ws", headers={"host": OWN, "origin": ORIGIN}) as socket:
        talk = Talk(socket)
        talk.until_state("ended")
        said = talk.do("plan", text=listed, wanted=WANTED, title="Table I", operator="A. B.")["message"]
        assert said.startswith(f"{len(NAMES)} specimens, {WANTED} touch")
        talk.do("again")
        talk.until(1)
        mark = talk.do("mark")["id"]
        talk.do("record", name="rehearsal.csv")
        talk.until(5)
        talk.do("discard", touch=2)
        talk.do("mark text", id=mark, text="after the first touch")
        talk.do("note", text="left hand from here on")
        talk.until(TOUCHES)
        talk.until_state("ended")
    ratios = [touch.ratio.hex() for touch in session.touches]
    session.close()
    return folder / "rehearsal.csv", talk.told, ratios


def test_each_touch_is_on_its_specimen(rehearsed: Any) -> None:
    _, told, _ = rehearsed
    rows = told["touches"]["rows"]
    assert [row["specimen"] for row in rows] == [NAMES[k // WANTED] for k in range(TOUCHES)]
    assert [row["number"] for row in rows if not row["kept"]] == [2]
    assert rows[1]["why"] == "discarded"
    assert told["session"]["count"] == {"kept": TOUCHES - 1, "of": TOUCHES}
    repeated = NAMES[1 // WANTED]
    assert told["session"]["next"] == {
        "name": repeated,
        "modulus": SORBOTHANE_MPA[repeated],
        "nth": WANTED,
        "of": WANTED,
    }
    assert all(abs(row["deviation"]) < 0.2 for row in rows if row["kept"])
    assert [mark["text"] for mark in told["events"]["marks"]] == ["after the first touch"]


def test_its_replay_has_the_same_touches_with_their_specimens(rehearsed: Any) -> None:
    path, told, ratios = rehearsed
    recording = palpate.read(path)
    touches = palpate.touches(recording)
    assert [touch.ratio.hex() for touch in touches] == ratios
    document = json.loads(path.with_suffix(".json").read_text())
    plan = plan_of(document)
    assert (plan.title, plan.operator) == ("Table I", "A. B.")
    assert plan.moduli == {name: SORBOTHANE_MPA[name] for name in NAMES}
    entries = [entry for entry in plan.matched(touches) if entry]
    assert [entry.specimen for entry in entries] == [row["specimen"] for row in told["touches"]["rows"]]
    assert [entry.left_out for entry in entries] == ["", "discarded", *[""] * (TOUCHES - 2)]
    assert [note.text for note in plan.notes] == ["left hand from here on"]
    assert palpate.check(path).clean


def test_its_calibration_needs_no_file_names(rehearsed: Any, tmp_path: Path) -> None:
    path, _, _ = rehearsed
    result = CliRunner().invoke(main, ["calibrate", str(path), "-o", str(tmp_path / "probe.toml")])
    assert result.exit_code == 0, result.output
    fitted = palpate.Calibration.load(tmp_path / "probe.toml")
    truth = palpate.elasticity.Elasticity()
    assert fitted.probe.rigid_ratio == pytest.approx(truth.rigid_ratio, rel=0.1)
