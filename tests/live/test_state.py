"""Word and line: each state from its facts, which one wins, what stays or is announced; and each state by what causes it.

The causes: unplugged: fault=unplug:SECONDS@T; saturated, and out of range: fault=overload:PF@T (0 ends it), in contact
and before; a wire that comes off: fault=wire-off:INPUT@T; swapped inputs: wiring=swapped; a hint: wiring=demo; the source
ends with an error: fault=lock@T; left out: sim:not-level. No option makes a source silent, constant or slow: for these there is `Fed`.
"""

import re
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from live_bench import SOURCE, Fed, Played, begun, noisy
from palpate import Judgement, Uncertainty
from palpate.flags import Flag
from palpate.live import connection, instruction_rules
from palpate.live.channel_status import ChannelSeen, SignalSeen
from palpate.live.connection import HOLD_S, SETTLED_S, SteadyLine
from palpate.live.instruction_rules import (
    LONG_S,
    LastTouch,
    PairRate,
    StatusInputs,
    StatusLine,
    file_state,
    view_of,
)
from palpate.live.protocol import Instruction, NextTouch, ReviewedFile
from palpate.simulation import Press, Scenario, hand
from palpate.source_events import Gap, GapCause, TroubleBegan, TroubleEnded, TroubleKind
from palpate.stream import Stream

WORDS = {"Touch", "Hold", "Lift", "Repeat", "Stop", "Tare", "Wait", "File", "Done", "Look", "Ended"}
DONE = ("40 of 40 done.", "Calibration saved.", "10 specimens; none left out")
GOOD = LastTouch(20, "ratio 2.50 ± 0.03")
OFFSET = replace(
    GOOD, why="offset: the soft bump is reached first: hold the probe upright", flags=(Flag.OFFSET,)
)
ON = [(0.0, 5.7)]
END = Judgement(2.0, "soft", "saturated", 4.096)
NEXT = NextTouch("30 OO", 0.7, 3, 4)
SLOW = PairRate(22.0, 40.0, 220, 0)


def facts(state: str = "no contact", **given: Any) -> StatusInputs:
    return StatusInputs(state, **given)


def seen(hard: dict[str, float], soft: dict[str, float], **given: Any) -> SignalSeen:
    return SignalSeen((ChannelSeen("hard", **hard), ChannelSeen("soft", **soft)), **given)


