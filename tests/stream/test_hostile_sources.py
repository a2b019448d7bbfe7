"""Sources that fail: nothing is counted that cannot be kept, every failure ends in an error, and nothing is left running."""

import math
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from palpate import Stream, check
from palpate.errors import ProtocolError, SourceTimeout
from palpate.samples import block_of
from palpate.stream import StreamCounters
from recording_bench import Blocks, Liar, sample, soon

NEXT = sample(3)


def good(count: int, first: int = 0) -> list[Any]:
    return [sample(first + i) for i in range(count)]


@pytest.fixture(autouse=True)
def nothing_left_running() -> Iterator[None]:
    """Every thread of the stream has ended soon after."""
    yield
    soon(lambda: not [t for t in threading.enumerate() if t.name.startswith("palpate")])


def assert_they_add_up(counters: StreamCounters) -> None:
    assert (
        counters.read
        == counters.delivered + counters.dropped
        == counters.recorded + counters.unrecorded
    )
    assert counters.waiting == 0


# What an array can have, and no recording can store: the field that is wrong, and its value.
REFUSED = {"seq": 1, "hard_raw": 2**24, "soft_raw": -2, "hard": NEXT.hard + 1e-9, "soft": math.nan, "t_hard_ns": 2**62,
           "status": 99, "t_uncertainty_us": -2}  # fmt: skip


@pytest.mark.parametrize(("name", "value"), REFUSED.items())
def test_of_a_block_the_samples_before_a_wrong_one_are_stored(
    name: str, value: float, tmp_path: Path
) -> None:
    block = block_of([*good(2), NEXT, *good(2, 4)])
    block[name][2] = value
    seq = block["seq"][2]
    with (
        pytest.raises(ProtocolError, match=f"source: sample {seq}: {name}: got .*, allowed: "),
        Stream(Blocks([block]), record=tmp_path / "run.csv") as stream,
    ):
        list(stream)
    assert_they_add_up(stream.counters)
    report = check(tmp_path / "run.csv")
    assert (report.clean, report.survey.rows, stream.counters.lost) == (True, 2, 0)
    assert [text[:46] for text in report.findings] == [
        "the source ended with an error: source: sample"
    ]


@pytest.mark.parametrize(
    "given", [["name"], {"period_s": 0}, {"full_scale_pF": math.nan}, {"stamps": "moon"}]
)
def test_a_false_description_is_an_error_before_the_first_sample(
    given: Any, tmp_path: Path
) -> None:
    """Also one that is false when the source has begun."""
    at_once = Liar(good(3), lies={"describe": given})
    later = Liar(good(3))
    with pytest.raises(ProtocolError, match=r"^source: describe\(\)"):
        Stream(at_once, record=tmp_path / "run.csv")
    stream = Stream(later, record=tmp_path / "run.csv")
    later.lies["describe"] = given
    with pytest.raises(ProtocolError, match=r"^source: describe\(\)"), stream:
        pass
    assert (at_once.closed, later.closed, list(tmp_path.iterdir())) == (1, 1, [])


def test_an_interrupt_without_effect_leaves_its_thread_and_takes_no_later_sample(
    tmp_path: Path,
) -> None:
    path = tmp_path / "run.csv"
    hangs = threading.Event()
    release = threading.Event()
    source = Liar([*good(2), hangs.set, release.wait, *good(2, 2)], live=True)
    with (
        pytest.raises(SourceTimeout, match=r"did not stop within 0.5 s"),
        Stream(source, record=path) as stream,
    ):
        assert all((next(iter(stream)), hangs.wait(60)))
    before = stream.counters
    found = check(path)
    assert any(
        "the source ended with an error: the source did not stop" in text for text in found.findings
    )
    assert source.closed == 0
    release.set()
    assert stream._reader.join(30)
    assert (stream.counters, check(path)) == (before, found)
    assert (before.read, found.clean) == (2, True)
    assert_they_add_up(before)
