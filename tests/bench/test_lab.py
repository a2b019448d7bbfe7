"""The bench of a lab: its worlds, how it judges trackers that are right or wrong by design, and its stored figures."""

import json
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from palpate.flags import Flag

from bench import results_age
from bench.accuracy import lab, lab_rows, lab_scores, lab_worlds
from bench.accuracy.lab_rows import HAND, Compared, Row
from bench.accuracy.lab_scores import Limit, Measure, Outcome, Played, Share
from bench.accuracy.lab_worlds import (
    HARD,
    SOFT,
    Autoregressive,
    BaselineStep,
    Breathing,
    Drift,
    Falling,
    Fault,
    Flicker,
    Frozen,
    Jump,
    LooseWire,
    Outliers,
    Press,
    Rail,
    Session,
    StepInPress,
    Walk,
    World,
)

SEED = 3
made_session = cache(lab_worlds.make)
QUIET = replace(HAND, noise_pF=0.0)


def changes(world: World, seed: int = SEED) -> tuple[Session, np.ndarray]:
    """Return a session without noise, and the changes of both channels that a fault makes in it."""
    session = lab_worlds.make(world, seed)
    sound = lab_worlds.make(replace(world, faults=(), reading_faults=(), decimals=None), seed)
    return session, session.values - sound.values


# Worlds


@pytest.mark.parametrize("by", ["hand", "stage", "relaxing"])
@pytest.mark.parametrize("exponent", [1.0, 1.5])
@pytest.mark.parametrize("pair_s", [0.001, 0.026, 0.2192])
def test_a_press_has_the_true_ratio(by: lab_worlds.Presser, exponent: float, pair_s: float) -> None:
    # Tremor and relaxing move between both readings of a pair: only a stage is exact.
    session = lab_worlds.make(replace(QUIET, by=by, exponent=exponent, pair_s=pair_s), SEED)
    for press in session.presses:
        early_s = press.held_s + pair_s
        late_s = press.release_s - pair_s
        inside = (session.times_s > early_s) & (session.times_s < late_s)
        hard, soft = (
            session.values[row, inside[row]].mean() - session.levels[row] for row in (HARD, SOFT)
        )
        tolerance = {"hand": 0.1, "stage": 1e-12, "relaxing": 0.01}[by]
        assert hard / soft == pytest.approx(session.ratio, rel=tolerance)


def test_an_open_probe_has_its_levels() -> None:
    session = lab_worlds.make(replace(QUIET, tilt=0.05), SEED)
    idle = np.ones(session.times_s.shape, bool)
    for press in session.presses:
        idle &= (session.times_s < press.contact_s - 0.01) | (session.times_s > press.end_s + 0.01)
    levels = np.broadcast_to(session.levels[:, np.newaxis], idle.shape)
    np.testing.assert_array_equal(session.values[idle], levels[idle])
    assert idle.mean() > 0.4


def test_a_tilt_makes_the_hard_bump_deeper() -> None:
    world = replace(QUIET, by="stage", tilt=0.02)
    session = lab_worlds.make(world, SEED)
    press = session.presses[0]
    middle = np.argmin(abs(session.times_s - (press.held_s + press.release_s) / 2), axis=1)
    hard, soft = session.values[(HARD, SOFT), middle] - session.levels
    assert hard == pytest.approx(session.ratio * press.depth_pF * 1.01)
    assert soft == pytest.approx(press.depth_pF * 0.99)


def test_soft_is_read_half_a_pair_after_hard() -> None:
    session = lab_worlds.make(HAND, SEED)
    np.testing.assert_allclose(session.times_s[SOFT] - session.times_s[HARD], 0.013)


@pytest.mark.parametrize("pair_s", [0.001, 0.026, 0.124, 0.2192])
def test_a_conversion_is_a_mean(pair_s: float) -> None:
    random = np.random.default_rng(SEED)
    press = Press(1.0, 1.3, 3.0, 3.3, 0.25)
    hand = lab_worlds.Hand(HAND, press, 2.0, random)
    times = np.arange(1.5, 2.8, 0.0371)
    length_s = 0.42 * pair_s
    fine = length_s * (np.arange(400) + 0.5) / 400 - length_s / 2
    exact = [hand.forces(time_s + fine, HARD).mean() for time_s in times]
    found = lab_worlds.converted([hand], [press], times, HARD, length_s)
    np.testing.assert_allclose(found, exact, rtol=3e-5)