# StatusInputs, kind of the line, word, level, and what the line says: the most urgent ones first.
# fmt: off
CASES: list[tuple[StatusInputs, str, str, str, str]] = [
    (facts("ended", error="disk full"), "ended", "Stop", "fault", "Disk full. Measure again"),
    (facts("contact", troubles={"unplugged": "The board is gone"}, cut=20, recording="run.csv"),
     "unplugged", "Stop", "fault", "The board is gone. Touch 20 is cut: repeat it. The recording goes on."),
    (facts(troubles={"shared": "another program reads /dev/ttyUSB0 (cat, process 77)"}),
     "shared", "Stop", "fault", "Another program reads /dev/ttyUSB0 (cat, process 77)."),
    (facts(troubles={"wiring": "soft bump: its wire is off"}), "wiring", "Stop", "fault", "Soft bump: its wire is off."),
    (facts(silent_s=1.2, period_s=0.026), "silent", "Wait", "fault", "The source sends nothing."),
    (facts("contact", recording_error="run.csv: disk full", unrecorded=7),
     "recording", "Hold", "fault", "run.csv: disk full. 7 pairs are not recorded."),
    (facts("contact", rows_wait="run.csv: cannot be written: full: 7 rows wait"),
     "rows wait", "Hold", "caution", "run.csv: cannot be written: full: 7 rows wait. Make room on the disk; nothing is lost yet."),
    (facts("contact", rows_wait="run.csv: 7 rows are missing: full", unrecorded=7),
     "rows lost", "Hold", "fault", "run.csv: 7 rows are missing: full. Make room on the disk: it resumes by itself."),
    (facts(notes_wait="run.json: cannot be written: it is held"), "notes wait", "Touch", "caution", "run.json: cannot be written: it is held."),
    (facts(seen=seen({"reading": 0.0, "constant_s": 2.0}, {"reading": 0.0, "constant_s": 2.0})), "unwired", "Stop", "fault", "Both channels read 0.000 pF"),
    (facts(seen=seen({"reading": 0.62, "constant_s": 2.0}, {"reading": 0.4})),
     "constant", "Stop", "caution", "The hard channel reads the same value all the time, 0.620 pF"),
    (facts(judged=(END,)), "at its end", "Stop", "fault", "The soft channel is at the end of its range, 4.096 pF, from 2.0 s on"),
    (facts("contact", judged=(END,)), "at its end", "Repeat", "caution", "The soft channel is at the end of its range"),
    (facts(judged=(Judgement(2.0, "hard", "frozen", 0.62),), seen=seen({"reading": 0.62, "constant_s": 2.0}, {"reading": 0.4})),
     "constant", "Stop", "caution", "The hard channel stands at 0.62 pF to the last digit"),
    (facts(judged=(Judgement(2.0, "both", "falling", -0.6, -0.2),)), "falling", "Stop", "caution", "Both channels fall when pressed"),
    (facts(news=Judgement(9.9, "hard", "jumped", 3.1)), "news", "Touch", "caution", "The hard channel jumped by +3.1 pF at 9.9 s."),
    (facts(outside=("soft",), can_centre=True), "range", "Stop", "fault", "then press Centre."),
    (facts("contact", seen=seen({"limit_s": 0.4}, {}), full_scale_pF=4.096),
     "saturated", "Repeat", "caution", "The hard channel is at the limit, 4.096 pF, for 0.4 s of this touch."),
    (facts("contact", seen=seen({"limit_s": 0.4}, {"idle_s": 0.4})), "wire off", "Stop", "fault",
     "The hard channel is at its limit, and the other one shows no press: a wire of the hard gauge is off"),
    (facts("contact", judged=(END,), seen=seen({"idle_s": 0.4}, {})), "wire off", "Stop", "fault", "a wire of the soft gauge is off"),
    (facts(seen=seen({}, {"below_s": 2.0, "below_pF": 0.4})),
     "baseline", "Tare", "fault", "The soft channel is 0.40 pF below the baseline"),
    (facts("baseline", gap="the board was unplugged for 12.0 s", lost=456, cut=20), "gap", "Wait", "caution",
     "The board was unplugged for 12.0 s: 456 pairs are lost. Touch 20 is cut: repeat it. The baseline"),
    (facts("baseline", retaken=True), "baseline", "Wait", "caution", "far below"),
    (facts(seen=SignalSeen(touching="hard +0.72 pF")), "touched", "Lift", "caution", "Something touches: hard +0.72 pF. No baseline"),
    (facts(pace=SLOW), "slow", "Touch", "note", "22 of 40 pairs a second arrive. What it costs is known after a touch."),
    (facts(pace=SLOW, result=replace(GOOD, known=Uncertainty.of_ratio(8.4, 0.01))), "slow", "Touch", "note", "costs nothing here: ± 0.25 stays ± 0.25."),
    (facts(pace=SLOW, result=replace(GOOD, known=Uncertainty.of_ratio(8.4, 0.2))), "slow", "Touch", "note", "± 0.29 becomes ± 0.32."),
    (facts(pace=SLOW, slow_is_known=True), "ready", "Touch", "quiet", ""),
    (facts(result=replace(GOOD, swapped="exchange the wires")), "swapped", "Stop", "caution", "Exchange the wires."),
    (facts("done", result=OFFSET, next=NEXT), "left out", "Repeat", "caution", "Offset: the soft bump is reached first"),
    (facts(troubles={"hint": "remove R1 and R2"}), "hint", "Touch", "note", "Remove R1 and R2."),
    (facts(uncalibrated="the calibration is of another chip"), "calibration", "Touch", "caution", "The calibration is of another chip."),
    (facts("contact", uncalibrated="it is of another chip"), "calibration", "Hold", "caution", "It is of another chip."),
    (facts("done", result=OFFSET, next=NEXT, uncalibrated="it is of another chip"), "left out", "Repeat", "caution", "Offset"),
    (facts("done", seen=SignalSeen(done_s=LONG_S + 1), result=GOOD), "left in contact", "Lift", "note", "Touch 20 is kept."),
    (facts("done", result=GOOD, next=NEXT), "done", "Lift", "quiet", "Touch 20 is kept."),
    (facts("contact", seen=SignalSeen(share=0.6, left_s=2.5), next=NEXT), "contact", "Hold", "quiet", "30 OO, touch 3 of 4."),
    (facts("baseline"), "first baseline", "Wait", "quiet", "The baseline is being measured."),
    (facts("baseline", result=GOOD), "after", "Wait", "quiet", "is final"),
    (facts(seen=seen({"noise_pF": 2e-5}, {"noise_pF": 3e-5})), "ready", "Touch", "quiet", "Ready."),
    (facts(forced=True), "ready", "Touch", "quiet", "Ready, if nothing was touched at Tare anyway; else lift the probe"),
    (facts("ended"), "ended", "Ended", "note", "no more samples"),
    (facts("no contact", finished=DONE), "finished", "Done", "note", "Calibration saved."),
    (facts("no contact", finished=DONE, doubt="Look at touch 3: it fits gel better."), "look", "Look", "caution", "Look at touch 3"),
    (facts("ended", finished=DONE, pace=SLOW), "finished", "Done", "note", "Calibration saved."),
    (facts("ended", finished=DONE, error="disk full"), "ended", "Stop", "fault", "Disk full. Measure again"),
    (facts(retaken=True), "baseline", "Touch", "caution", ""),
    (facts("contact", pace=SLOW), "slow", "Hold", "note", ""),
    (facts(pace=PairRate(38.0, 38.4, 380, 5)), "slow", "Touch", "note", "5 pairs were not estimated; a recording has them."),
    (facts("adapting"), "contact", "Hold", "quiet", ""),
    (facts("contact", result=OFFSET), "contact", "Hold", "quiet", ""),
    (facts("no contact", result=OFFSET), "left out", "Repeat", "caution", ""),
    (facts("baseline", result=replace(GOOD, revised=True)), "first baseline", "Wait", "quiet", ""),
]
# fmt: on


