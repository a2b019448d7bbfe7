"""What is touched: the list of specimens, which touch is on which of them, which ones are kept, and what comes next."""

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import palpate
import pytest
from effort import examples
from hypothesis import given
from hypothesis import strategies as st
from palpate import RecordingError, Touch
from palpate.live.desk.growth import missing
from palpate.live.desk.places import Places
from palpate.live.desk.plan import MOST_NOTES, Plan
from palpate.live.desk.progress import DISCARDED
from palpate.live.desk.specimens import LONGEST, MOST, specimens_of
from palpate.live.protocol import COMMANDS, Command, Refused
from palpate.recording import session as stored
from palpate.recording import sidecar
from palpate.samples import Status, blank
from palpate.simulation import scenarios

GOOD = palpate.touches(scenarios.run("four-specimens"))[0]
SHORT = palpate.touches(scenarios.run("saturating"))[0]
THREE = "30 OO; 0.143\ngel\n70 A; 8.68"


class Recorder:
    """Keeps what a recording would store."""

    def __init__(self, first_s: float = 0.0, path: Path | None = None) -> None:
        self.first_s, self.plan, self.path = first_s, stored.Plan(), path

    def session(self, plan: stored.Plan) -> None:
        self.plan = plan


def moved(touch: Touch, start_s: float, ratio: float | None = None, **changed: Any) -> Any:
    """Return a touch that began at another time."""
    values = {name: getattr(touch, name) for name in dir(touch) if not name.startswith("_") and name != "as_dict"}
    return SimpleNamespace(
        **{**values, "start_s": start_s, "ratio": touch.ratio if ratio is None else ratio, **changed}
    )


class Bench:
    """A plan without a measurement: touches come when the test says so."""

    def __init__(self, accepted: Sequence[str] = ()) -> None:
        self.number, self.touches, self.last_s = 1, list[Any](), 0.0
        self.followers, self.begun, self.said = list[Any](), list[Any](), list[str]()
        self.recorder: Recorder | None = Recorder()
        self.say = self.said.append
        self.accepted = frozenset(accepted)
        session: Any = self
        self.plan = Plan(session, lambda: self.accepted)

    def measured(self) -> tuple[int, list[Any]]:
        return self.number, self.touches

    def do(self, do: str, /, **given: Any) -> str:
        return self.plan.orders[do](Command(do, given))

    def touch(
        self, start_s: float, kind: Touch = GOOD, ratio: float | None = None, until_s: float | None = None
    ) -> None:
        """Complete a touch that began at this time."""
        self.touches = [*self.touches, moved(kind, start_s, ratio)]
        self.last_s = start_s + 6 if until_s is None else until_s
        self.followers[0](SimpleNamespace(touches=[1], revised=()), None)

    @property
    def told(self) -> dict[str, Any]:
        return self.plan.document()

    @property
    def next(self) -> str | None:
        found = self.told["next"]
        return f"{found['name']} {found['nth']}/{found['of']}" if found else None

    @property
    def specimens(self) -> list[str | None]:
        return [row["specimen"] for row in self.plan.rows()]


def begun(wanted: int = 2, text: str = THREE, **more: Any) -> Bench:
    bench = Bench(**more)
    bench.do("plan", text=text, wanted=wanted, title="gels", operator="A. B.")
    return bench


@pytest.mark.parametrize(
    ("line", "name", "modulus"),
    [
        ("30 OO", "30 OO", None),
        ("30 OO; 0.143", "30 OO", 0.143),
        ("30 OO;0,143", "30 OO", 0.143),
        ("30 OO\t0.143", "30 OO", 0.143),
        ("30 OO\t0,143 MPa", "30 OO", 0.143),
        ("30 OO, 0.143", "30 OO", 0.143),
        ("30 OO,0,143", "30 OO", 0.143),
        ('"30 OO","0.143"', "30 OO", 0.143),
        ("gel, soft;", "gel, soft", None),
        ("30 OO;", "30 OO", None),
        ("Gel 7 µ; 1.1e-2", "Gel 7 µ", 0.011),
    ],
)
def test_a_line_of_the_list(line: str, name: str, modulus: float | None) -> None:
    assert specimens_of(f"\n{line}\n\n", 3) == [stored.Specimen(name, modulus, 3)]


