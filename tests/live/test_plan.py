"""What is touched: the list of specimens, which touch is on which of them, which ones are kept, and what comes next."""

import math
import re
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import palpate
import pytest
from effort import examples
from hypothesis import given
from hypothesis import strategies as st
from palpate import Calibration, Touch
from palpate.calibration.calibration_file import About
from palpate.errors import RecordingError
from palpate.live.measurement import EndedRecording
from palpate.live.plan import DISCARDED, TouchPlan, specimens_of
from palpate.live.protocol import ReadLine, RefusedCommand, SessionMessage, SessionResult
from palpate.live.run_files import RunFiles
from palpate.recording import session as stored
from palpate.recording import sidecar
from palpate.recording.sidecar import Sidecar
from palpate.simulation import scenarios

GOOD = palpate.touches(scenarios.run("four-specimens"))[0]
SHORT = palpate.touches(scenarios.run("saturating"))[0]
THREE = "30 OO; 0.143\ngel\n70 A; 8.68"


class Recorder:
    """Keeps what a recording would store."""

    def __init__(self, first_s: float = 0.0, path: Path | None = None) -> None:
        self.first_s, self.plan, self.path = first_s, stored.Plan(), path
        self.waited, self.sidecar_trouble = False, ""

    def session(self, plan: stored.Plan, *, wait: bool) -> None:
        self.plan, self.waited = plan, wait


def moved(touch: Touch, start_s: float, ratio: float | None = None) -> Touch:
    """Return a touch that began at another time."""
    return replace(touch, start_s=start_s, ratio=touch.ratio if ratio is None else ratio)


class Bench:
    """A plan without a measurement: touches come when the test says so."""

    def __init__(self, wanted: int = 2, calibration: Calibration | None = None) -> None:
        self.touches, self.last_s, self.sidecar = list[Any](), 0.0, Sidecar()
        self.listeners, self.recording_begun, self.said = list[Any](), list[Any](), list[str]()
        self.recorder: Recorder | None = Recorder()
        self.newest_recorder: Recorder | None = self.recorder
        self.notify = self.said.append
        self.files = RunFiles()
        measurement: Any = self
        self.file = None
        self.touches_wanted = 4
        self.require_amendable = lambda: None
        self.plan = TouchPlan(measurement, calibration)
        self.do("plan", text=THREE, wanted=wanted, title="gels", operator="A. B.")

    def do(self, do: str, /, **given: Any) -> str:
        return str(getattr(self.plan, do.replace(" ", "_"))(**given))

    def begin(self) -> None:
        """Begin the next measurement."""
        self.touches, self.last_s, self.newest_recorder = [], 0.0, None
        self.plan.begun(SimpleNamespace(source=SimpleNamespace(hand=None)))  # type: ignore[arg-type]

    def touch(
        self,
        start_s: float,
        kind: Touch = GOOD,
        ratio: float | None = None,
        until_s: float | None = None,
    ) -> None:
        """Complete a touch that began at this time."""
        self.touches = [*self.touches, moved(kind, start_s, ratio)]
        self.last_s = start_s + 6 if until_s is None else until_s
        self.plan.touch(len(self.touches), self.touches[-1])

    def take(self, what: str) -> None:
        """Take a step of a story: a touch, or an order in few words."""
        do, _, rest = what.partition(" ")
        if do in ("touch", "short"):
            self.touch(self.last_s + 4, GOOD if do == "touch" else SHORT)
        elif do == "again":
            self.begin()
        elif do == "plan":
            self.do(do, text="other", wanted=1)
        elif do == "choose":
            self.do("specimen", name=rest)
        elif do == "assign":
            self.do(do, touch=int(rest.split(" ")[0]), name=rest.partition(" ")[2])
        else:
            self.do(do, **{"touch": int(rest)} if rest else {})

    @property
    def ended_recording(self) -> EndedRecording | None:
        ended = self.newest_recorder
        if ended is None or ended.path is None:
            return None
        of: Any = ended
        return EndedRecording(ended.path, ended.first_s, of)

    @property
    def told(self) -> SessionMessage:
        return self.plan.document

    @property
    def next(self) -> str | None:
        found = self.told.next
        return f"{found.name} {found.nth}/{found.of}" if found else None

    @property
    def specimens(self) -> list[str | None]:
        return [row.specimen for row in self.plan.rows]


