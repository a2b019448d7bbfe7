"""The plan of a session in the sidecar: what is read of it, what is refused, and which touch has which entry."""

import json
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import palpate
import pytest
from palpate.errors import RecordingError
from palpate.recording import sidecar
from palpate.recording.session import PERIOD_S, Entry, Note, Plan, Specimen, plan_of
from palpate.touch import Touches
from project import ROOT

FOUR = ROOT / "tests" / "data" / "four-specimens.csv"
WHOLE = Plan(
    title="Monday",
    operator="N. N.",
    specimens=(Specimen("30 OO", 0.143, wanted=4), Specimen("gel")),
    touches=(Entry(12.5, "30 OO"), Entry(20.25, None, "discarded")),
    notes=(Note(3.0, "first line\nsecond line"),),
)


@pytest.fixture(scope="module")
def touches() -> Touches:
    return palpate.touches(palpate.read(FOUR))


def test_a_plan_comes_back_from_a_sidecar(tmp_path: Path) -> None:
    document = sidecar.fresh({}, {}, []) | {"session": WHOLE.as_dict()}
    sidecar.save(tmp_path / "run.json", document)
    loaded = sidecar.load(tmp_path / "run.csv")
    assert loaded is not None
    assert plan_of(loaded) == WHOLE


@pytest.mark.parametrize(
    "session", [{}, {"specimens": []}, {"colour": "blue"}, {"touches": [{"start_s": 1, "by": "x"}]}]
)
def test_keys_may_be_missing_or_unknown(session: dict[str, Any]) -> None:
    assert plan_of({"session": session}).title == ""


@pytest.mark.parametrize(
    ("session", "reason"),
    [
        ([], "session: got [], allowed: names and values"),
        ({"title": 1}, "session: title: got 1, allowed: a text of 0 to 200 characters"),
        ({"operator": "x" * 201}, "allowed: a text of 0 to 200 characters"),
        ({"title": "\x1b[2J"}, "session: title: got the character '\\x1b', allowed: characters that can be shown"),
        ({"specimens": "gel"}, "session: specimens: got 'gel', allowed: a list"),
        ({"specimens": ["gel"]}, "session: specimens, 1: got 'gel', allowed: names and values"),
        ({"specimens": [{}]}, "session: specimens, 1: got no name"),
        ({"specimens": [{"name": ""}]}, "session: specimens, 1: name: got '', allowed: a text of 1 to 200 characters"),
        ({"specimens": [{"name": "a\nb"}]}, "name: got the character '\\n'"),
        ({"specimens": [{"name": "\ud800"}]}, "name: got the character '\\ud800'"),
        ({"specimens": [{"name": "gel"}] * 2}, "session: specimens: got 'gel' twice, allowed: each name once"),
        ({"specimens": [{"name": "gel", "modulus_MPa": 0}]}, "modulus_MPa: got 0, allowed: a number above 0, or null"),
        ({"specimens": [{"name": "gel", "modulus_MPa": float("nan")}]}, "modulus_MPa: got nan"),
        ({"specimens": [{"name": "gel", "modulus_MPa": True}]}, "modulus_MPa: got True"),
        ({"specimens": [{"name": "gel", "wanted": 100}]}, "wanted: got 100, allowed: an integer from 1 to 99"),
        ({"specimens": [{"name": str(n)} for n in range(1001)]}, "specimens: got 1001, allowed: 1000 at most"),
        ({"touches": [{"specimen": "gel"}]}, "session: touches, 1: got no start_s"),
        ({"touches": [{"start_s": "1"}]}, "start_s: got '1', allowed: a finite number, s"),
        ({"touches": [{"start_s": float("inf")}]}, "start_s: got inf"),
        ({"touches": [{"start_s": 1, "left_out": None}]}, "left_out: got None"),
        ({"notes": [{"t_s": 1.0, "text": 5}]}, "session: notes, 1: text: got 5"),
    ],
)
def test_what_is_of_another_kind_is_refused(session: Any, reason: str, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="session") as refused:
        plan_of({"session": session})
    assert reason in str(refused.value)
    document = sidecar.fresh({}, {}, []) | {"session": session}
    (tmp_path / "run.json").write_text(json.dumps(document))
    with pytest.raises(RecordingError, match="not the sidecar of a recording"):
        sidecar.load(tmp_path / "run.csv")


def test_an_entry_belongs_to_the_touch_it_is_nearest_to(touches: Touches) -> None:
    starts = [touch.start_s for touch in touches]
    late = Plan(touches=tuple(Entry(start_s + 0.5, str(n)) for n, start_s in enumerate(starts)))
    assert [entry and entry.specimen for entry in late.matched(touches)] == ["0", "1", "2", "3"]
    assert [entry and entry.specimen for entry in map(late.of, touches)] == ["0", "1", "2", "3"]


def test_each_entry_belongs_to_one_touch(touches: Touches) -> None:
    between = [left.start_s + 0.6 * (right.start_s - left.start_s) for left, right in pairwise(touches)]
    plan = Plan(
        touches=(Entry(touches[0].start_s, "own"), Entry(touches[0].start_s + 1, "spare"), Entry(between[1], "x"))
    )
    found = plan.matched(touches)
    assert found[0] == plan.touches[0]
    assert len([entry for entry in found if entry is not None]) == len({id(e) for e in found if e is not None})


def test_an_entry_farther_than_a_length_is_of_no_touch(touches: Touches) -> None:
    length_s = touches[0].samples * PERIOD_S
    near, far = (Plan(touches=(Entry(touches[0].start_s - share * length_s, "x"),)) for share in (0.99, 1.01))
    assert near.of(touches[0]) == near.touches[0]
    assert far.of(touches[0]) is None
    assert far.of(touches[0], period_s=2 * PERIOD_S) == far.touches[0]


def test_a_touch_without_times_has_no_entry(touches: Touches) -> None:
    assert WHOLE.of(touches[0]._untimed()) is None


def test_specimens_with_a_modulus() -> None:
    assert WHOLE.moduli == {"30 OO": 0.143}
    assert replace(WHOLE, specimens=()).moduli == {}
