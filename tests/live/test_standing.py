"""Every state of the page provoked by what causes it, with the option of a simulated board if there is one.

unplugged: fault=unplug:SECONDS@T; saturated, and out of range: fault=overload:PF@T (0 ends it), in contact and before;
a wire that comes off: fault=wire-off:INPUT@T (0: on again); swapped inputs: wiring=swapped; a hint: wiring=demo;
the source ends with an error: fault=lock@T; left out: sim:not-level. Nothing wired (wiring=open) never becomes a state of
a board: the measurement does not begin, and the error says which wire. No option makes a source send nothing, the same
value, or too slowly: for these there are sources of `live_fed`.
"""

import json
import re
import time
from itertools import pairwise
from pathlib import Path
from threading import Event

import palpate
import pytest
from live_bench import ORIGIN, OWN, client
from live_fed import PATIENCE_S, Fed, begun, fed, noisy, waited
from live_played import Played
from palpate.digits import plus_minus
from palpate.errors import DeviceRefused
from palpate.live import hub
from palpate.live.desk import standing


def test_a_session_from_its_baseline_to_its_last_touch() -> None:
    played = Played("sim:four-specimens?seed=1").play()
    one = [("Touch", "ready"), ("Hold", "contact"), ("Lift", "done"), ("Wait", "after")]
    assert played.course == [("Wait", "first baseline"), *4 * one, ("Touch", "ready"), ("Stop", "ended")]
    shares = [document["now"]["share"] for _, document in played.told if document["line"]["what"] == "contact"]
    assert shares[0] == 0
    assert max(shares) > 0.95
    assert all(before <= after or after < 0.05 for before, after in pairwise(shares))


def test_a_session_is_announced_a_few_times() -> None:
    played = Played("sim:four-specimens?seed=1").play()
    states = [document for _, document in played.told]
    assert len(states) > 150  # each of them could have been said
    assert len(played.announced) <= 3 * 4 + 2
    for number, touch in enumerate(played.touches, 1):
        told = [text for text in played.announced if text.startswith(f"Touch {number}")]
        assert [text.partition(":")[0] for text in told][:1] == [f"Touch {number}"]
        assert plus_minus(touch.first_ratio, touch.first_standard_error) in told[0]
        assert "Lift. Complete." in told[0]
        assert len(told) <= 2


def test_a_touch_of_samples_has_a_share_too() -> None:
    played = Played("sim:stiff-steady?seed=1", samples=150).play()
    held = [document["now"] for _, document in played.told if document["now"]["word"] == "Hold"]
    assert held[-1]["share"] > 0.95
    middle = next(now for now in held if now["share"] >= 0.5)
    assert float(middle["sub"].split()[0]) == pytest.approx(75 * 0.0313, rel=0.2)


def test_a_touch_without_a_length_has_no_share() -> None:
    played = Played("sim:sliding?seed=1", scene="sliding").play(until_s=8.0)
    held = [document["now"] for _, document in played.told if document["now"]["word"] == "Hold"]
    assert {now["share"] for now in held} == {None}
    assert held[-1]["sub"] == "6 s so far"


def test_a_touch_is_left_out() -> None:
    played = Played("sim:not-level?seed=1").play()
    _, document = played.first("left out")
    assert document["now"]["word"] == "Repeat"
    assert document["now"]["sub"] == "lift, hold upright, touch again"
    assert document["line"]["title"] == "Touch 1 is left out."
    assert document["line"]["text"].startswith("Offset: the soft bump is reached")
    assert played.course[-2] == ("Repeat", "left out")  # until the next touch begins


def test_the_inputs_are_exchanged() -> None:
    _, document = Played("sim:stiff-steady?seed=1&wiring=swapped").play().first("swapped")
    assert document["line"]["text"].startswith("The soft channel changed more than the hard one")


def test_saturated_in_contact() -> None:
    played = Played("sim:four-specimens?seed=1&fault=overload:5@3,overload:0@3.6").play(until_s=10)
    at_s, document = played.first("saturated")
    assert at_s == pytest.approx(3.1, abs=0.1)
    assert document["now"] == {"word": "Repeat", "sub": "lift, then press less", "tone": "caution", "share": None}
    assert "The channels are at the limit, 4.096 pF, for 0.1 s of this touch. Press less" in document["line"]["text"]
    longest = [told["line"]["text"] for _, told in played.told if told["line"]["what"] == "saturated"][-1]
    assert "for 0.6 s" in longest