def test_lines_have_their_band_and_size() -> None:
    lines = lab_worlds.lines(np.random.default_rng(SEED), 3.0, 12.0, 24)
    values = lines(np.linspace(0, 400, 100_000, endpoint=False))
    assert values.std() == pytest.approx(1.0, rel=0.02)
    spectrum = abs(np.fft.rfft(values)) ** 2
    f = np.fft.rfftfreq(len(values), 0.004)
    assert spectrum[(f > 2.9) & (f < 12.1)].sum() > 0.999 * spectrum[1:].sum()


def test_a_seed_is_a_hand_whatever_its_faults() -> None:
    one = lab_worlds.make(HAND, 1)
    same = lab_worlds.make(HAND, 1)
    faulty = lab_worlds.make(replace(HAND, faults=(Walk(),)), 1)
    np.testing.assert_array_equal(one.values, same.values)
    assert one.presses == faulty.presses
    assert one.ratio == faulty.ratio != lab_worlds.make(HAND, 2).ratio


def test_decimals() -> None:
    values = lab_worlds.make(replace(HAND, decimals=3), SEED).values
    np.testing.assert_array_equal(values, np.round(values, 3))


# Faults


@pytest.mark.parametrize(
    "fault",
    [LooseWire("hard", 0.2), Outliers("hard", 0.2, 0.05), Rail("hard"), Frozen("hard", 0.0), Jump("hard", 0.1, 1),
     StepInPress("hard", 0.1, "hold"), BaselineStep("hard", 0.01, "contact"), Falling(), Breathing(), Walk(), Flicker(),
     Autoregressive(), Drift(1e-3)],
    ids=lambda fault: type(fault).__name__,
)  # fmt: skip
def test_a_fault_changes_its_channels(fault: Fault) -> None:
    world = replace(QUIET, faults=(fault,))
    _, change = changes(world)
    changed = {name for name, row in (("hard", HARD), ("soft", SOFT)) if change[row].any()}
    assert changed == world.faulty
    assert np.isfinite(change).all()


@pytest.mark.parametrize("longest", [1, 3])
def test_a_loose_wire_falls_to_the_baseline(longest: int) -> None:
    shares = []
    for seed in range(20):
        session, change = changes(replace(QUIET, reading_faults=(LooseWire("soft", 0.2, longest),)), seed)  # fmt: skip
        t = session.times_s[SOFT]
        press = session.presses[0]
        inside = (t > press.held_s) & (t < press.release_s)
        fallen = inside & (change[SOFT] != 0)
        assert set(session.values[SOFT, fallen].tolist()) == {session.levels[SOFT]}
        shares.append(fallen.sum() / inside.sum())
    # bursts that overlap make it less: 1 - .9^(1 + 2/3 + 1/3) = .19
    assert np.mean(shares) == pytest.approx(0.2, abs=0.03)


def test_a_rail_is_reached_by_each_press() -> None:
    for seed in range(10):
        session, _ = changes(replace(QUIET, reading_faults=(Rail("soft", at=4.096),)), seed)
        assert session.values[SOFT].max() == 4.096
        for press in session.presses:
            inside = abs(session.times_s[SOFT] - (press.contact_s + press.end_s) / 2) < 0.5
            assert (session.values[SOFT, inside] == 4.096).mean() > 0.6


def test_a_rail_may_toggle() -> None:
    session = lab_worlds.make(replace(QUIET, decimals=4, reading_faults=(Rail("hard", 1.0, 1e-4),)), SEED)  # fmt: skip
    beyond = session.values[HARD][session.values[HARD] >= 1.0]
    assert set(beyond.tolist()) == {1.0, 1.0001}


@pytest.mark.parametrize("channel", ["hard", "soft", "both"])
def test_a_jump_is_at_rest(channel: lab_worlds.Channel) -> None:
    for seed in range(10):
        session, change = changes(replace(QUIET, faults=(Jump(channel, 0.3, 1),)), seed)
        row = SOFT if channel == "soft" else HARD
        moving = session.times_s[row][(change[row] != 0) & (change[row] < 0.2999)]
        first = session.times_s[row][np.flatnonzero(change[row])[0]]
        assert change[row, -1] == pytest.approx(0.3)
        assert session.presses[1].end_s < first < session.presses[2].contact_s
        assert not len(moving) or moving[-1] - first < 0.1
        if channel == "both":
            assert change[SOFT, -1] == pytest.approx(0.21)