@pytest.mark.parametrize(("given", "what", "word", "level", "text"), CASES)
def test_each_state(given: StatusInputs, what: str, word: str, level: str, text: str) -> None:
    now, line = view_of(given)
    assert (line.what, now.word, line.level) == (what, word, level)
    assert text in line.text
    assert word in WORDS
    assert line.text[0].isupper() or what in (
        "recording",
        "rows wait",
        "rows lost",
        "notes wait",
        "slow",
    )  # the name of a file, a number
    assert line.text[-1] == "."
    assert (line.title == "") == (level == "quiet")
    assert now.tone in ("idle", "busy", "good", "caution", "fault")


def test_when_a_state_begins() -> None:
    """Each limit of time or share: just below it the state is calm, just above it is not."""
    limits: list[tuple[str, float, Callable[[float], StatusInputs]]] = [
        ("silent", 1.0, lambda s: facts(silent_s=s, period_s=0.026)),
        ("saturated", 0.1, lambda s: facts("contact", seen=seen({"limit_s": s}, {}))),
        ("baseline", 1.0, lambda s: facts(seen=seen({"below_s": s, "below_pF": 0.4}, {}))),
        ("constant", 1.0, lambda s: facts(seen=seen({"constant_s": s, "reading": 0.1}, {}))),
        ("left in contact", 10.0, lambda s: facts("done", seen=SignalSeen(done_s=s))),
    ]
    for what, limit, made in limits:
        assert view_of(made(limit * 0.99))[1].what != what
        assert view_of(made(limit * 1.01))[1].what == what
    assert (instruction_rules.SLOW_SHARE, instruction_rules.FEWEST) == (0.9, 50)
    for calm in (PairRate(36.5, 40.0, 380, 0), PairRate(1.0, 40.0, 49, 0)):
        assert view_of(facts(pace=calm))[1].level == "quiet"
    # 2.9 pairs a second are too few to be counted as pairs
    for slow in (
        PairRate(35.5, 40.0, 380, 0),
        PairRate(2.9, 31.8, 318, 0),
        PairRate(40.0, 40.0, 9, 1),
    ):
        assert view_of(facts(pace=slow))[1].what == "slow"
    assert view_of(facts(silent_s=5.0, period_s=1.0))[1].level == "quiet"
    assert view_of(facts(troubles={"hint": "remove R1"}, result=GOOD))[1].level == "quiet"