def test_out_of_range_without_a_touch_until_it_is_centred() -> None:
    played = Played("sim:four-specimens?seed=1&idle=12&fault=overload:9@3").play(
        until_s=12, at={7.0: lambda stream: stream.centre()}
    )
    _, document = played.first("range")
    assert (document["now"]["word"], document["line"]["level"]) == ("Stop", "fault")
    assert "press Centre" in document["line"]["text"]
    _, after = played.first("gap")
    assert "The range was set again: CAPDAC" in after["line"]["text"]
    assert ("Touch", "gap") in played.course


def test_a_tare_in_contact_loses_the_baseline() -> None:
    played = Played("sim:four-specimens?seed=1").play(until_s=14, at={4.0: lambda stream: stream.tare(force=True)})
    released = ("Wait", "baseline"), ("Touch", "baseline")
    assert [step for step in played.course if step[1] == "baseline"][:2] == [*released]
    assert "far below" in played.first("baseline")[1]["line"]["text"]


def test_a_wire_comes_off_and_is_put_on_again() -> None:
    played = Played("sim:four-specimens?seed=1&idle=20&fault=wire-off:2@4,wire-off:0@9").play(until_s=20)
    at_s, document = played.first("wiring")
    assert at_s < 6
    assert (document["now"]["word"], document["line"]["level"]) == ("Stop", "fault")
    assert document["line"]["text"].startswith("Soft bump: CIN2+ has")
    assert played.course[-1][1] != "wiring"


def test_a_doubt_about_the_wiring() -> None:
    _, document = Played("sim:four-specimens?seed=1&wiring=demo").play(until_s=5).first("hint")
    assert (document["now"]["word"], document["line"]["level"]) == ("Touch", "note")


def test_nothing_wired_is_said_before_the_measurement() -> None:
    with pytest.raises(DeviceRefused, match="no probe is connected"), palpate.open("sim:four-specimens?wiring=open"):
        pass