@pytest.mark.parametrize("part", ["rise", "hold", "fall"])
def test_a_step_is_in_its_part(part: lab_worlds.Part) -> None:
    for seed in range(10):
        session, change = changes(replace(QUIET, faults=(StepInPress("soft", -0.1, part),)), seed)
        press = session.presses[1]
        begin_s, end_s = {
            "rise": (press.contact_s, press.held_s),
            "hold": (press.held_s, press.release_s),
            "fall": (press.release_s, press.end_s),
        }[part]
        at_s = session.times_s[SOFT][np.flatnonzero(change[SOFT])[0]]
        assert begin_s < at_s < end_s + session.pair_s
        assert change[SOFT, -1] == pytest.approx(-0.1)


@pytest.mark.parametrize(
    ("when", "held"), [("contact", (1.0, 1.0)), ("release", (0.0, 0.0)), ("evenly", (0.0, 1.0))]
)
def test_a_baseline_moves_in_each_press(when: lab_worlds.Moment, held: tuple[float, float]) -> None:
    session, change = changes(replace(QUIET, faults=(BaselineStep("hard", 0.01, when),)))
    before = 0.0
    for press in session.presses:
        t = session.times_s[HARD]
        inside = change[HARD][(t > press.held_s) & (t < press.release_s)] - before
        after = change[HARD][t > press.end_s][0]
        assert abs(after - before) == pytest.approx(0.01)
        shares = inside / (after - before)
        assert held[0] - 1e-9 <= shares.min() <= shares.max() <= held[1] + 1e-9
        before = after


@pytest.mark.parametrize(
    ("fault", "size", "relative"),
    [(Breathing(), 1e-3, 1e-2), (Autoregressive(), 4e-5 / math.sqrt(1 - 0.81), 0.1), (Flicker(), 1.15e-4 * math.sqrt(math.log(50 / 0.026 )), 0.25)],
    ids=["breathing", "AR", "flicker"],
)  # fmt: skip
def test_slow_noise_has_its_size(fault: Fault, size: float, relative: float) -> None:
    world = replace(QUIET, presses=20, faults=(fault,))
    found = []
    for seed in range(5):
        change = changes(world, seed)[1]
        amplitudes = abs(change).max(axis=1) if isinstance(fault, Breathing) else change.std(axis=1)
        found.append(amplitudes.max() if isinstance(fault, Breathing) else amplitudes.mean())
    assert np.mean(found) == pytest.approx(size, rel=relative)


def test_a_walk_grows_with_the_root_of_time() -> None:
    steps = np.concatenate(
        [np.diff(changes(replace(QUIET, faults=(Walk(),)), seed)[1]).ravel() for seed in range(3)]
    )
    assert steps.std() == pytest.approx(2e-4 * math.sqrt(0.026), rel=0.03)


# How it judges


@dataclass
class Judged:
    """A judgement, as a tracker makes it."""

    time_s: float
    name: str
    channel: str


@dataclass
class MadeTouch:
    """What the bench reads of a touch."""

    start_s: float
    ratio: float
    standard_error: float
    flags: tuple[Flag, ...] = ()
    samples: int = 10
    age_s: float = 0.0
    revised: bool = True


@dataclass
class MadeTracker:
    """A tracker that has taken a session."""

    touches: list[MadeTouch]
    judgements: list[Judged] = field(default_factory=list)


Maker = Callable[[Session], MadeTracker]


def right(session: Session) -> MadeTracker:
    """Know the truth, to half a standard error of 0.01 %, but for one touch in twenty."""
    touches = []
    for number, press in enumerate(session.presses):
        error = 2e-4 if (number + round(1e6 * session.ratio)) % 20 == 0 else 5e-5
        touches.append(
            MadeTouch(press.contact_s, session.ratio * (1 + error), 1e-4 * session.ratio)
        )
    return MadeTracker(touches)


def naming(*names: str) -> Maker:
    """Return a tracker that is right, and has a judgement of each name on each press."""

    def made(session: Session) -> MadeTracker:
        tracker = right(session)
        tracker.judgements = [
            Judged(press.held_s, name, channel)
            for press in session.presses
            for name in names
            for channel in ("hard", "soft")
        ]
        return tracker

    return made


def biased(session: Session) -> MadeTracker:
    tracker = right(session)
    tracker.touches = [replace(touch, ratio=1.06 * touch.ratio) for touch in tracker.touches]
    return tracker


def vague(session: Session) -> MadeTracker:
    """Know no error."""
    tracker = right(session)
    tracker.touches = [replace(touch, standard_error=math.nan) for touch in tracker.touches]
    return tracker