def test_the_more_urgent_state_comes_first() -> None:
    signal = seen({"reading": 0.6, "constant_s": 2.0}, {"below_s": 2.0, "below_pF": 0.4})
    troubles = {
        "unplugged": "The board is gone",
        "wiring": "a wire is off",
        "hint": "remove R1 and R2",
    }
    now = facts(troubles=troubles, silent_s=1.2, period_s=0.026, recording_error="run.csv: disk full", notes_wait="held", outside=("soft",),
                seen=signal, gap="it was gone", retaken=True, pace=SLOW)  # fmt: skip
    device = ["unplugged", "wiring", "silent", "recording", "notes wait"]
    order = [*device, "constant", "range", "baseline", "gap", "baseline", "hint", "slow"]
    assert [line.what for line, _ in instruction_rules.urgent(now)] == order
    doubtful = replace(now, result=replace(OFFSET, swapped="exchange the wires"))
    assert [line.what for line, _ in instruction_rules.urgent(doubtful)] == [
        *order[:-2],
        "swapped",
        "left out",
        "slow",
    ]
    assert view_of(replace(now, state="ended", error="disk full"))[1].what == "ended"


@pytest.mark.parametrize(("given", "sub"), [
    (facts("done", result=OFFSET, next=NEXT), "lift, hold upright, touch 30 OO again"),
    (facts("done", result=GOOD, next=NEXT), "kept; then 30 OO, touch 3 of 4"),
    (facts("contact", seen=SignalSeen(share=0.6, left_s=2.5)), "2.5 s more"),
    (facts("contact", seen=SignalSeen(contact_s=4.2)), "4 s so far"),
    (facts("no contact", next=NEXT), "30 OO, touch 3 of 4: press, and hold"),
])  # fmt: skip
def test_subs_say_what_to_do(given: StatusInputs, sub: str) -> None:
    assert view_of(given)[0].sub == sub


def test_a_recording_is_not_measured() -> None:
    for verdict, level in (
        ("complete, clean end", "quiet"),
        ("changed", "caution"),
        ("not complete", "caution"),
    ):
        file = ReviewedFile("run-11.csv", 7612, 3, 2, end=verdict, amendable=True)
        shown = file_state(file)
        line = shown.line
        assert (shown.now.word, line.level, line.what) == ("File", level, "file")
        assert (
            f"{verdict}, 7612 rows, 3 missing, 2 without a value. Nothing is being measured."
            in line.text
        )


BAD, CALM = (
    StatusLine("wiring", "caution", "Wires.", "A wire."),
    StatusLine("ready", "quiet", "", "Ready.", "Ready."),
)
WORSE = StatusLine("unplugged", "fault", "Unplugged.", "Gone.")
TOUCH, STOP = Instruction("Touch", ""), Instruction("Stop", "")


def test_a_line_does_not_flicker() -> None:
    steady, shown = SteadyLine(), []
    for tenth in range(100):  # the cause comes and goes each 0.5 s until 5 s
        line = BAD if tenth < 50 and tenth % 10 < 5 else CALM
        shown.append(steady.show(TOUCH, line, None, tenth / 10).line.what)
    [change] = [tenth for tenth in range(1, 100) if shown[tenth] != shown[tenth - 1]]
    assert change / 10 == pytest.approx(4.4 + HOLD_S, abs=0.11)
    assert (HOLD_S, connection.GAP_S, connection.RATE_S, connection.LATE_S) == (
        3.0,
        3.0,
        2.0,
        10.0,
    )


def test_a_more_urgent_line_comes_at_once_and_says_how_long_it_lasts() -> None:
    steady = SteadyLine()
    lines = [
        (0.0, BAD),
        (0.1, WORSE),
        (0.2, CALM),
        (2.0, WORSE),
        (14.0, WORSE._replace(text="Still gone.")),
    ]
    shown = [steady.show(TOUCH, line, None, at_s).line for at_s, line in lines]
    assert [line.what for line in shown] == [
        "wiring",
        "unplugged",
        "ready",
        "unplugged",
        "unplugged",
    ]
    assert [line.since_s for line in shown] == [0, 0, None, 0, 12]