def test_the_end_of_a_plan() -> None:
    """From the last wanted touch until another object is touched, or is to be."""
    bench = Bench(wanted=1)
    for what in ("touch", "short", "touch"):
        bench.take(what)
        assert (bench.plan.finished(), bench.told.done) == (None, None)
    bench.files.made(Path("early.html"), "report")  # of some of the touches
    bench.take("touch")
    bench.files.made(Path("probe.toml"), "calibration")
    line = (
        "3 of 3 done.",
        "Calibration saved. The recording goes on until you end it.",
        "3 specimens; 1 left out",
    )
    assert bench.plan.finished() == line
    assert bench.told.done == SessionResult(0.03, "assumed", inside=0, of=0, left_out=1)
    bench.do("specimen", name="")
    assert bench.plan.finished() is None
    bench.take("touch")
    assert bench.specimens[-1] is None
    assert bench.told.done is None
    ratios = [GOOD.ratio * level * off for level in (1.0, 2.5, 5.0) for off in (0.98, 1.0, 1.02)]
    found = Bench(
        wanted=1, calibration=Calibration.fit(ratios, [0.143] * 3 + [1.0] * 3 + [8.68] * 3)
    )
    for _ in range(3):
        found.take("touch")
    assert found.told.done
    assert (found.told.done.source, found.told.done.of) == ("calibration", 2)
    assert found.told.done.inside <= 1  # of two moduli, the same ratio


def of(modulus: float | None, uncertainty: float | None = None) -> ReadLine:
    """Return a line of a list as the page gets it."""
    return ReadLine(modulus, uncertainty)


@pytest.mark.parametrize(
    ("text", "uncertainty"),
    [
        ("gel; 2; 5 %", 0.05),
        ("gel\t2\t2,5%", 0.025),
        ("gel; 2000 kPa; 0.1 MPa", 0.05),
        ("gel, 2, 5 %", 0.05),
        ("gel, 2,0, 5 %", 0.05),
        ("gel; 2; ±5 %", 0.05),
        ("gel; 2; 0 %", 0.0),
        ("gel; 2;", None),
        ("name; modulus; uncertainty, %\ngel; 2; 5", 0.05),
        ("name; MPa; u(E), kPa\ngel; 2; 100", 0.05),
    ],
)
def test_the_uncertainty_of_a_modulus_in_a_list(text: str, uncertainty: float | None) -> None:
    [one] = specimens_of(text, 4)
    assert one.modulus_MPa == 2.0
    assert one.modulus_uncertainty == pytest.approx(uncertainty)


def test_how_a_list_is_read() -> None:
    text = "name; MPa\n\na; 0,25\nb; 0,2.5\nc\nd; 250 kPa\na; 1"
    wrong = ReadLine(wrong="got 'b; 0,2.5', allowed: moduli above 0, as 30 OO; 0.143")
    twice = ReadLine(wrong="got 'a' again, allowed: each name once")
    quarter = of(0.25)
    assert TouchPlan.read_list(text) == [
        None,
        None,
        quarter,
        wrong,
        of(None),
        quarter,
        twice,
    ]
    assert TouchPlan.read_list("a; 250\nb; 2 MPa", "kPa") == [quarter, of(2.0)]
    assert TouchPlan.read_list("a; 4.1 kPa\nb; 0.0041") == 2 * [of(0.0041)]
    assert TouchPlan.read_list("Probe;E-Modul [kPa]\na;250\nb;1e6 Pa") == [
        None,
        quarter,
        of(1.0),
    ]
    assert TouchPlan.read_list("specimen,modulus_MPa\na,0.25", "kPa") == [None, quarter]
    of_psi = ReadLine(wrong="got the unit 'psi', allowed: Pa, kPa, MPa or GPa")
    assert TouchPlan.read_list("name; psi\na; 36 psi\nb; 0.25") == [
        of_psi,
        of_psi,
        quarter,
    ]


