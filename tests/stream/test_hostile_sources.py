"""Sources that lie: nothing is counted that cannot be kept, every lie ends in a documented error, and nothing is left running."""

import math
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from hostile import Liar, Mute, bad, good, unusual
from palpate import ProtocolError, Sample, SourceTimeout, Stream, check
from palpate.recording.foreign import recorded
from palpate.stream import StreamCounters, instrument
from recording_bench import sample

NEXT = sample(3)


@pytest.fixture(autouse=True)
def nothing_left_running() -> Iterator[None]:
    """Every thread of the stream has ended soon after."""
    yield
    until = time.monotonic() + 30
    while (
        left := [t.name for t in threading.enumerate() if t.name.startswith("palpate")]
    ) and time.monotonic() < until:
        time.sleep(0.01)
    assert left == []


def assert_they_add_up(counters: StreamCounters, *, recorded: bool = True) -> None:
    assert counters.read == counters.delivered + counters.dropped
    assert counters.waiting == 0
    if recorded:
        assert counters.read == counters.recorded + counters.unrecorded
    assert {type(value) for value in counters.as_dict().values()} == {int}


@pytest.mark.parametrize("live", [False, True])
@pytest.mark.parametrize("name", bad(NEXT))
def test_what_cannot_be_kept_is_refused_before_it_is_counted(name: str, live: bool, tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    with (
        pytest.raises(ProtocolError, match=r"^source, after seq 1: .*got .*, allowed: ") as caught,
        Stream(Liar([*good(2), bad(NEXT)[name], *good(2, 4)], live=live), record=path) as stream,
    ):
        list(stream)
    assert len(str(caught.value)) < 250
    assert (stream.counters.read, stream.counters.recorded, stream.counters.lost) == (2, 2, 0)
    assert_they_add_up(stream.counters)
    report = check(path)
    assert report.clean
    assert report.findings == (f"the source ended with an error: {caught.value}",)
    with pytest.raises(ProtocolError, match=r"^source, first sample: "), Stream(Liar([bad(NEXT)[name]])) as stream:
        list(stream)
    assert stream.counters == StreamCounters()


@pytest.mark.parametrize("seq", [1, 0])
def test_a_source_that_counts_backwards(seq: int, tmp_path: Path) -> None:
    source = Liar([*good(2), sample(2)._replace(seq=seq)])
    with (
        pytest.raises(ProtocolError, match=f"source: seq: got {seq}, allowed: above 1"),
        Stream(source, record=tmp_path / "run.csv") as stream,
    ):
        list(stream)
    assert stream.counters.recorded == 2
    assert_they_add_up(stream.counters)


@pytest.mark.parametrize("name", unusual(NEXT))
def test_what_can_be_kept_is_kept_as_plain_numbers(name: str, tmp_path: Path) -> None:
    given = Sample(*tuple.__iter__(unusual(NEXT)[name]))
    with Stream(Liar([*good(2), unusual(NEXT)[name], sample(9)]), record=tmp_path / "run.csv") as stream:
        seen = [estimate.sample for estimate in stream]
        stream.mark("here")
    assert seen == [*good(2), given, sample(9)]
    assert [type(field) for field in seen[2]] == [int] * 5 + [float] * 2 + [int] * 2
    assert stream.counters.lost == 1 + 5
    assert_they_add_up(stream.counters)
    assert check(tmp_path / "run.csv").survey.rows == 4
    assert len(recorded(tmp_path / "run.csv").document["marks"]) == 1  # type: ignore[index]


LOOP: dict[str, Any] = {"name": "loop"}
LOOP["inner"] = LOOP
DEEP: list[Any] = []
for _ in range(10**5):
    DEEP = [DEEP]
DESCRIPTIONS: dict[str, tuple[Any, str]] = {
    "list": (["name"], r"describe\(\): got \['name'\], allowed: a dict"),
    "None": (None, r"describe\(\): got None, allowed: a dict"),
    "loop": (LOOP, "cannot be stored in a recording: Circular"),
    "depth": ({"deep": DEEP}, "cannot be stored in a recording: "),
    "key": ({("a", "b"): 1}, "cannot be stored in a recording: keys must be"),
    "long": ({"notes": "a" * 10**6}, "got '1000013 characters of JSON', allowed: 100000 at most"),
    "no text": ({"name": Mute()}, "cannot be stored in a recording"),
    "period nan": ({"period_s": math.nan}, "period_s: got nan, allowed: a number above 0, s"),
    "period 0": ({"period_s": 0}, "period_s: got 0, allowed"),
    "period below 0": ({"period_s": -0.026}, "period_s: got -0.026, allowed"),
    "period inf": ({"period_s": math.inf}, "period_s: got inf, allowed"),
    "period text": ({"period_s": "0.026"}, "period_s: got '0.026', allowed"),
    "period huge": ({"period_s": 10**400}, "period_s: got 10{59}, allowed"),
    "full scale text": ({"full_scale_pF": "4"}, "full_scale_pF: got '4', allowed: a number above 0, pF"),
    "full scale below 0": ({"full_scale_pF": -4.0}, "full_scale_pF: got -4.0, allowed"),
    "full scale nan": ({"full_scale_pF": math.nan}, "full_scale_pF: got nan, allowed"),
    "full scale bool": ({"full_scale_pF": True}, "full_scale_pF: got True, allowed"),
    "stamps": ({"stamps": "moon"}, "stamps: got 'moon', allowed: converter or host"),
    "stamps list": ({"stamps": ["host"]}, r"stamps: got \['host'\], allowed"),
}


@pytest.mark.parametrize("name", DESCRIPTIONS)
def test_a_false_description_is_an_error_before_the_first_sample(name: str, tmp_path: Path) -> None:
    given, message = DESCRIPTIONS[name]
    at_once = Liar(good(3), lies={"describe": given})
    with pytest.raises(ProtocolError, match=f"^source: .*{message}"):
        Stream(at_once, record=tmp_path / "run.csv")
    later = Liar(good(3))
    stream = Stream(later, record=tmp_path / "run.csv")
    later.lies["describe"] = given
    with pytest.raises(ProtocolError, match=f"^source: .*{message}"), stream:
        pass
    assert (at_once.closed, later.closed) == (1, 1)
    assert list(tmp_path.iterdir()) == []


def test_a_description_that_turns_false_refuses_a_later_recording_and_the_measurement_goes_on(tmp_path: Path) -> None:
    source = Liar(good(400))
    with Stream(source) as stream:
        source.lies["describe"] = None
        with pytest.raises(ProtocolError, match="allowed: a dict"):
            stream.start_recording(tmp_path / "run.csv")
        assert len(list(stream)) == 400
    assert list(tmp_path.iterdir()) == []


def test_what_json_has_no_type_for_is_text_and_a_copy(tmp_path: Path) -> None:
    described = {"path": Path("here"), "many": [1, 2], "full_scale_pF": math.inf}
    with Stream(Liar(good(3), lies={"describe": described}), record=tmp_path / "run.csv") as stream:
        list(stream)
        described["many"].append(3)  # type: ignore[attr-defined]
        stream.note("saved again")
    document = recorded(tmp_path / "run.csv").document
    assert document
    assert (document["device"]["path"], document["device"]["many"]) == ("here", [1, 2])


COUNTERS = [
    None,
    [("errors", 1)],
    {"errors": -1},
    {"errors": 1.5},
    {"reconnects": "2"},
    {"errors": True},
    ZeroDivisionError(),
]


@pytest.mark.parametrize("given", COUNTERS, ids=repr)
def test_false_counters(given: Any, tmp_path: Path) -> None:
    """At the begin an error; later the last true ones stay, with one message."""
    source = Liar(good(3), lies={"counters": given})
    with pytest.raises(ProtocolError, match=r"^source: (its )?counters"), Stream(source, record=tmp_path / "run.csv"):
        pass
    assert source.closed == 1
    said: list[str] = []
    source = Liar(
        [*good(2), lambda: source.lies.update(counters=given), *good(2, 2)],
        lies={"counters": {"errors": 2, "reconnects": 1}},
    )
    with Stream(source, record=tmp_path / "run.csv", notify=said.append) as stream:
        assert stream.counters.errors == 2
        list(stream)
    assert (stream.counters.errors, stream.counters.reconnects) == (2, 1)
    assert_they_add_up(stream.counters)
    assert check(tmp_path / "run.csv").clean
    assert len(said) == 1
    assert said[0].endswith("errors and reconnects stay at (2, 1)")


@pytest.mark.parametrize("step", ["enter", "interrupt", "close"])
def test_a_step_that_raises(step: str, tmp_path: Path) -> None:
    """The other steps are done; the recording has the error of each step before its end."""
    path, source = tmp_path / "run.csv", Liar(good(300), lies={step: OSError("bus")})
    with pytest.raises(OSError, match="bus"), Stream(source, record=path) as stream:
        list(stream)
    assert source.closed == 1
    if step == "enter":
        assert list(tmp_path.iterdir()) == []
        return
    assert_they_add_up(stream.counters)
    report = check(path)
    assert (report.clean, report.survey.rows) == (True, 300)
    assert report.findings == (("the source ended with an error: bus",) if step == "interrupt" else ())


@pytest.mark.parametrize("step", ["interrupt", "close"])
def test_a_step_that_does_not_return(step: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(instrument, "CLOSE_S", 0.2)
    path, release = tmp_path / "run.csv", threading.Event()
    source = Liar(good(300), lies={step: release.wait})
    with (
        pytest.raises(SourceTimeout, match=r"did not (stop|close) within 0.\d s; it still runs"),
        Stream(source, record=path) as stream,
    ):
        list(stream)
    release.set()
    assert_they_add_up(stream.counters)
    assert source.closed == 1
    assert check(path).clean
    assert check(path).survey.rows == 300


def test_an_interrupt_without_effect_leaves_its_thread_and_takes_no_later_sample(tmp_path: Path) -> None:
    path, hangs, release = tmp_path / "run.csv", threading.Event(), threading.Event()
    source = Liar([*good(2), hangs.set, release.wait, *good(2, 2)], live=True)
    with pytest.raises(SourceTimeout, match=r"did not stop within 0.5 s"), Stream(source, record=path) as stream:
        assert all((next(iter(stream)), hangs.wait(60)))
    before = stream.counters
    release.set()
    assert stream._begun().join(30)
    assert stream.counters == before
    assert before.read == 2
    assert_they_add_up(before)
    assert check(path).clean


@pytest.mark.parametrize("error", [Mute(), StopIteration(1)], ids=["no text", "stop"])
def test_an_error_that_no_one_can_print_or_raise(error: BaseException, tmp_path: Path) -> None:
    class Raising(Liar):
        def __iter__(self) -> Iterator[Any]:
            raise error

    with (
        pytest.raises(ProtocolError, match=f"source: raised {type(error).__name__}, allowed: an error") as caught,
        Stream(Raising([]), record=tmp_path / "run.csv") as stream,
    ):
        list(stream)
    assert caught.value.__cause__ is error
    assert check(tmp_path / "run.csv").findings[0] == f"the source ended with an error: {caught.value}"
    assert stream.counters == StreamCounters()


def test_a_callback_that_raises_in_the_last_estimates_closes_the_recording(tmp_path: Path) -> None:
    """The baseline far below zero is told while the stream closes, and the callback fails."""

    def fail(_: str) -> None:
        raise ZeroDivisionError("callback")

    path, ready = tmp_path / "run.csv", threading.Event()
    falling = [
        Sample(i, i * 26_000_000, i * 26_000_000, -1, -1, 2.0 - 4.0 * (i > 100), 3.0 - 4.0 * (i > 100))
        for i in range(200)
    ]
    source = Liar([*falling, ready.set], live=True)
    with pytest.raises(ZeroDivisionError, match="callback"), Stream(source, record=path, notify=fail) as stream:
        ready.wait()
    assert source.closed == 1
    assert stream.counters.retaken > 0
    report = check(path)
    assert (report.clean, report.survey.rows) == (True, 200)
    assert report.findings == ("the source ended with an error: callback",)


def test_messages_from_any_thread_arrive(tmp_path: Path) -> None:
    said: list[str] = []

    def call() -> None:
        others = [threading.Thread(target=source.notify, args=[f"thread {k}"]) for k in range(20)]
        for other in others:
            other.start()
        for other in others:
            other.join()

    source = Liar([*good(2), call, *good(2, 2)])
    with Stream(source, notify=said.append) as stream:
        list(stream)
    assert sorted(said) == sorted(f"thread {k}" for k in range(20))


def test_close_from_another_thread_while_one_iterates() -> None:
    for wait_s in (0.0, 0.001, 0.01, 0.03):
        stream = Stream(Liar(good(5000)))
        with stream:
            closer = threading.Timer(wait_s, stream.close)
            closer.start()
            seen = sum(1 for _ in stream)
            closer.join()
        assert_they_add_up(stream.counters, recorded=False)
        assert seen <= stream.counters.delivered