def test_what_is_said_has_settled() -> None:
    steady = SteadyLine()

    def said(
        now: Instruction, line: StatusLine, at_s: float, result: LastTouch | None = None
    ) -> str:
        return steady.show(now, line, result, at_s).announce

    hold, done = (
        StatusLine("contact", "quiet", "", "Measuring."),
        StatusLine("done", "quiet", "", "Kept.", "Complete."),
    )
    assert SETTLED_S == 1.0
    assert said(TOUCH, CALM, 0.0) == ""
    assert said(TOUCH, CALM, SETTLED_S) == "Touch. Ready."
    assert said(Instruction("Hold", "6 s"), hold, 2.0) == "Touch. Ready."  # too short
    assert said(TOUCH, CALM, 2.5) == "Touch. Ready."
    assert said(Instruction("Hold", "6 s"), hold, 5.0) == "Touch. Ready."
    assert said(Instruction("Hold", "5 s"), hold, 6.0) == "Hold. Measuring."
    assert (
        said(Instruction("Lift", ""), done, 11.0, GOOD)
        == "Touch 20: ratio 2.50 ± 0.03. Lift. Complete."
    )
    revised = replace(GOOD, text="ratio 2.51 ± 0.03", revised=True)
    assert said(TOUCH, CALM, 12.0, revised).startswith("Touch 20: ratio 2.50")
    assert said(TOUCH, CALM, 13.0, revised) == "Touch 20, revised: ratio 2.51 ± 0.03. Touch. Ready."
    assert said(STOP, WORSE, 13.1, revised) == "Stop. Unplugged. Gone."  # a fault at once
    assert said(STOP, WORSE, 60.0, revised) == "Stop. Unplugged. Gone."
    left = SteadyLine().show(*view_of(facts("done", result=OFFSET)), OFFSET, 0.0).announce
    assert left.startswith("Repeat. Touch 20 is left out. Offset:")
    assert "2.50" not in left


def test_a_session_from_its_baseline_to_its_last_touch_and_what_is_announced() -> None:
    played = Played(SOURCE).play()
    one = [("Touch", "ready"), ("Hold", "contact"), ("Lift", "done"), ("Wait", "after")]
    assert played.course == [
        ("Wait", "first baseline"),
        *4 * one,
        ("Touch", "ready"),
        ("Ended", "ended"),
    ]
    shares = [
        document.now.share or 0.0 for _, document in played.told if document.line.what == "contact"
    ]
    assert shares[0] == 0
    assert max(shares) > 0.95
    assert all(before <= after or after < 0.05 for before, after in pairwise(shares))
    assert len(played.told) > 150  # each of them could have been announced
    assert len(played.announced) <= 3 * 4 + 2
    for number, touch in enumerate(played.touches, 1):
        told = [text for text in played.announced if text.startswith(f"Touch {number}")]
        assert str(Uncertainty.of_ratio(touch.first_ratio, touch.first_standard_error)) in told[0]
        assert "Lift. Complete." in told[0]
        assert len(told) <= 2


def test_a_touch_is_not_shown_on_a_list_that_comes_while_it_runs() -> None:
    played = Played(SOURCE)
    plan = played.page_state._plan
    played.play(until_s=16.0, at={4.0: lambda _: plan.plan("30 OO", 2)})
    said = [(at_s, told.line.text) for at_s, told in played.told if told.now.word == "Hold"]
    assert {text for at_s, text in said if at_s < 10} == {"Measuring."}
    assert {text for at_s, text in said if at_s > 10} == {"Measuring. 30 OO, touch 1 of 2."}
    assert plan.rows[0].specimen is None


def test_tare_anyway_in_contact_is_said_until_the_next_touch() -> None:
    def tare(stream: Stream) -> None:
        played.forced = True
        stream.tare(force=True)

    played = Played(SOURCE)
    played.play(until_s=25.0, at={4.0: tare})
    ready = [told.line.text for at_s, told in played.told if at_s > 4 and told.line.what == "ready"]
    assert ready[0].startswith(
        "Ready, if nothing was touched at Tare anyway; else lift the probe, and press Tare."
    )
    assert ready[-1].startswith("Ready. ")


def test_how_far_a_touch_is() -> None:
    """A touch without a length has no share."""
    endless = Played("sim:sliding?seed=1", scene="sliding").play(until_s=8.0)
    last = [document.now for _, document in endless.told if document.now.word == "Hold"][-1]
    assert (last.share, last.sub) == (None, "6 s so far")


