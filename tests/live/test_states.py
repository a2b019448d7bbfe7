"""Word and line as a table: each state from its facts, which one wins, and what stays or is said over time."""

import math
from dataclasses import replace
from typing import Any

import pytest
from palpate.live.desk.facts import Facts, Pace, Result
from palpate.live.desk.states import URGENT, of_file, view_of
from palpate.live.desk.telling import HOLD_S, SETTLED_S, Teller
from palpate.live.desk.touching import ENDLESS_S, LONG_S
from palpate.live.desk.watching import Seen
from palpate.live.desk.words import Line, Now

WORDS = {"Touch", "Hold", "Lift", "Repeat", "Stop", "Tare", "Wait", "File"}
OFFSET = Result(20, "ratio 2.50 ± 0.03", "offset: the soft bump is reached first: hold the probe upright", ("offset",))
GOOD = Result(20, "ratio 2.50 ± 0.03")
NEXT = {"name": "30 OO", "modulus": 0.7, "nth": 3, "of": 4}
SLOW = Pace(22.0, 40.0, 220, 31, 0)


def facts(state: str = "no contact", **given: Any) -> Facts:
    return Facts(state, **given)


# Kind of the line -> facts, word, level, and what the line says.
CASES: dict[str, tuple[Facts, str, str, str]] = {
    "ended": (facts("ended", error="disk full"), "Stop", "fault", "Disk full. Measure again"),
    "unplugged": (
        facts("contact", troubles={"unplugged": "The board is gone"}, cut=20, recording="run.csv"),
        "Stop",
        "fault",
        "The board is gone. Touch 20 is cut: repeat it. The recording goes on.",
    ),
    "wiring": (
        facts(troubles={"wiring": "soft bump: its wire is off"}),
        "Stop",
        "fault",
        "Soft bump: its wire is off.",
    ),
    "silent": (facts(silent_s=1.2, period_s=0.026), "Wait", "fault", "The source sends nothing."),
    "recording": (
        facts("contact", recording_error="run.csv: disk full", unrecorded=7),
        "Hold",
        "fault",
        "run.csv: disk full. 7 pairs are not recorded.",
    ),
    "unwired": (facts(seen=Seen(readings=(0.0, 0.0), constant_s=(2.0, 2.0))), "Stop", "fault", "read 0.000 pF"),
    "constant": (
        facts(seen=Seen(readings=(0.62, 0.4), constant_s=(2.0, 0.0))),
        "Stop",
        "caution",
        "The hard channel reads the same value all the time, 0.620 pF",
    ),
    "range": (facts(outside=("soft",), can_centre=True), "Stop", "fault", "then press Centre."),
    "saturated": (
        facts("contact", seen=Seen(limit_s=(0.4, 0.0)), full_scale_pF=4.096),
        "Repeat",
        "caution",
        "The hard channel is at the limit, 4.096 pF, for 0.4 s of this touch.",
    ),
    "baseline": (
        facts(seen=Seen(below_s=(0.0, 2.0), below_pF=(0.0, 0.4))),
        "Tare",
        "fault",
        "The soft channel is 0.40 pF below the baseline",
    ),
    "gap": (
        facts("baseline", gap="the board was unplugged for 12.0 s", gap_s=0.5, lost=456, cut=20),
        "Wait",
        "caution",
        "The board was unplugged for 12.0 s: 456 pairs are lost. Touch 20 is cut: repeat it. The baseline",
    ),
    "endless": (facts("done", seen=Seen(done_s=ENDLESS_S + 1), result=GOOD), "Lift", "caution", "press Tare anyway"),
    "slow": (facts(pace=SLOW), "Touch", "caution", "22 of 40 pairs a second; 31 of the last 220 pairs came late."),
    "swapped": (facts(result=replace(GOOD, swapped="exchange the wires")), "Stop", "caution", "Exchange the wires."),
    "left out": (
        facts("done", result=OFFSET, next=NEXT),
        "Repeat",
        "caution",
        "Offset: the soft bump is reached first",
    ),
    "hint": (facts(troubles={"hint": "remove R1 and R2"}), "Touch", "note", "Remove R1 and R2."),
    "left in contact": (facts("done", seen=Seen(done_s=LONG_S + 1), result=GOOD), "Lift", "note", "Touch 20 is kept."),
    "done": (facts("done", result=GOOD, next=NEXT), "Lift", "quiet", "Touch 20 is kept."),
    "contact": (facts("contact", seen=Seen(share=0.6, left_s=2.5), next=NEXT), "Hold", "quiet", "30 OO, touch 3 of 4."),
    "first baseline": (facts("baseline"), "Wait", "quiet", "The baseline is being measured."),
    "after": (facts("baseline", result=GOOD), "Wait", "quiet", "revised"),
    "ready": (facts(seen=Seen(noise_pF=(2e-5, 3e-5)), about="Gel series 3."), "Touch", "quiet", "fF. Gel series 3."),
}
ALSO: list[tuple[Facts, str, str, str]] = [
    (facts("ended"), "ended", "Stop", "note"),
    (facts("baseline", retaken_s=0.1), "baseline", "Wait", "caution"),
    (facts(retaken_s=1.0), "baseline", "Touch", "caution"),
    (facts("contact", pace=SLOW), "slow", "Hold", "caution"),
    (facts(pace=Pace(38.0, 38.4, 380, 1, 5)), "slow", "Touch", "caution"),
    (facts("adapting"), "contact", "Hold", "quiet"),
    (facts("contact", result=OFFSET), "contact", "Hold", "quiet"),
    (facts("no contact", result=OFFSET), "left out", "Repeat", "caution"),
    (facts("baseline", result=replace(GOOD, revised=True)), "first baseline", "Wait", "quiet"),
]