def nervous(session: Session) -> MadeTracker:
    tracker = right(session)
    tracker.touches = [replace(touch, flags=(Flag.SATURATED,)) for touch in tracker.touches]
    return tracker


def blind(session: Session) -> MadeTracker:
    return MadeTracker(right(session).touches[::2])


@pytest.fixture
def judge(monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[[Maker, str], list[str]]]:
    """Return a function: the titles of the rows of a pattern that fail with a made tracker."""

    def failing(maker: Maker, pattern: str) -> list[str]:
        lab_scores.played.cache_clear()
        monkeypatch.setattr(lab_scores, "taken", maker)
        monkeypatch.setattr(lab_scores, "make", made_session)
        found = [
            lab.measured(row, 2) for theme in lab_rows.THEMES for row in lab.rows_of(theme, pattern)
        ]
        assert found
        assert lab.any_fails(found) == any(result.broken for result in found)
        return [result.row.title for result in found if result.broken]

    yield failing
    lab_scores.played.cache_clear()


@pytest.mark.parametrize(
    ("maker", "pattern"),
    [
        (right, "^(readings|baseline|slow noise|slow pairs|healthy)|saturated: healthy"),
        (naming("saturated"), "^frozen|^saturated: (?!healthy)"),
        (naming("falling"), "^falling"),
        (naming("jumped"), "^jump"),
        (naming("step"), "^step"),
    ],
)
def test_a_tracker_that_knows_the_truth_holds(
    judge: Callable[[Maker, str], list[str]], maker: Maker, pattern: str
) -> None:
    assert judge(maker, pattern) == []


@pytest.mark.parametrize(
    ("maker", "pattern"),
    [
        (biased, "^(readings|step|jump|falling)"),
        (biased, "^healthy: (?!tilted)"),
        (biased, "^(slow pairs|slow noise)|^baseline.*steps"),
        (vague, "^healthy: (?!tilted)"),
        (vague, "^(readings|slow pairs|slow noise)|^baseline.*steps"),
        (nervous, "^healthy|^saturated: healthy: (hand|stage|relaxing)"),
        (blind, "^(readings|baseline|slow|healthy|jump)"),
        (right, "^(frozen|falling|jump)|^step.*hold|^saturated: (?!healthy)"),
        (naming("step"), "^(frozen|falling|jump)|^saturated: (?!healthy)"),
    ],
)
def test_a_planted_fault_fails(
    judge: Callable[[Maker, str], list[str]], maker: Maker, pattern: str
) -> None:
    rows = [row.title for theme in lab_rows.THEMES for row in lab.rows_of(theme, pattern)]
    assert judge(maker, pattern) == rows


SESSION = Session(
    np.zeros((2, 0)), np.zeros((2, 0)), np.zeros(2), 2.0,
    [Press(10.0, 10.3, 12.0, 12.3, 0.25), Press(20.0, 20.3, 22.0, 22.3, 0.25)], 0.026,
)  # fmt: skip


def played(touches: Sequence[MadeTouch], judgements: Sequence[Judged] = ()) -> Played:
    """Return how a session with two presses, at 10 and at 20 s, is judged."""
    tracker: object = MadeTracker(list(touches), list(judgements))
    return lab_scores.judged(SESSION, frozenset({"hard"}), tracker)  # type: ignore[arg-type]


def test_a_touch_belongs_to_the_press_in_which_it_begins() -> None:
    found = played([MadeTouch(9.8, 2.0, 0.01), MadeTouch(21.0, 2.0, 0.01)])
    assert [outcome.found for outcome in found.presses] == [True, True]
    assert not found.phantoms


def test_the_longest_touch_of_a_press_counts() -> None:
    found = played([MadeTouch(10.1, 2.0, 0.01, samples=20), MadeTouch(10.9, 3.0, 0.01, samples=90)])
    assert found.presses[0].error == pytest.approx(0.5)


@pytest.mark.parametrize(
    ("ratio", "samples", "lost"), [(2.01, 200, 1), (2.5, 200, 2), (2.01, 100, 2)]
)
def test_an_early_touch_counts_if_it_lasts_and_is_right(
    ratio: float, samples: int, lost: int
) -> None:
    found = played([MadeTouch(6.0, ratio, 0.01, samples=samples)])
    assert found.lost == lost
    assert len(found.phantoms) == lost - 1