def test_a_table_with_a_heading_is_a_list() -> None:
    for heading in ("object,modulus_MPa", "specimen;E (MPa)", "name\tModul, MPa"):
        mark = next(mark for mark in "\t;," if mark in heading)
        assert specimens_of(f"{heading}\na{mark}1\nb{mark}2", 1) == [
            stored.Specimen("a", 1.0),
            stored.Specimen("b", 2.0),
        ]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a\nb; much", ["line 2: got 'much' as the modulus of 'b'", "a number above 0", "30 OO; 0.143"]),
        ("a; -1", ["line 1", "'-1'"]),
        ("a; 0", ["line 1", "'0'"]),
        ("a; 1e9", ["line 1", "'1e9'", "1e+06 at most"]),
        ("a; inf", ["line 1"]),
        ("a; nan", ["line 1"]),
        ("a; 1; 2", ["line 1", "'1; 2'"]),
        ("gel, soft", ["line 1", "'soft'"]),
        ("a\n\nb\na", ["line 4: got 'a' again, which is in line 1", "each name once"]),
        ("; 3", ["line 1: got '' as a name", "1 to 80 characters"]),
        ("x" * (LONGEST + 1), ["line 1", "1 to 80 characters"]),
        ("\n".join(map(str, range(MOST + 1))), [f"got {MOST + 1} specimens", f"{MOST} at most"]),
    ],
)
def test_a_list_that_is_refused(text: str, words: list[str]) -> None:
    with pytest.raises(Refused) as refused:
        specimens_of(text, 4)
    assert all(word in str(refused.value) for word in words)
    assert len(str(refused.value)) < 400


@given(st.text(max_size=200))
@examples(300)
def test_any_text_is_a_list_or_refused(text: str) -> None:
    bench, said = Bench(), ""
    try:
        checked = COMMANDS["plan"]["text"]("text", text)
        bench.do("plan", text=checked, wanted=1)
    except Refused as refusal:
        said = str(refusal)
    assert not said or ", allowed: " in said
    assert not bench.said


def test_flags_are_shown_where_they_arise() -> None:
    """In a touch from 1 s to 3 s: saturated at its second sample, all others at its end."""
    block = blank(5)
    block["t_hard_ns"], block["hard_raw"], block["soft_raw"] = np.arange(5) * 10**9, 1, 1
    block["status"][[0, 2]] = Status.HARD_SATURATED
    places, batch = Places(), SimpleNamespace(samples=block, rows={"touch": np.array([0, 1, 1, 1, 0])})
    places.follow(batch)  # type: ignore[arg-type]
    assert [places.of(1, flag, 9.0) for flag in ("saturated", "refused", "drift")] == [2.0, 3.0, 3.0]
    assert places.of(2, "saturated", 9.0) == 9.0


def test_the_next_specimen_comes_when_its_touches_are_kept() -> None:
    bench = begun()
    assert bench.next == "30 OO 1/2"
    for k, expected in enumerate(["30 OO 2/2", "gel 1/2", "gel 2/2", "70 A 1/2", "70 A 2/2", None]):
        bench.touch(10.0 * (k + 1))
        assert bench.next == expected
    assert bench.specimens == ["30 OO", "30 OO", "gel", "gel", "70 A", "70 A"]
    assert bench.told["count"] == {"kept": 6, "of": 6}
    assert bench.told["last"] == {"touch": 6, "kept": True}
    bench.touch(70.0)
    assert bench.specimens[-1] is None