@pytest.mark.parametrize(("source", "until_s", "what", "word", "level", "text"), [
    ("sim:not-level?seed=1", 99, "left out", "Repeat", "caution", "Offset: the soft bump is reached"),
    ("sim:stiff-steady?seed=1&wiring=swapped", 99, "swapped", "Stop", "caution", "The soft channel changed more"),
    (f"{SOURCE}&wiring=demo", 5, "hint", "Touch", "note", ""),
    (f"{SOURCE}&fault=overload:5@3,overload:0@3.6", 10, "saturated", "Repeat", "caution", "The channels are at the lim"),
    (f"{SOURCE}&idle=20&fault=wire-off:2@4,wire-off:0@9", 20, "wiring", "Stop", "fault", r"Soft bump: CIN2\+ has"),
])  # fmt: skip
def test_causes(source: str, until_s: float, what: str, word: str, level: str, text: str) -> None:
    played = Played(source).play(until_s)
    _, document = played.first(what)
    assert (document.now.word, document.line.level) == (word, level)
    assert re.match(text, document.line.text)
    assert what != "wiring" or played.course[-1][1] != "wiring"


@pytest.mark.parametrize(("tremor", "fault", "held", "shown"), [
    (0.01, "", Press(-2.0, ON), "moves by 3.45 fF, 86.4 times its noise"),
    (0.0, "&fault=unplug:2@3", Press(4.0, ON, hold_s=4.0), "hard +1.42 pF, soft +0.25 pF above the baseline before"),
])  # fmt: skip
def test_contact_while_the_baseline_is_measured(
    monkeypatch: pytest.MonkeyPatch, tremor: float, fault: str, held: Press, shown: str
) -> None:
    """From the begin, by its tremor; after a replug, by its level even without one. Nothing is measured of it."""
    scenario = Scenario(presses=[held, Press(11.0, ON)], duration_s=19.0, tremor=tremor)
    monkeypatch.setitem(hand.SESSIONS, "held", scenario)
    played = Played(f"sim:held?seed=1{fault}").play()
    at_s, document = played.first("touched")
    assert at_s - (played.first("gap") if fault else played.told[0])[0] < 1.0
    assert (document.now.word, document.line.title) == ("Lift", "Lift the probe.")
    assert f"{shown}. No baseline is taken from it." in document.line.text
    assert played.course[played.course.index(("Lift", "touched")) + 1] == ("Touch", "ready")
    assert [(touch.flags, round(touch.ratio, 2)) for touch in played.touches] == [((), 5.7)]


def test_out_of_range_until_it_is_centred_and_a_tare_in_contact() -> None:
    played = Played(f"{SOURCE}&idle=12&fault=overload:9@3").play(
        12, at={7.0: lambda stream: stream.centre()}
    )
    found = played.first("range")[1]
    assert (found.now.word, found.line.level) == ("Stop", "fault")
    assert "press Centre" in found.line.text
    assert "The range was set again: CAPDAC" in played.first("gap")[1].line.text
    tared = Played(SOURCE).play(until_s=14, at={4.0: lambda stream: stream.tare(force=True)})
    released = [step for step in tared.course if step[1] == "baseline"]
    assert released[:2] == [("Wait", "baseline"), ("Touch", "baseline")]


@pytest.mark.parametrize(("fault", "text"), [
    ("sleep:3600@10", "The computer slept for 1 h 0 min."),
    ("stop:1800@10", "The program stood still for 30 min (stopped, or the computer was too busy)."),
])  # fmt: skip
def test_after_a_pause_of_the_computer_a_level_that_moved_is_no_contact(
    monkeypatch: pytest.MonkeyPatch, fault: str, text: str
) -> None:
    """In an hour both channels rise by more than the level of a contact."""
    scenario = Scenario(presses=[Press(2.0, ON), Press(13.0, ON)], duration_s=23.0)
    monkeypatch.setitem(hand.SESSIONS, "paused", scenario)
    played = Played(f"sim:paused?seed=1&fault={fault}").play()
    _, document = played.first("gap")
    assert (document.now.word, document.line.level) == ("Wait", "caution")
    assert document.line.text == f"{text} The baseline is measured again."
    assert not any(what == "touched" for _, what in played.course)
    assert [(touch.flags, round(touch.ratio, 1)) for touch in played.touches] == [((), 5.7)] * 2