@pytest.mark.parametrize(
    ("line", "value"),
    [("; 0.143", 0.143), (";0,143", 0.143), ('\t"0.143"', 0.143), (", 0,143 MPa", 0.143), ("; 1.1e-2", 0.011), (";", None)],
)  # fmt: skip
def test_a_line_of_the_list(line: str, value: float | None) -> None:
    for heading in ("", "object,modulus_MPa\n", "name\tModul, MPa\n"):
        assert specimens_of(f"{heading}\nGel 7 µ{line}\n\n", 3) == [
            stored.Specimen("Gel 7 µ", value, 3)
        ]


@pytest.mark.parametrize(("text", "words"), [
    ("a\nb; much", "line 2: got 'b; much', allowed: moduli above 0, as"), ("a; -1", "line 1: got 'a; -1'"),
    ("a; 0", "line 1"), ("a; nan", "line 1"),
    ("a; 1; 2", "line 1: got '2' as a standard uncertainty, allowed: a number, 0 or more, with %"), ("a; 1; 100 %", "line 1"),
    ("a; 1; about 5 %", "line 1"), ("name; MPa; uncertainty", "line 1: got 'uncertainty' without a unit"), ("gel, soft", "line 1"),
    ("a\n\nb\na", "line 4: got 'a' again, allowed: each name once"), ("; 3", "1 to 200 characters"), ("a; x\nb\n; 1", "0.143\nline 3: "),
    ("x" * 201, "line 1"),
])  # fmt: skip
def test_a_list_that_is_refused(text: str, words: str) -> None:
    with pytest.raises(RefusedCommand, match=re.escape(words)):
        specimens_of(text, 4)


@pytest.mark.parametrize("story", [
    "touch > 30 OO 2/2 | touch > gel 1/2 | touch > gel 2/2 | touch > 70 A 1/2 | touch > 70 A 2/2 | touch > - | touch > -",
    "short > 30 OO 1/2 | keep 1 > 30 OO 2/2 | discard 1 > 30 OO 1/2",
    "touch > 30 OO 2/2 | touch > gel 1/2 | discard 2 > 30 OO 2/2 | keep 2 > gel 1/2",  # repeated at once
    "touch > 30 OO 2/2 | touch > gel 1/2 | choose 70 A > 70 A 1/2 | touch > 70 A 2/2 | discard 1 > 70 A 2/2 | touch > 30 OO 2/2",
    "choose gel > gel 1/2 | choose  > 30 OO 1/2 | choose gel > gel 1/2 | touch > gel 2/2 | touch > 70 A 1/2",
    "choose gel > gel 1/2 | touch > gel 2/2 | assign 1 30 OO > 30 OO 2/2 | assign 1  > 30 OO 1/2",
    "touch > 30 OO 2/2 | touch > gel 1/2 | more > 30 OO 3/3 | touch > gel 1/2 | choose 30 OO > 30 OO 4/4",
    "touch > 30 OO 2/2 | touch > gel 1/2 | touch > gel 2/2 | again > gel 2/2 | touch > 70 A 1/2",
    "choose gel > gel 1/2 | again > gel 1/2 | touch > gel 2/2 | discard 1 > gel 1/2",
])  # fmt: skip
def test_what_comes_next(story: str) -> None:
    """Each step, and the next specimen after it: a flag, or a discarded touch, leaves its slot to be repeated."""
    bench = Bench()
    assert bench.next == "30 OO 1/2"
    for step in story.split(" | "):
        what, _, expected = step.partition(" > ")
        bench.take(what)
        assert (bench.next or "-") == expected, step