def test_a_flag_leaves_a_touch_out_and_the_slot_is_repeated() -> None:
    bench = begun()
    bench.touch(10.0, SHORT)
    [row] = bench.plan.rows()
    assert (row["kept"], row["deviation"]) == (False, None)
    assert row["why"].split(":")[0] in SHORT.flags
    assert bench.next == "30 OO 1/2"
    bench.do("keep", touch=1)
    assert bench.plan.rows()[0]["why"] == ""
    assert bench.next == "30 OO 2/2"
    bench.do("discard", touch=1)
    assert bench.plan.rows()[0]["why"] == DISCARDED
    accepting = begun(accepted=SHORT.flags)
    accepting.touch(10.0, SHORT)
    assert accepting.plan.rows()[0]["kept"]
    accepting.accepted = frozenset()
    assert not accepting.plan.rows()[0]["kept"]


def test_a_discarded_touch_is_repeated_at_once_or_in_turn() -> None:
    bench = begun()
    bench.touch(10.0)
    bench.touch(20.0)
    assert bench.next == "gel 1/2"
    assert bench.do("discard", touch=2) == "Touch 2 is left out. Next: 30 OO."
    assert bench.next == "30 OO 2/2"
    bench.do("keep", touch=2)
    assert bench.next == "gel 1/2"
    bench.touch(30.0)
    bench.do("discard", touch=1)
    assert bench.next == "gel 2/2"
    for k in range(3):
        bench.touch(40.0 + 10 * k)
    assert bench.next == "30 OO 2/2"
    bench.touch(80.0)
    assert bench.next is None
    assert bench.told["specimens"][0]["kept"] == 2


def test_a_touch_is_on_the_specimen_that_was_next_when_it_began() -> None:
    bench = begun()
    bench.touch(10.0)
    bench.touch(20.0)
    bench.last_s = 35.0  # in the third touch, which began at 30 s
    bench.do("discard", touch=2)
    assert bench.next == "30 OO 2/2"
    bench.touch(30.0, until_s=36.0)
    assert bench.specimens == ["30 OO", "30 OO", "gel"]
    bench.last_s = 45.0
    bench.do("specimen", name="70 A")
    bench.touch(40.0, until_s=46.0)
    assert bench.specimens[3] == "gel"
    assert bench.next == "70 A 1/2"
    bench.touch(50.0)
    assert bench.specimens[4] == "70 A"
    bench.last_s = 65.0
    bench.do("plan", text="other", wanted=1)
    bench.touch(60.0, until_s=66.0)
    assert bench.specimens[5] == "70 A"
    assert bench.next == "other 1/1"


def test_the_user_chooses_corrects_and_wants_more() -> None:
    bench = begun(wanted=1)
    bench.last_s = 5.0
    assert bench.do("specimen", name="gel") == "Next: gel."
    bench.do("specimen", name="")
    assert bench.next == "30 OO 1/1"
    bench.do("specimen", name="gel")
    bench.touch(10.0)
    assert bench.specimens == ["gel"]
    assert bench.next == "70 A 1/1"
    bench.do("assign", touch=1, name="30 OO")
    assert bench.next == "gel 1/1"
    bench.do("assign", touch=1, name="")
    assert (bench.specimens, bench.next) == ([None], "30 OO 1/1")
    bench.do("assign", touch=1, name="30 OO")
    assert bench.do("more") == "30 OO: 2 touches are wanted."
    assert bench.next == "30 OO 2/2"
    bench.last_s = 16.0
    bench.do("specimen", name="30 OO")
    bench.touch(20.0)
    bench.do("specimen", name="30 OO")
    bench.touch(30.0)  # one more than is wanted
    assert bench.told["specimens"][0]["kept"] == 3
    assert bench.told["count"] == {"kept": 2, "of": 4}


@pytest.mark.parametrize(
    ("do", "given_", "words"),
    [
        ("specimen", {"name": "steel"}, "name: got 'steel', allowed: a specimen of the list: 30 OO, gel, 70 A"),
        ("assign", {"touch": 1, "name": "steel"}, "allowed: a specimen of the list"),
        ("assign", {"touch": 2, "name": "gel"}, "touch: got 2, allowed: a touch of this measurement, 1 to 1"),
        ("discard", {"touch": 0}, "touch: got 0"),
        ("keep", {"touch": 2**32 - 1}, "touch: got 4294967295"),
    ],
)
def test_what_is_not_there_is_refused(do: str, given_: dict[str, Any], words: str) -> None:
    bench = begun()
    bench.touch(10.0)
    before = bench.told
    with pytest.raises(Refused) as refused:
        bench.do(do, **given_)
    assert words in str(refused.value)
    assert bench.told == before


