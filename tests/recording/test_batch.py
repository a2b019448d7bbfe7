"""Touches of many recordings: the same bits as one by one, in order, and nothing lost if one fails."""

import copy
import pickle
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import palpate
import pytest
from palpate.recording_protocol import ArrayRecording, RecordingProtocol
from palpate.simulation import scenarios
from project import FOUR, copied

NAMES = ("tremor", "stiff-steady", "not-level", "step-up")


def same(
    found: Sequence[Sequence[palpate.Touch]], expected: Sequence[Sequence[palpate.Touch]]
) -> bool:
    """Return whether all touches have the same bits: pickles hold floats as they are."""
    return [[pickle.dumps(touch) for touch in one] for one in found] == [
        [pickle.dumps(touch) for touch in one] for one in expected
    ]


@pytest.mark.parametrize("jobs", [1, 2, 5])
def test_many_are_the_same_bits_as_one_by_one(jobs: int) -> None:
    runs = [scenarios.run(name, seed) for name in NAMES for seed in range(3)]
    given: list[RecordingProtocol | Path | str] = [*runs, FOUR, palpate.read(FOUR)]
    given += [palpate.recorded(FOUR), str(FOUR)]
    expected = [palpate.touches(one, scene="paper", threshold=0.1) for one in given]
    assert sum(map(len, expected)) > len(given)
    assert same(palpate.touches(given, jobs=jobs, scene="paper", threshold=0.1), expected)
    assert same(palpate.touches(iter(given), jobs=jobs, scene="paper", threshold=0.1), expected)
    assert palpate.touches([], jobs=jobs) == []


@pytest.mark.parametrize("missing", ["parts", "unit", "host_stamps"])
def test_a_recording_without_a_member_is_refused_with_its_name(missing: str) -> None:
    run = scenarios.run("stiff-steady")
    names = {name for name in dir(RecordingProtocol) if not name.startswith("_")} - {missing}
    incomplete: Any = type("Incomplete", (), {name: getattr(run, name) for name in names})()
    message = (
        f"recording: got .*Incomplete.*, without {missing}, allowed: the result of palpate.read"
    )
    with pytest.raises(TypeError, match=message):
        palpate.touches(incomplete)
    with pytest.raises(TypeError, match=message):
        palpate.offline(incomplete)


@pytest.mark.parametrize("wrong", [None, 3, object()])
def test_an_object_that_is_no_recording_is_refused_with_all_missing_members(wrong: Any) -> None:
    with pytest.raises(
        TypeError, match=r"recording: got .*, without doubts, full_scale_pF, .*unit"
    ):
        palpate.touches(wrong)


@pytest.mark.parametrize("uri", ["sim:four-specimens?seed=1", str(FOUR)])
@pytest.mark.parametrize("estimate", [palpate.touches, palpate.offline])
def test_a_source_is_refused_as_its_blocks_are_no_recordings(uri: str, estimate: Any) -> None:
    with (
        palpate.open(uri) as source,
        pytest.raises(TypeError, match="a live source has to be recorded first"),
    ):
        estimate(source)


def test_a_class_with_arrays_is_a_recording() -> None:
    run = scenarios.run("stiff-steady")

    class Own(ArrayRecording):
        t_hard_s, t_soft_s, hard, soft = run.t_hard_s, run.t_soft_s, run.hard, run.soft
        full_scale_pF = run.full_scale_pF

    assert same([palpate.touches(Own())], [palpate.touches(run)])


def test_paths_are_read_as_asked(tmp_path: Path) -> None:
    run = scenarios.run("tremor")
    rows = "".join(f"{h * 1e3!r};{s * 1e3!r};{t!r}\n" for h, s, t in zip(*(
        column.tolist() for column in (run.hard, run.soft, run.t_hard_s)), strict=True))  # fmt: skip
    path = tmp_path / "other.csv"
    path.write_text("a;b;c\n" + rows)
    reading = {"columns": {"hard": "a", "soft": "b", "time": "c"}, "unit": "fF", "time_unit": "s"}
    one = palpate.touches(palpate.read(path, **reading))  # type: ignore[arg-type]
    assert len(one) == 1
    assert same(palpate.touches([path, path], reading=reading), [one, one])
    assert same([palpate.touches(path, reading=reading)], [one])


def test_one_that_fails_loses_no_other(tmp_path: Path) -> None:
    letter = tmp_path / "letter.csv"
    letter.write_text("Dear colleague,\nhere are the data.\n")
    good = palpate.touches(FOUR)
    with pytest.raises(palpate.errors.SomeFailed, match="2 of 4 recordings failed") as caught:
        palpate.touches([FOUR, letter, FOUR, 3], jobs=2)  # type: ignore[list-item]
    failed = caught.value
    assert same([failed.results[0], failed.results[2]], [good, good])
    assert failed.exceptions == (failed.results[1], failed.results[3])
    assert isinstance(failed.results[1], palpate.errors.RecordingError)
    assert failed.results[1].__notes__ == [f"file: {letter}"]
    assert isinstance(failed.results[3], TypeError)
    for again in (pickle.loads(pickle.dumps(failed)), copy.copy(failed)):
        assert str(again) == str(failed)
        assert same([again.results[0]], [good])


def test_other_processes_give_the_same_bits_and_errors(tmp_path: Path) -> None:
    with ProcessPoolExecutor(2, get_context("spawn")) as pool:
        futures = [
            pool.submit(palpate.touches, path) for path in (FOUR, tmp_path / "nowhere.csv", FOUR)
        ]
        assert same([futures[0].result(), futures[2].result()], [palpate.touches(FOUR)] * 2)
        with pytest.raises(palpate.errors.RecordingError, match=r"nowhere\.csv: cannot be read"):
            futures[1].result()


def test_a_wrong_setting_is_one_error_before_any_file_is_read() -> None:
    with pytest.raises(TypeError, match="smalest_shift"):
        palpate.touches(["nowhere.csv"] * 3, smalest_shift=1.0)  # type: ignore[call-overload]
    with pytest.raises(ValueError, match="smallest_shift: got -1"):
        palpate.touches(["nowhere.csv"] * 3, smallest_shift=-1.0)
    wrong: Any
    for wrong in (0, "2", True):
        with pytest.raises(
            ValueError, match=f"jobs: got {wrong!r}, allowed: a whole number, 1 or more"
        ):
            palpate.touches([FOUR], jobs=wrong)


def test_touches_keep_what_was_said_of_the_recording(tmp_path: Path) -> None:
    path = copied(tmp_path / "run.csv")
    lines = path.read_text().splitlines(keepends=True)
    path.write_text("".join([*lines[:50], *lines[51:]]))
    with pytest.warns(UserWarning, match=r"run.csv: results may be wrong: "):
        found = palpate.touches(path)
    assert set(found.doubts) <= set(found.notes) != set()
    assert found.doubts
    for shown in (repr(found), found._repr_html_()):
        assert "results may be wrong: " in shown
    part = found[1:]
    assert (type(part), part.doubts, part.to_arrow().num_rows) == (
        type(found),
        found.doubts,
        len(found) - 1,
    )
    assert palpate.touches(palpate.read(path)).doubts == found.doubts