def test_a_touch_is_cut_where_the_board_is_unplugged() -> None:
    played = Played(SOURCE)
    page = played.page_state

    def unplug(_: Stream) -> None:
        page.trouble_began(TroubleBegan(TroubleKind.UNPLUGGED, "The board is gone."))

    def plug(_: Stream) -> None:
        page.gap(Gap(GapCause.DISCONNECTED, "the board was unplugged for 1.0 s"))
        page.trouble_ended(TroubleEnded(TroubleKind.UNPLUGGED))

    played.play(until_s=5.0, at={4.0: unplug, 4.5: plug})
    _, gone = played.first("unplugged")
    assert (gone.now.word, gone.line.level) == ("Stop", "fault")
    assert gone.line.text == "The board is gone. Touch 1 is cut: repeat it."
    assert gone.announce == f"Stop. Unplugged. {gone.line.text}"
    text = "The board was unplugged for 1.0 s. Touch 1 is cut: repeat it."
    assert played.first("gap")[1].line.text.startswith(text)


def test_a_board_is_unplugged_and_comes_back(tmp_path: Path) -> None:
    bench = begun(f"{SOURCE}&idle=20&fault=unplug:1@4", tmp_path)
    gone = bench.waited("unplugged")
    assert (gone.now.word, gone.line.level) == ("Stop", "fault")
    assert gone.line.text.endswith(" The recording goes on.")
    assert re.search(r"plug it in again\. Waiting for it: 1[12]\d s left\.", gone.line.text)
    assert {fact.value for fact in bench.device.document().facts if fact.warn} >= {
        "0",
        "-",
    }
    assert "The board was unplugged for" in bench.waited("gap").line.text
    bench.measurement.close()
    assert "the board was unplugged for" in {
        gap.text[:27] for gap in bench.annotations.document().gaps
    }


def test_sources_that_a_simulated_board_cannot_be(tmp_path: Path) -> None:
    """Nothing wired; a constant channel; a slow computer; one channel that falls while the other rises."""
    made: dict[str, Any] = {
        "unwired": lambda: Fed(lambda _: (0.0, 0.0)),
        "constant": lambda: Fed(lambda number: (0.62, noisy(number)[1])),
        "slow": lambda: Fed(noisy, pause_s=0.03),
        "baseline": lambda: Fed(
            lambda n: noisy(n) if n < 150 else (noisy(n)[0] + 0.3, noisy(n)[1] - 0.3)
        ),
    }
    benches = {what: begun(source, tmp_path / what, record=False) for what, source in made.items()}
    found = {what: bench.waited(what) for what, bench in benches.items()}
    benches["slow"].obey("understood")
    assert benches["slow"].shown().line.what == "ready"
    for bench in benches.values():
        bench.measurement.close()
    assert found["unwired"].now.word == "Stop"
    assert (
        "The hard channel reads the same value all the time, 0.620 pF"
        in found["constant"].line.text
    )
    assert "of 100 pairs a second arrive" in found["slow"].line.text
    assert (found["baseline"].now.word, found["baseline"].line.level) == (
        "Tare",
        "fault",
    )
    assert re.match(
        r"The soft channel is 0\.[23]\d pF below the baseline", found["baseline"].line.text
    )


def _wire_comes_off(number: int) -> tuple[float, float]:
    """Return a press at whose end the hard channel is at its limit."""
    hard, soft = noisy(number)
    if number < 150:
        return hard, soft
    if number < 250:
        return hard + 0.5, soft + 0.2
    return 4.096, soft


class _SlowlyRead(Fed):
    """A source that this computer reads at a fifth of its rate, and whose period it has measured."""

    fastest_period_s = 0.002


def test_a_wire_that_comes_off_and_a_computer_that_was_always_slow(tmp_path: Path) -> None:
    wire = begun(lambda: Fed(_wire_comes_off), tmp_path / "wire", record=False)
    slow = begun(lambda: _SlowlyRead(noisy), tmp_path / "slow", record=False)
    found = wire.waited("wire off")
    late = slow.waited("slow")
    for bench in (wire, slow):
        bench.measurement.close()
    assert found.now.sub == "look at the wires of the hard gauge"
    assert "of 500 pairs a second arrive" in late.line.text


def test_a_source_that_falls_silent_and_a_process_that_stood_still() -> None:
    """A look that comes late does not blame the source; looks that are always late find it silent all the same."""
    played = Played(SOURCE).play(until_s=2.0)
    played.stream.source.live = True
    found = []
    for late_s in (2.0, 0.5, 2.0, 0.6, 0.6):
        played.at_s += late_s
        played.page_state.look()
        found.append(played.page_state.document().line.what == "silent")
    assert found == [False, False, True, True, True]