def test_without_a_list_and_without_a_ratio() -> None:
    bench = Bench()
    assert (bench.next, bench.told["count"], bench.told["last"]) == (None, {"kept": 0, "of": 0}, None)
    with pytest.raises(Refused, match="more: allowed"):
        bench.do("more")
    bench.touch(10.0, SHORT, ratio=math.nan)
    with pytest.raises(Refused, match="keep: touch 1 has no ratio"):
        bench.do("keep", touch=1)
    assert bench.recorder
    assert bench.recorder.plan.touches[0].specimen is None


def test_deviations_are_from_the_mean_of_the_kept_touches() -> None:
    bench = begun(wanted=3)
    for k, ratio in enumerate((2.0, 4.0, 9.0)):
        bench.touch(10.0 * (k + 1), ratio=ratio)
    bench.do("discard", touch=3)
    rows = bench.plan.rows()
    assert [row["deviation"] for row in rows] == [2 / 3 - 1, 4 / 3 - 1, 2.0]
    first = bench.told["specimens"][0]
    assert (first["mean"], first["kept"], first["of"]) == (3.0, 2, 3)
    assert [one["touch"] for one in first["deviations"]] == [1, 2, 3]


def test_a_revised_touch_is_judged_again() -> None:
    bench = begun(wanted=1)
    bench.touch(10.0)
    assert bench.next == "gel 1/1"
    bench.touches = [moved(SHORT, 10.0)]
    assert bench.next == "30 OO 1/1"
    bench.touches = [moved(GOOD, 10.0, ratio=5.0)]
    assert bench.next == "gel 1/1"
    assert bench.told["specimens"][0]["mean"] == 5.0


def test_another_measurement_keeps_what_was_done() -> None:
    bench = begun()
    bench.touch(10.0)
    bench.touch(20.0)
    bench.touch(30.0)
    bench.do("note", text="warm")
    bench.number, bench.touches, bench.last_s, bench.recorder = 2, [], 0.0, Recorder()
    assert bench.next == "gel 2/2"
    assert (bench.plan.rows(), bench.told["last"], bench.told["notes"]) == ([], None, [])
    bench.touch(1.0)
    assert (bench.specimens, bench.next) == (["gel"], "70 A 1/2")
    assert [one["touch"] for one in bench.told["specimens"][1]["deviations"]] == [None, 1]
    assert [entry.start_s for entry in bench.recorder.plan.touches] == [1.0]
    numbers = [n for known in bench.plan.known() for n, _, _ in known.touches]
    assert numbers == [-2, -1]
    assert missing(bench.plan.known()) == [
        "1 of at least 3 specimens are touched.",
        "Not touched yet: 70 A.",
    ]


def test_the_recording_gets_what_is_within_it() -> None:
    bench = begun()
    bench.touch(10.0)
    bench.last_s = 18.0
    bench.do("note", text="left hand")
    bench.touch(20.0, SHORT)
    assert bench.recorder
    plan = bench.recorder.plan
    assert (plan.title, plan.operator) == ("gels", "A. B.")
    assert plan.specimens == tuple(specimens_of(THREE, 2))
    assert plan.notes == (stored.Note(18.0, "left hand"),)
    assert [(entry.start_s, entry.specimen) for entry in plan.touches] == [(10.0, "30 OO"), (20.0, "30 OO")]
    assert plan.touches[0].left_out == ""
    assert plan.touches[1].left_out == bench.plan.rows()[1]["why"][:200]
    later = Recorder(first_s=15.0)
    bench.recorder = later
    bench.begun[0](later)
    assert later.plan == replace(plan, touches=plan.touches[1:])