def test_flags_decide_unless_a_calibration_accepts_them() -> None:
    about = About(accepted_flags=tuple(SHORT.flags))
    bench = Bench(
        calibration=Calibration.fit([2.0, 3.0, 4.0, 5.0], [0.18, 0.46, 1.0, 2.5], about=about)
    )
    bench.take("short")
    assert bench.plan.rows[0].kept
    bench.plan.progress.calibration = None
    bench.do("note", text="another calibration")
    [row] = bench.plan.rows
    assert (row.kept, row.why.split(":")[0] in SHORT.flags) == (False, True)
    bench.touches = [moved(GOOD, 10.0)]  # revised
    bench.plan.touch(1, bench.touches[0])
    assert bench.next == "30 OO 2/2"
    assert bench.do("discard", touch=1) == "Touch 1 is left out. Next: 30 OO."
    assert bench.plan.rows[0].why == DISCARDED


def test_a_touch_is_on_the_specimen_that_was_next_when_it_began() -> None:
    bench = Bench()
    bench.take("touch")
    bench.take("touch")
    for order, expected, following in [
        ("discard 2", "gel", "gel 2/2"),
        ("choose 70 A", "gel", "70 A 1/2"),
        ("plan", "70 A", "other 1/1"),
    ]:
        begun_s = bench.last_s + 4
        bench.last_s = begun_s + 5  # the order comes while the touch goes on
        bench.take(order)
        assert bench.plan.progress.on(begun_s) == expected
        bench.touch(begun_s, until_s=begun_s + 6)
        assert (bench.specimens[-1], bench.next) == (expected, following)


@pytest.mark.parametrize(
    ("do", "words"),
    [
        ("choose steel", "name: got 'steel', allowed: a specimen of the list: 30 OO, gel, 70 A"),
        ("assign 1 steel", "allowed: a specimen of the list"),
        ("assign 2 gel", "touch: got 2, allowed: a touch of this measurement, 1 to 1"),
        ("keep 4294967295", "touch: got 4294967295"),
        ("keep 1", "keep: touch 1 has no ratio"),
    ],
)
def test_what_is_not_there_is_refused(do: str, words: str) -> None:
    bench = Bench()
    bench.touch(10.0, SHORT, ratio=math.nan)
    before = bench.told
    with pytest.raises(RefusedCommand, match=words):
        bench.take(do)
    assert bench.told == before


def test_the_recording_gets_what_is_within_it_and_another_measurement_keeps_what_was_done() -> None:
    bench = Bench()
    bench.touch(10.0)
    bench.last_s = 18.0
    bench.do("note", text="left hand")
    bench.touch(20.0, SHORT)
    assert bench.recorder
    plan = bench.recorder.plan
    notes, touches = (
        (stored.Note(18.0, "left hand"),),
        (stored.Entry(10.0, "30 OO"), stored.Entry(20.0, "30 OO", None)),
    )
    assert plan == stored.Plan("gels", "A. B.", tuple(specimens_of(THREE, 2)), touches, notes)
    bench.recorder = Recorder(first_s=15.0)
    bench.recording_begun[0](bench.recorder)
    assert bench.recorder.plan == replace(plan, touches=plan.touches[1:])
    bench.recorder = Recorder()
    bench.begin()
    assert (bench.plan.rows, bench.told.last, bench.told.notes) == ([], None, [])
    bench.touch(1.0)
    assert [one.touch for one in bench.told.specimens[0].deviations] == [None, None, 1]
    assert [entry.start_s for entry in bench.recorder.plan.touches] == [1.0]
    assert [n for known in bench.plan.known() for n, _, _ in known.touches] == [-1, 0, 1]


def test_a_recording_without_room_is_said() -> None:
    class Full(Recorder):
        def session(self, plan: stored.Plan, *, wait: bool) -> None:
            raise ValueError("session: no room")

    bench = Bench()
    bench.recorder = Full()
    bench.touch(10.0)
    assert (bench.said, bench.next) == (["session: no room"], "30 OO 2/2")


