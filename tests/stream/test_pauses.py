"""The computer sleeps, the program stands still, the wall clock is set: each is said, and no baseline is from before."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import palpate
import pytest
from command_lines import document, run
from palpate import check
from palpate.clocks import ClockWatch, Pause, on_monotonic, read_clocks
from palpate.recording.reading import recorded
from palpate.recording.sidecar import load
from palpate.samples import memory_s
from palpate.stream.pauses import PauseGaps, clock_set
from recording_bench import Scripted, measured, sample

from bench.soak import pauses

PERIOD_S = 0.026


def watch_of(computer: pauses.Computer) -> ClockWatch:
    return ClockWatch(computer.read)


@pytest.mark.parametrize(
    ("kind", "expected"),
    [
        ("sleep", (3600, 0, 0)),
        ("stop", (0, 30, 0)),
        ("clock-set", (0, 0, 3600)),
        ("", (0, 0, 0)),
    ],
)
def test_three_clocks_say_what_happened_once(kind: str, expected: tuple[float, ...]) -> None:
    computer = pauses.Computer()
    watch = watch_of(computer)
    computer.go_on(PERIOD_S)
    computer.pause(kind)
    found = watch.passed()
    assert found[:3] == pytest.approx(expected, abs=2 * PERIOD_S)
    assert found.since_s == pytest.approx(computer.fine_s)
    computer.go_on(PERIOD_S)
    assert watch.passed()._asdict() == pytest.approx(Pause(since_s=PERIOD_S)._asdict())


def test_what_happens_together_is_told_apart() -> None:
    computer = pauses.Computer()
    watch = watch_of(computer)
    for kind in ("sleep", "stop", "clock-set"):
        computer.pause(kind)
        watch.look()
    assert watch.passed()[:3] == (3600, 30, 3600)


def test_a_source_that_is_silent_is_no_program_that_stands_still() -> None:
    computer = pauses.Computer()
    watch = watch_of(computer)
    for _ in range(120):
        computer.go_on(0.25)
        watch.look()
    assert watch.passed()._asdict() == pytest.approx(Pause(since_s=30)._asdict())


def test_a_clock_that_ntp_slews_was_not_set() -> None:
    computer = pauses.Computer()
    watch = watch_of(computer)
    for passed_s in (*[0.25] * 4000, 1000.0):  # the last one was a sleep
        computer.go_on(passed_s)
        computer.utc_s += passed_s * 0.0004
        watch.look()
    assert watch.passed().set_s == 0
    computer.utc_s -= 0.2
    assert watch.passed().set_s == pytest.approx(-0.2)


def test_the_clocks_of_this_computer() -> None:
    before = read_clocks()
    after = read_clocks()
    assert all(b <= a for b, a in zip(before[:2], after[:2], strict=True))
    assert on_monotonic(before.fine_ns) == pytest.approx(before.awake_ns, abs=10**9)
    assert before.utc_ns > 1_700_000_000 * 10**9


SLEPT = Pause(slept_s=3600.0)
STOOD = Pause(stood_s=30.0)
IN_TIME = Pause(since_s=PERIOD_S)
AT_ONCE = Pause(since_s=1e-4)


@pytest.mark.parametrize(
    ("items", "gaps"),
    [
        ([(SLEPT, 3600.0), (IN_TIME, PERIOD_S)], [0]),
        ([(SLEPT, PERIOD_S), (IN_TIME, PERIOD_S)], [0]),  # times that stand still
        ([(STOOD, 30.0), (IN_TIME, PERIOD_S)], [0]),
        ([(STOOD, PERIOD_S), (IN_TIME, PERIOD_S)], []),  # all samples had waited
        ([(STOOD, 30.0), (AT_ONCE, 0.0), (IN_TIME, PERIOD_S)], [0, 2]),
        ([(STOOD, PERIOD_S), (AT_ONCE, PERIOD_S), (AT_ONCE, 29.0), (IN_TIME, PERIOD_S)], [2, 3]),
        ([(Pause(stood_s=1.1), 1.1)], []),
        ([(Pause(slept_s=1.0), 1.0)], []),
        ([(IN_TIME, 30.0)], []),  # the source says why, if it knows
        ([(Pause(set_s=3600.0), PERIOD_S), (IN_TIME, PERIOD_S)], [0]),  # maybe a virtual machine
        ([(Pause(set_s=-3600.0), PERIOD_S)], []),
        ([(Pause(set_s=1.0), PERIOD_S)], []),
    ],
)
def test_where_a_pause_is_a_gap(items: list[tuple[Pause, float]], gaps: list[int]) -> None:
    found = PauseGaps()
    given = [found.gap(pause, 1, hole_s, PERIOD_S) for pause, hole_s in items]
    assert [place for place, gap in enumerate(given) if gap] == gaps


def test_a_slow_converter_has_a_longer_memory() -> None:
    assert memory_s(PERIOD_S) == pytest.approx(64 * PERIOD_S)
    assert memory_s(0.0) == memory_s(0.001) == 64 * 0.025
    assert PauseGaps().gap(STOOD, 1, 30.0, 0.5) is None


@pytest.mark.parametrize("name", pauses.SOURCES)
@pytest.mark.parametrize("kind", ["sleep", "stop", "clock-set"])
def test_no_touch_where_there_is_none_and_the_next_one_is_right(kind: str, name: str) -> None:
    """The table of the bench, of one run."""
    outcome = pauses.measure(kind, name, 1)
    assert (outcome.phantoms, outcome.right) == (0, 1)


def test_without_the_clocks_an_hour_is_a_touch() -> None:
    outcome = pauses.measure("sleep", pauses.STANDING, 1, with_clocks=False)
    assert (outcome.phantoms, outcome.right) == (1, 0)


WORDS = {
    "sleep:3600@9.8": "the computer slept for 1 h 0 min",
    "clock-set:3600@9.8": "the wall clock was set by +1 h 0 min (or this is a virtual machine that was paused)",
    "stop:30@9.8": "the program stood still for 30.0 s (stopped, or the computer was too busy)",
}


@pytest.mark.parametrize("fault", WORDS)
def test_terminal_replay_check_and_report_say_the_cause(fault: str, tmp_path: Path) -> None:
    text = WORDS[fault]
    path = tmp_path / "run.csv"
    uri = f"sim:four-specimens?seed=1&fault={fault}"
    done = run("record", uri, "-o", path, "--touches", "2")
    assert done.exit_code == 0
    assert f"{text}: the baseline is measured again: touch nothing" in done.stderr
    told = f": {text}: the baseline was measured again"
    [finding] = [finding for finding in check(path).findings if told in finding]
    assert check(path).survey.period_s == pytest.approx(0.0313, rel=0.02)  # not with the pause
    assert finding in document("replay", path)["notes"]
    page = tmp_path / "report.html"
    run("report", path, "-o", page)
    assert text in page.read_text(encoding="utf-8")
    times = palpate.read(path).t_hard_s  # the CSV alone shows a pause, too
    assert (max(times[1:] - times[:-1]) > 29) == ("clock" not in fault)


def test_a_wall_clock_that_is_set_back_is_a_mark_and_no_gap(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    messages = list[str]()
    uri = "sim:four-specimens?seed=1"
    stream = measured(f"{uri}&fault=clock-set:-60@4", record=path, notify=messages.append)
    text = "the wall clock was set by -60.0 s: that changes no sample, and no time of a sample"
    assert messages == [text]
    [mark] = (load(path) or {})["marks"]
    assert mark == {"seq": mark["seq"], "t_s": pytest.approx(4, abs=0.1), "text": text}
    assert stream.touches == measured(uri).touches
    assert recorded(path).gap_marks == []


def test_a_pause_in_contact_cuts_the_touch(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    uri = "sim:four-specimens?seed=1&fault=sleep:3600@13"
    stream = measured(uri, record=path)
    found = [("gap" in touch.flags, touch.start_s > 3600) for touch in stream.touches]
    assert found == [(False, False), (True, False), (False, True), (False, True)]
    assert palpate.touches(recorded(path)) == stream.touches


def test_a_gap_of_the_source_at_a_pause_is_said_with_it(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    measured("sim:four-specimens?seed=1&fault=sleep:3600@9.8,unplug:2@9.8", record=path)
    [mark] = recorded(path).gap_marks
    slept, _, unplugged = mark.text.partition("; ")
    assert slept == "the computer slept for 1 h 0 min"
    assert unplugged.startswith("the board was unplugged for ")


class Slept(Scripted):
    """Samples of a source in real time, on a computer that sleeps before sample 50."""

    def __init__(self, computer: pauses.Computer) -> None:
        super().__init__([sample(seq) for seq in range(100)], live=True)
        self.clocks = ClockWatch(computer.read)
        self.computer = computer

    def samples(self) -> Iterator[Any]:
        """Yield the samples."""
        for each in self.script:
            self.computer.go_on(PERIOD_S)
            if each.seq == 50:
                self.computer.pause("sleep")
            yield each


def test_the_time_of_day_stays_right_after_a_sleep(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The clock of the samples counts on; `time.monotonic_ns` does not in Linux."""
    computer = pauses.Computer()
    monkeypatch.setattr(
        "palpate.stream.reader.ahead_of_monotonic_ns",
        lambda: round(1e9 * (computer.fine_s - computer.awake_s)),
    )
    monkeypatch.setattr("palpate.stream.reader.time.monotonic_ns", lambda: 5 * 10**9)
    with palpate.Stream(Slept(computer)) as stream:
        for _ in stream.batches():
            pass
        assert stream.epoch is not None
        first_ns = sample(0).t_hard_ns
        begun_ns = 5 * 10**9 - max(first_ns, sample(0).t_soft_ns)
        assert stream.epoch.monotonic_ns == begun_ns - 3600 * 10**9


def test_clock_set_says_both_directions() -> None:
    assert clock_set(3600).startswith("the wall clock was set by +1 h 0 min: ")
    assert clock_set(-0.5).startswith("the wall clock was set by -0.5 s: ")


def test_readings_in_which_the_program_stood_still_are_read_again(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    times = iter([0, 30 * 10**9, 30 * 10**9, 30 * 10**9 + 1])
    monkeypatch.setattr("palpate.clocks.fine_ns", lambda: next(times))
    assert read_clocks()[1] == 30 * 10**9