def test_a_recording_without_room_is_told() -> None:
    class Full(Recorder):
        def session(self, plan: stored.Plan) -> None:
            raise ValueError("session: no room")

    bench = begun()
    bench.recorder = Full()
    bench.touch(10.0)
    assert bench.said == ["session: no room"]
    assert bench.next == "30 OO 2/2"


def test_notes_have_a_limit() -> None:
    bench = Bench()
    for k in range(MOST_NOTES):
        bench.do("note", text=str(k))
    with pytest.raises(Refused, match=f"note: got {MOST_NOTES} notes"):
        bench.do("note", text="one more")
    assert len(bench.told["notes"]) == MOST_NOTES


@given(
    st.lists(
        st.one_of(
            st.tuples(st.just("touch"), st.booleans()),
            st.tuples(st.sampled_from(["discard", "keep"]), st.integers(1, 6)),
            st.tuples(st.sampled_from(["specimen", "assign"]), st.sampled_from(["30 OO", "gel", "70 A", ""])),
            st.tuples(st.sampled_from(["more", "again", "plan"]), st.none()),
        ),
        max_size=25,
    )
)
@examples(100)
def test_any_order_of_events_keeps_the_account(events: list[tuple[str, Any]]) -> None:
    """A touch keeps its specimen until it is assigned; counts are those of the rows; the next one lacks touches."""
    bench = begun()
    for what, value in events:
        bench.last_s += 10
        name = (bench.told["next"] or {"name": None})["name"]
        expected = _expected(what, value, bench.specimens, name)
        try:
            _happens(bench, what, value)
        except Refused:
            expected = bench.specimens
        told = bench.told
        assert bench.specimens == expected
        for one in told["specimens"]:
            assert one["kept"] == sum(each["kept"] for each in one["deviations"])
        assert told["next"] or all(one["kept"] >= one["of"] for one in told["specimens"])
    assert not bench.said


def _expected(what: str, value: Any, before: list[str | None], following: str | None) -> list[str | None]:
    """Return the specimens of the touches after an event."""
    if what == "touch":
        return [*before, following]
    if what == "again":
        return []
    return [*before[:-1], value or None] if what == "assign" and before else before


def _happens(bench: Bench, what: str, value: Any) -> None:
    if what == "touch":
        bench.touch(bench.last_s + 1, GOOD if value else SHORT, until_s=bench.last_s + 8)
    elif what == "again":
        bench.number, bench.touches, bench.last_s = bench.number + 1, [], 0.0
    else:
        touch = {"touch": len(bench.specimens)} if what == "assign" else {}
        given_: dict[str, dict[str, Any]] = {"plan": {"text": THREE, "wanted": 2}, "more": {}}
        named = {"name": value} if what in ("assign", "specimen") else {"touch": value}
        bench.do(what, **given_.get(what, {**touch, **named}))


def test_what_is_changed_after_the_end_is_in_the_recording(tmp_path: Path) -> None:
    """The report and `calibrate` read the file: they must know what the page shows."""
    path = tmp_path / "run.csv"
    (tmp_path / "run.json").write_text(sidecar.text_of(sidecar.made({}, 0, b"")))
    bench = begun()
    assert bench.recorder
    bench.recorder.path = path
    bench.touch(1)
    before = sidecar.load(path)
    assert before
    bench.recorder = None
    bench.do("assign", touch=1, name="gel")
    bench.do("discard", touch=1)
    after = sidecar.load_checked(path)
    assert after and after.intact
    assert after.document == {**before, "session": after.document["session"]}
    assert stored.plan_of(after.document).touches == (stored.Entry(1.0, "gel", "discarded"),)
    (tmp_path / "run.json").unlink()
    with pytest.raises(RecordingError, match="run.json"):
        bench.do("keep", touch=1)
    bench.number, bench.touches = 2, []
    bench.do("note", text="of the next measurement, without a recording")
    assert not (tmp_path / "run.json").exists()
