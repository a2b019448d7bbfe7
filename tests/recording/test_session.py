"""The plan of a session in the sidecar: what is read of it, what is refused, and which touch has which entry."""

import json
from pathlib import Path
from typing import Any

import palpate
import pytest
from palpate.errors import RecordingError
from palpate.recording import sidecar
from palpate.recording.session import PERIOD_S, Entry, Note, Plan, Specimen, plan_of
from palpate.tracking import Touches
from project import FOUR

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
    ("session", "reason"),
    [
        ([], "session: got [], allowed: names and values"),
        ({"title": 1}, "session: title: got 1, allowed: a text of 0 to 200 characters"),
        ({"specimens": ["gel"]}, "session: specimens, 1: got 'gel', allowed: names and values"),
        (
            {"specimens": [{"name": "gel"}] * 2},
            "session: specimens: got 'gel' twice, allowed: each name once",
        ),
        (
            {"specimens": [{"name": "gel", "modulus_MPa": 0}]},
            "modulus_MPa: got 0, allowed: a number above 0, or null",
        ),
        (
            {"specimens": [{"name": "gel", "wanted": 100}]},
            "wanted: got 100, allowed: an integer from 1 to 99",
        ),
        ({"touches": [{"start_s": True}]}, "start_s: got True, allowed: a finite number, s"),
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


def test_an_entry_farther_than_a_length_is_of_no_touch(touches: Touches) -> None:
    length_s = touches[0].samples * PERIOD_S
    near, far = (
        Plan(touches=(Entry(touches[0].start_s - share * length_s, "x"),)) for share in (0.99, 1.01)
    )
    assert near.matched(touches) == [near.touches[0], None, None, None]
    assert far.matched(touches) == [None] * 4
    assert far.matched(touches, period_s=2 * PERIOD_S) == [far.touches[0], None, None, None]
    assert WHOLE.matched([touches[0].without_times()]) == [None], "it has no times"