def test_a_board_is_unplugged_and_comes_back(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(standing, "GAP_S", PATIENCE_S)
    session, bench = begun("sim:four-specimens?seed=1&idle=60&fault=unplug:3@2", tmp_path)
    gone = waited(bench, "unplugged")
    assert (gone["now"]["word"], gone["line"]["level"]) == ("Stop", "fault")
    text = "The board is gone: plug it in again. It is waited for, up to 30 s. The recording goes on."
    assert gone["line"]["text"] == text
    assert gone["announce"] == f"Stop. Unplugged. {text}"
    back = waited(bench, "gap")
    assert "The board was unplugged for" in back["line"]["text"]
    while "pairs are lost" not in back["line"]["text"]:  # they are known with the first pair
        back = waited(bench, "gap")
    waited(bench, "Touch")
    session.close()
    marks = json.loads((tmp_path / "run.json").read_text())["marks"]
    assert [mark["gap"] for mark in marks] == [True]


def test_a_touch_is_cut_by_unplugging(tmp_path: Path) -> None:
    """With a source that is unplugged when the touch has begun, however slow the machine is."""

    def made(number: int) -> tuple[float, float]:
        hard, soft = noisy(number)
        pressed = 0.0 if number < 150 else min((number - 150) / 100, 1.0) + 1e-3 * (number % 7)
        return hard + 2 * pressed, soft + pressed

    source = Fed(made)
    session, bench = begun(lambda: source, tmp_path)
    waited(bench, "Hold")
    source.unplug()
    assert waited(bench, "unplugged")["line"]["text"] == (
        "The board is gone. Touch 1 is cut: repeat it. The recording goes on."
    )
    source.plug()
    back = waited(bench, "gap")["line"]["text"]
    assert back.startswith("The board was unplugged for a while")
    assert "Touch 1 is cut: repeat it." in back
    session.close()


def test_the_line_goes_out_at_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(hub, "_STATES_PER_S", 1 / (2 * PATIENCE_S))  # no state but by a change
    session, _ = begun("sim:four-specimens?seed=1&idle=60&fault=unplug:60@3", tmp_path)
    found = []
    with client(session) as page, page.websocket_connect("/ws", headers={"host": OWN, "origin": ORIGIN}) as socket:
        while "unplugged" not in found:
            message = socket.receive()
            if message.get("text") and (told := json.loads(message["text"]))["type"] == "state":
                found.append(told["line"]["what"])
    session.close()
    assert len(found) < 20


def test_the_source_ends(tmp_path: Path) -> None:
    session, bench = begun("sim:four-specimens?seed=1&speed=50", tmp_path)
    ended = waited(bench, "ended")
    session.close()
    assert (ended["line"]["level"], ended["line"]["title"]) == ("note", "Ended.")


def test_the_source_ends_with_an_error(tmp_path: Path) -> None:
    session, bench = begun("sim:four-specimens?seed=1&fault=lock@1", tmp_path)
    ended = waited(bench, "ended")
    session.close()
    assert ended["line"]["level"] == "fault"
    assert "unplug the board for a moment" in ended["line"]["text"]


def test_the_recording_fails(tmp_path: Path) -> None:
    session, bench = begun("sim:four-specimens?seed=1", tmp_path)
    waited(bench, "Touch")
    (tmp_path / "run.csv").unlink()
    deadline = time.monotonic() + PATIENCE_S
    while (told := bench.state()["line"])["what"] not in ("recording", "ended") and time.monotonic() < deadline:
        time.sleep(0.02)
    session.close()
    assert "was removed" in told["text"]
    assert told["what"] in ("recording", "ended")


def test_nothing_wired_to_a_source_that_does_not_look(tmp_path: Path) -> None:
    session, bench = begun(fed(lambda _: (0.0, 0.0)), tmp_path)
    state = waited(bench, "unwired")
    session.close()
    assert (state["now"]["word"], state["line"]["title"]) == ("Stop", "Nothing wired.")


def test_a_channel_that_never_changes(tmp_path: Path) -> None:
    session, bench = begun(fed(lambda number: (0.62, noisy(number)[1])), tmp_path)
    state = waited(bench, "constant")
    session.close()
    assert "The hard channel reads the same value all the time, 0.620 pF" in state["line"]["text"]


def test_a_look_that_comes_late_does_not_blame_the_source(tmp_path: Path) -> None:
    """The process itself stood still: a silence counts from then on."""
    silent = Event()
    session, bench = begun(fed(lambda number: None if silent.is_set() else noisy(number)), tmp_path)
    waited(bench, "Touch")
    silent.set()
    time.sleep(1.6)
    assert bench.state()["line"]["what"] != "silent"
    waited(bench, "silent")
    session.close()


def test_looks_that_are_always_late_find_a_silent_source(tmp_path: Path) -> None:
    silent = Event()
    session, bench = begun(fed(lambda number: None if silent.is_set() else noisy(number)), tmp_path)
    waited(bench, "Touch")
    silent.set()
    told = []
    for _ in range(3):
        time.sleep(1.2)
        told.append(bench.state()["line"]["what"])
    session.close()
    assert told[0] != "silent"
    assert told[-1] == "silent"


def test_a_source_that_falls_silent(tmp_path: Path) -> None:
    silent = Event()
    session, bench = begun(fed(lambda number: None if silent.is_set() else noisy(number)), tmp_path)
    waited(bench, "Touch")
    silent.set()
    assert waited(bench, "silent")["now"]["word"] == "Wait"
    silent.clear()
    deadline = time.monotonic() + PATIENCE_S
    while (told := bench.state())["line"]["what"] not in ("ready", "slow") and time.monotonic() < deadline:
        time.sleep(0.02)
    assert (told["now"]["word"], told["line"]["what"] in ("ready", "slow")) == ("Touch", True)
    session.close()


def test_a_computer_that_is_too_slow(tmp_path: Path) -> None:
    session, bench = begun(fed(noisy, pause_s=0.03), tmp_path)
    state = waited(bench, "slow")
    session.close()
    assert "came late" in state["line"]["text"]
    assert state["line"]["level"] == "caution"


def test_one_channel_falls_while_the_other_rises(tmp_path: Path) -> None:
    """The baseline is not measured again by itself then: the sum of the changes is that of no touch."""

    def made(number: int) -> tuple[float, float]:
        hard, soft = noisy(number)
        return (hard, soft) if number < 200 else (hard + 0.3, soft - 0.3)

    session, bench = begun(fed(made), tmp_path)
    state = waited(bench, "baseline")
    session.close()
    assert (state["now"]["word"], state["line"]["level"]) == ("Tare", "fault")
    assert re.match(r"The soft channel is 0\.[23]\d pF below the baseline", state["line"]["text"])