@pytest.mark.parametrize("what", CASES)
def test_each_state(what: str) -> None:
    given, word, level, text = CASES[what]
    now, line = view_of(given)
    assert (line.what, now.word, line.level) == (what, word, level)
    assert text in line.text
    assert word in WORDS
    assert line.text[0].isupper() or what in ("recording", "slow")  # the name of a file, a number
    assert line.text[-1] == "."
    assert (line.title == "") == (level == "quiet")
    assert now.tone in ("idle", "busy", "good", "caution", "fault")


@pytest.mark.parametrize(("given", "what", "word", "level"), ALSO)
def test_other_facts(given: Facts, what: str, word: str, level: str) -> None:
    now, line = view_of(given)
    assert (line.what, now.word, line.level) == (what, word, level)


@pytest.mark.parametrize(
    "given",
    [
        facts(silent_s=0.9),
        facts(silent_s=5.0, period_s=1.0),
        facts("contact", seen=Seen(limit_s=(0.05, 0.0))),
        facts(seen=Seen(below_s=(0.5, 0.0), below_pF=(0.4, 0.0))),
        facts(seen=Seen(constant_s=(0.5, 0.5), readings=(0.0, 0.0))),
        facts(pace=Pace(37.0, 38.4, 380, 3, 0)),
        facts(pace=Pace(1.0, 38.4, 10, 9, 0)),
        facts("done", result=GOOD, seen=Seen(done_s=1.0)),
        facts(troubles={"hint": "remove R1"}, result=GOOD),
    ],
)
def test_what_is_no_reason_to_worry(given: Facts) -> None:
    assert view_of(given)[1].level == "quiet"


def test_the_more_urgent_state_wins() -> None:
    order = [what for what in CASES if view_of(CASES[what][0])[1].level != "quiet" and what not in ("left in contact",)]
    assert len(order) >= len(URGENT) - 1  # the two of the baseline have one name
    tried = 0
    for first, what in enumerate(order):
        for other in order[first + 1 :]:
            merged = _both(CASES[what][0], CASES[other][0])
            if merged:
                tried += 1
                assert view_of(merged)[1].what == what, f"{what} and {other}"
    assert tried > 40


def _both(one: Facts, other: Facts) -> Facts | None:
    """Return facts with what both differ in from calm ones; None: both need the same fact, or another state."""
    calm = Facts(one.state)
    # In tuples: a nan is itself.
    mine = {name for name in vars(calm) if (getattr(one, name),) != (getattr(calm, name),)}
    theirs = {name for name in vars(calm) if (getattr(other, name),) != (getattr(calm, name),)}
    mine, theirs = mine - {"state"}, theirs - {"state"}
    if mine & theirs or (one.state != other.state and "no contact" not in (one.state, other.state)):
        return None
    state = other.state if one.state == "no contact" else one.state
    merged = replace(one, state=state, **{name: getattr(other, name) for name in theirs})
    kept = view_of(replace(one, state=state))[1].what == view_of(one)[1].what
    return merged if kept else None