def test_a_touch_without_a_press_is_silent_unless_something_says_so() -> None:
    touch = MadeTouch(15.0, 1.0, 0.01)
    for judgements, silent in (((), 1), ((Judged(15.2, "jumped", "hard"),), 0)):
        found = played([touch], judgements)
        assert lab_scores.summary_of([found]).shares[Measure.SILENT] == Share(silent, 2)


@pytest.mark.parametrize(
    ("judgement", "named"),
    [
        (Judged(9.8, "step", "hard"), [True, False]),
        (Judged(13.0, "step", "hard"), [True, False]),
        (Judged(15.0, "step", "hard"), [False, False]),
        (Judged(1.0, "saturated", "hard"), [True, True]),  # a state lasts
        (Judged(15.0, "saturated", "hard"), [False, True]),
    ],
)
def test_a_judgement_names_the_touch_that_it_is_about(judgement: Judged, named: list[bool]) -> None:
    found = played([MadeTouch(10, 3.0, 0.01), MadeTouch(20, 3.0, 0.01)], [judgement])
    assert [bool(outcome.judgements) for outcome in found.presses] == named
    assert [outcome.silent for outcome in found.presses] == [not name for name in named]


@pytest.mark.parametrize(("channel", "said"), [("hard", True), ("both", True), ("soft", False)])
def test_a_judgement_must_be_of_the_channel_with_the_fault(channel: str, said: bool) -> None:
    found = played([], [Judged(15.0, "jumped", channel)])
    share = lab_scores.summary_of([found], frozenset({"jumped"})).shares[Measure.SAID]
    assert share == Share(int(said), 1)


@pytest.mark.parametrize(
    ("outcome", "silent", "covered"),
    [
        (Outcome(True, 0.01, 0.01), False, True),
        (Outcome(True, 0.03, 0.01), False, False),
        (Outcome(True, -0.041, 0.01), True, False),
        (Outcome(True, -0.06, 0.05), True, True),
        (Outcome(True, 0.06, math.nan), True, False),
        (Outcome(True, 0.04, math.nan), False, False),
        (Outcome(True, 0.5, 0.01, excluded=True), False, False),
        (Outcome(True, 0.5, 0.01, flags=frozenset({"tilt"})), True, False),  # it does not exclude
        (Outcome(True, 0.5, 0.01, judgements=frozenset({"step"})), False, False),
        (Outcome(False), False, False),
    ],
)
def test_silent_and_covered(outcome: Outcome, silent: bool, covered: bool) -> None:
    assert outcome.silent == silent
    assert outcome.covered == covered


@pytest.mark.parametrize(
    ("limit", "share", "holds", "text"),
    [
        (Limit(Measure.COVERED, low=0.8), Share(76, 100), True, "covered >= 80 %"),
        (Limit(Measure.COVERED, low=0.8), Share(71, 100), False, "covered >= 80 %"),
        (Limit(Measure.COVERED, low=0.8), Share(0, 0), False, "covered >= 80 %"),
        (Limit(Measure.FLAGGED, high=0.002), Share(1, 100), True, "flagged <= 0.2 %"),
        (Limit(Measure.FLAGGED, high=0.002), Share(2, 100), False, "flagged <= 0.2 %"),
        (Limit(Measure.LOST, high=0.0), Share(1, 1000), False, "none lost"),
        (Limit(Measure.NOTED, low=1.0), Share(999, 1000), False, "all noted"),
        (Limit(Measure.COVERED, 0.92, 0.98), Share(1000, 1000), False, "covered 92-98 %"),
    ],
)
def test_limits(limit: Limit, share: Share, holds: bool, text: str) -> None:
    summary = replace(lab_scores.summary_of([played([])]), shares={limit.measure: share})
    assert limit.holds(summary) == holds
    assert str(limit) == text


# The table


def all_rows() -> list[Row]:
    return [row for theme in lab_rows.THEMES for row in lab.rows_of(theme, "")]


def test_titles_are_unique_and_known_ones_exist() -> None:
    titles = [row.title for row in all_rows()]
    assert len(set(titles)) == len(titles)
    assert lab_rows.KNOWN.keys() <= {*titles, "price"}


def test_a_row_with_a_reason_is_known(monkeypatch: pytest.MonkeyPatch) -> None:
    row = Row("theme", "name", (HAND,), (Limit(Measure.LOST, low=1.0),))
    result = lab.measured(row, 1)
    assert str(result).startswith("FAILS theme: name")
    assert "broken: all lost" in str(result)
    monkeypatch.setitem(lab_rows.KNOWN, row.title, "Why.")
    assert str(result).startswith("known theme: name")
    assert str(result).endswith("\n      Why.")
    assert not lab.any_fails([result])