def test_an_order_is_on_the_disk_before_its_answer_which_says_if_it_is_not() -> None:
    bench = Bench()
    assert bench.recorder
    bench.touch(10.0)
    assert not bench.recorder.waited, "the thread that measures never waits for the disk"
    assert bench.do("note", text="warm") == "Noted: warm"
    assert bench.recorder.waited
    bench.recorder.sidecar_trouble = "run.json: cannot be written: it is held"
    answer = bench.do("discard", touch=1)
    assert answer.endswith(" run.json: cannot be written: it is held."), answer


STEPS = ["touch", "short", "plan", "again", "more", *(f"{do} {n}" for do in ("discard", "keep") for n in range(1, 7)),
         *(f"{do} {name}" for do in ("choose", "assign 1", "assign 2") for name in ("30 OO", "gel", "70 A", ""))]  # fmt: skip


@given(st.lists(st.sampled_from(STEPS), max_size=25))
@examples(80)
def test_any_order_of_events_keeps_the_account(steps: list[str]) -> None:
    """A touch keeps its specimen until it is assigned; counts are those of the rows; the next one lacks touches."""
    bench = Bench()
    for step in steps:
        expected, following = bench.specimens, (bench.told.next.name if bench.told.next else None)
        with suppress(RefusedCommand):
            bench.take(step)
            if step in ("touch", "short"):
                expected.append(following)
            elif step == "again":
                expected = []
            elif step.startswith("assign"):
                expected[int(step[7]) - 1] = step[9:] or None
        assert bench.specimens == expected
        told = bench.told
        for one in told.specimens:
            assert one.kept == sum(each.kept for each in one.deviations)
        assert told.next or all(one.kept >= one.of for one in told.specimens)
    assert not bench.said


def test_what_is_changed_after_the_end_is_in_the_recording(tmp_path: Path) -> None:
    """The report and `calibrate` read the file: they must know what the page shows."""
    path = tmp_path / "run.csv"
    bench = Bench()
    assert bench.recorder
    bench.recorder.path = path
    bench.touch(1)
    document = {**sidecar.made({}, 0, b""), "session": bench.recorder.plan.as_dict()}
    (tmp_path / "run.json").write_text(sidecar.text_of(document))
    bench.recorder = None
    bench.do("assign", touch=1, name="gel")
    bench.do("discard", touch=1)
    after = sidecar.load_checked(path)
    assert after
    assert after.intact
    assert after.session.touches == (stored.Entry(1.0, "gel", "discarded"),)
    (tmp_path / "run.json").unlink()
    with pytest.raises(RecordingError, match=r"run\.json"):
        bench.do("keep", touch=1)
    bench.begin()
    bench.do("note", text="of the next measurement, without a recording")
    assert not (tmp_path / "run.json").exists()


def test_a_name_with_another_modulus_says_the_one_before() -> None:
    bench = Bench()
    bench.take("touch")
    bench.take("touch")
    named = bench.do("name", touches=[1, 2], text="30 OO; 0.2")
    assert named == "2 touches: 30 OO. Its modulus is 0.2 MPa now, before 0.143 MPa."
    assert (
        bench.do("name", touches=[1], text="gel; 0.2")
        == "1 touch: gel. Its modulus is 0.2 MPa now, before unknown."
    )
    assert bench.do("name", touches=[1], text="gel") == "1 touch: gel."
    assert [one.modulus for one in bench.told.specimens] == [0.2, 0.2, 8.68]


def test_one_specimen_is_counted_as_one() -> None:
    bench = Bench()
    assert bench.do("plan", text="gel", wanted=1) == "1 specimen, 1 touch of each."
    assert bench.do("plan", text="gel\nsteel", wanted=2) == "2 specimens, 2 touches of each."