def test_subs_say_what_to_do() -> None:
    def sub(what: str) -> str:
        return view_of(CASES[what][0])[0].sub

    assert sub("left out") == "lift, hold upright, touch 30 OO again"
    assert sub("done") == "kept; then 30 OO, touch 3 of 4"
    assert sub("contact") == "2.5 s more"
    assert view_of(facts("no contact", next=NEXT))[0].sub == "30 OO, touch 3 of 4: press, and hold"
    assert view_of(facts("contact", seen=Seen(contact_s=4.2)))[0].sub == "4 s so far"


def test_a_recording_is_not_measured() -> None:
    now, line = of_file("run-11.csv, 21 Nov 2026", "complete, clean end", "7612 rows")
    assert (now.word, line.level, line.title, line.what) == ("File", "quiet", "", "file")
    assert line.text == "A recording: complete, clean end, 7612 rows. Nothing is being measured."
    for verdict in ("changed", "not complete"):
        now, line = of_file("run-11.csv", verdict, "7612 rows")
        assert (now.word, line.level) == ("File", "caution")
        assert verdict in line.title


BAD, CALM = Line("slow", "caution", "Slow.", "Slow."), Line("ready", "quiet", "", "Ready.", "Ready.")
WORSE = Line("unplugged", "fault", "Unplugged.", "Gone.")
TOUCH, STOP = Now("Touch", ""), Now("Stop", "")


def test_a_line_does_not_flicker() -> None:
    teller, shown = Teller(), []
    for tenth in range(100):  # the cause comes and goes each 0.5 s until 5 s
        line = BAD if tenth < 50 and tenth % 10 < 5 else CALM
        shown.append(teller.tell(TOUCH, line, None, tenth / 10)["line"]["what"])
    changes = [tenth for tenth in range(1, 100) if shown[tenth] != shown[tenth - 1]]
    assert len(changes) == 1
    assert changes[0] / 10 == pytest.approx(4.4 + HOLD_S, abs=0.11)


def test_a_more_urgent_line_comes_at_once_and_goes_at_once() -> None:
    teller = Teller()
    lines = [(0.0, BAD), (0.1, WORSE), (0.2, CALM)]
    assert [teller.tell(TOUCH, line, None, at_s)["line"]["what"] for at_s, line in lines] == [
        "slow",
        "unplugged",
        "ready",
    ]


def test_how_long_a_line_lasts() -> None:
    teller = Teller()
    assert teller.tell(TOUCH, CALM, None, 1.0)["line"]["since_s"] is None
    assert teller.tell(STOP, WORSE, None, 2.0)["line"]["since_s"] == 0
    assert teller.tell(STOP, WORSE, None, 14.0)["line"]["since_s"] == 12
    assert teller.tell(STOP, WORSE._replace(text="Still gone."), None, 15.0)["line"]["since_s"] == 13


def test_what_is_said_has_settled() -> None:
    teller = Teller()

    def said(now: Now, line: Line, at_s: float, result: Result | None = None) -> str:
        return str(teller.tell(now, line, result, at_s)["announce"])

    hold, done = Line("contact", "quiet", "", "Measuring."), Line("done", "quiet", "", "Kept.", "Complete.")
    assert said(TOUCH, CALM, 0.0) == ""
    assert said(TOUCH, CALM, SETTLED_S) == "Touch. Ready."
    assert said(Now("Hold", "6 s"), hold, 2.0) == "Touch. Ready."  # too short
    assert said(TOUCH, CALM, 2.5) == "Touch. Ready."
    assert said(Now("Hold", "6 s"), hold, 5.0) == "Touch. Ready."
    assert said(Now("Hold", "5 s"), hold, 6.0) == "Hold. Measuring."
    assert said(Now("Lift", ""), done, 11.0, GOOD) == "Touch 20: ratio 2.50 ± 0.03. Lift. Complete."
    revised = replace(GOOD, text="ratio 2.51 ± 0.03", revised=True)
    assert said(TOUCH, CALM, 12.0, revised).startswith("Touch 20: ratio 2.50")
    assert said(TOUCH, CALM, 13.0, revised) == "Touch 20, revised: ratio 2.51 ± 0.03. Touch. Ready."
    assert said(STOP, WORSE, 13.1, revised) == "Stop. Unplugged. Gone."  # a fault at once
    assert said(STOP, WORSE, 60.0, revised) == "Stop. Unplugged. Gone."


def test_a_touch_that_is_left_out_has_no_ratio_in_its_announcement() -> None:
    now, line = view_of(facts("done", result=OFFSET))
    said = Teller().tell(now, line, OFFSET, 0.0)["announce"]
    assert said.startswith("Repeat. Touch 20 is left out. Offset:")
    assert "2.50" not in said
    assert math.isclose(now.share or 0.0, 1.0)