def test_growth_is_of_the_same_sessions() -> None:
    before = [[(1.0, 2.0), (1.0, 2.0)], [(10.0, 1.0)]]
    now = [[(1.1, 4.0), (1.1, 4.0), (9.0, 9.0)], [(11.0, 2.0), (9.0, 9.0)]]
    assert lab.growth_of(now, before) == pytest.approx((1.1, 2.0))
    assert lab.growth_of([[(math.nan, math.nan)]], [[(1.0, 1.0)]]) == (1.0, 1.0)


@pytest.mark.parametrize(("error", "width", "broken"), [(1.0, 1.0, 0), (1.1, 1.0, 1), (1.0, 1.3, 1)])  # fmt: skip
def test_what_grows_fails(error: float, width: float, broken: int) -> None:
    row = Row("theme", "name", (HAND,), (), compared=Compared(1.03, 1.1))
    now = lab.measured(row, 2)
    old = [[(a / error, b / width) for a, b in world] for world in now.worlds]
    assert len(replace(now, before=lab.Stored("", old)).broken) == broken


def test_figures_of_other_worlds_are_refused() -> None:
    row = Row("theme", "name", (HAND,), (), compared=Compared(1.03, 1.1))
    result = replace(lab.measured(row, 1), before=lab.Stored("", []))
    with pytest.raises(ValueError, match=r"lab\.json has other worlds of 'theme: name'"):
        str(result)


def test_figures_are_stored_and_read(tmp_path: Path) -> None:
    row = Row("theme", "name", (HAND,), (), compared=Compared(1.03, 1.1))
    result = lab.measured(row, 2)
    lab.store([result], lab.Price((10.0, 12.0), (25.0, 30.0)), 2, tmp_path / "lab.json")
    rows, price = lab.load(tmp_path / "lab.json")
    assert price == 2.5
    assert rows[row.title].text == result.text
    np.testing.assert_allclose(rows[row.title].worlds, result.worlds, rtol=1e-3)
    assert lab.load(tmp_path / "none.json") == ({}, None)


def test_the_stored_figures_are_of_these_rows() -> None:
    stored, price = lab.load()
    assert price is not None
    for row in all_rows():
        assert row.title in stored, f"{row.title}: store again"
        if row.compared is not None:
            assert len(stored[row.title].worlds) == len(row.worlds), f"{row.title}: store again"
    assert json.loads(lab.STORE.read_text(encoding="utf-8"))["kept"]


@pytest.mark.parametrize(("kept", "code"), [(True, 0), (False, 1)])
def test_kept_figures_may_be_old(tmp_path: Path, kept: bool, code: int) -> None:
    document = {"kept": kept, "headers": "of other headers"}
    (tmp_path / "lab.json").write_text(json.dumps(document), encoding="utf-8")
    assert results_age.main(tmp_path) == code


@pytest.mark.parametrize(
    ("now", "verdict"), [(19.9 * lab.PRICE, "holds"), (20.1 * lab.PRICE, "FAILS")]
)
def test_the_price_is_compared(now: float, verdict: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delitem(lab_rows.KNOWN, "price")
    price = lab.Price((10.0, 12.0), (now, 30.0), before=2.0)
    assert price.verdict == verdict
    assert f"ratio of minima {now / 10:.2f} (2.00 before)" in str(price)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--seeds", "0"], "--seeds is 0; give 1 or more"),
        (["--rows", "no such"], "no row has 'no such' in its title"),
        (["--rows", "(step"], "'(step' is no regular expression: missing ), unterminated"),
        (["--rows", "step", "--store"], "--store keeps all rows; leave --rows out"),
    ],
)
def test_bad_arguments_are_refused(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    arguments: list[str],
    message: str,
) -> None:
    monkeypatch.setattr("sys.argv", ["lab", *arguments])
    with pytest.raises(SystemExit, match="2"):
        lab.main()
    assert message in capsys.readouterr().err


def test_healthy_presses_hold() -> None:
    stored, _ = lab.load()
    results = lab.results_of("healthy", "healthy: (hand|domes|stage$|relaxing)", 4, stored)
    assert len(results) >= 8
    assert [str(result) for result in results if result.broken] == []


def test_a_price_is_measured() -> None:
    found = lab.price(None)
    assert 0 < found.paper[0] <= found.paper[1]
    assert 0 < found.handheld[0] <= found.handheld[1]
