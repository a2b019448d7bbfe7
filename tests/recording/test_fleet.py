"""Touches of many recordings: the same bits as one by one, in order, and nothing lost if one fails."""

import copy
import pickle
import shutil
import threading
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import palpate
import pytest
from palpate.fleet import in_order
from palpate.simulation import scenarios
from project import ROOT

FOUR = ROOT / "tests" / "data" / "four-specimens.csv"
NAMES = ("tremor", "stiff-steady", "not-level", "step-up")


def same(found: Sequence[Sequence[palpate.Touch]], expected: Sequence[Sequence[palpate.Touch]]) -> bool:
    """Return whether all touches have the same bits: pickles hold floats as they are."""
    return [[pickle.dumps(touch) for touch in one] for one in found] == [
        [pickle.dumps(touch) for touch in one] for one in expected
    ]


@pytest.mark.parametrize("jobs", [1, 2, 5])
def test_many_are_the_same_bits_as_one_by_one(jobs: int) -> None:
    runs = [scenarios.run(name, seed) for name in NAMES for seed in range(3)]
    given = [*runs, FOUR, palpate.read(FOUR), palpate.recorded(FOUR), str(FOUR)]
    expected = [palpate.touches(one, scene="paper", threshold=0.1) for one in given]
    assert sum(map(len, expected)) > len(given)
    assert same(palpate.touches(given, jobs=jobs, scene="paper", threshold=0.1), expected)
    assert same(palpate.touches(iter(given), jobs=jobs, scene="paper", threshold=0.1), expected)
    assert palpate.touches([], jobs=jobs) == []


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
    with pytest.raises(palpate.SomeFailed, match="2 of 4 recordings failed") as caught:
        palpate.touches([FOUR, letter, FOUR, 3], jobs=2)  # type: ignore[list-item]
    failed = caught.value
    assert same([failed.results[0], failed.results[2]], [good, good])
    assert failed.exceptions == (failed.results[1], failed.results[3])
    assert isinstance(failed.results[1], palpate.RecordingError)
    assert failed.results[1].__notes__ == [f"file: {letter}"]
    assert isinstance(failed.results[3], TypeError)
    for copied in (pickle.loads(pickle.dumps(failed)), copy.copy(failed)):
        assert str(copied) == str(failed)
        assert same([copied.results[0]], [good])
    of_files, others = failed.split(palpate.RecordingError)
    assert of_files is not None
    assert others is not None
    assert (len(of_files.exceptions), len(others.exceptions)) == (1, 1)


def test_an_error_of_a_file_comes_from_another_process_whole() -> None:
    error = palpate.RecordingError(Path("run.csv"), "got 3 cells, allowed: 9", 7)
    copied = pickle.loads(pickle.dumps(error))
    assert (str(copied), copied.path, copied.reason, copied.line) == (str(error), error.path, error.reason, 7)


def test_a_wrong_setting_is_one_error_before_any_file_is_read() -> None:
    with pytest.raises(TypeError, match="treshold"):
        palpate.touches(["nowhere.csv"] * 3, treshold=6.0)  # type: ignore[call-overload]
    with pytest.raises(ValueError, match="threshold: got -1"):
        palpate.touches(["nowhere.csv"] * 3, threshold=-1.0)
    with pytest.raises(ValueError, match="jobs: got 0, allowed: a whole number, 1 or more"):
        palpate.touches([FOUR], jobs=0)


def test_of_one_path_the_error_is_its_own() -> None:
    with pytest.raises(palpate.RecordingError, match=r"nowhere\.csv: cannot be read") as caught:
        palpate.touches("nowhere.csv")
    assert caught.value.__notes__ == ["file: nowhere.csv"]


def test_the_work_is_done_at_the_same_time() -> None:
    """Each of two calls waits for the other one: one after the other they would wait for ever."""
    meet = threading.Barrier(2, timeout=60)
    assert sorted(map(str, in_order(lambda _: meet.wait(), range(2), 2))) == ["0", "1"]


@pytest.mark.parametrize("jobs", [1, 3])
def test_no_more_than_twice_the_threads_are_taken_ahead(jobs: int) -> None:
    taken = []

    def items() -> Iterator[int]:
        for number in range(50):
            taken.append(number)
            yield number

    for done, result in enumerate(in_order(lambda number: -number, items(), jobs)):
        assert result == -done
        assert len(taken) <= done + 2 * jobs


def test_ended_early_it_begins_nothing_more_and_its_threads_end() -> None:
    before, begun, free = set(threading.enumerate()), list[int](), threading.Event()

    def work(number: int) -> int:
        begun.append(number)
        assert number < 2 or free.wait(60)
        return number

    results = in_order(work, range(100), 2)
    assert next(results) == 0
    free.set()
    results.close()
    assert len(begun) <= 5
    assert set(threading.enumerate()) <= before


@pytest.mark.parametrize("scheduler", ["threads", "processes"])
def test_over_dask_the_bits_are_the_same(scheduler: str) -> None:
    dask = pytest.importorskip("dask")
    paths = [FOUR] * 3
    tasks = [dask.delayed(palpate.touches)(path) for path in paths]
    found = dask.compute(*tasks, scheduler=scheduler, num_workers=2)
    assert same(list(found), palpate.touches(paths))


@pytest.mark.parametrize("jobs", [0, -1, "2", 1.5, True])
@pytest.mark.parametrize("several", [False, True])
def test_the_number_of_jobs_is_checked(jobs: Any, several: bool) -> None:
    path = "tests/data/four-specimens.csv"
    with pytest.raises(ValueError, match=f"jobs: got {jobs!r}, allowed: a whole number, 1 or more"):
        palpate.touches([path] if several else path, jobs=jobs)


def test_touches_keep_what_was_said_of_the_recording(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    for suffix in (".csv", ".json"):
        shutil.copy(f"tests/data/four-specimens{suffix}", path.with_suffix(suffix))
    lines = path.read_text().splitlines(keepends=True)
    path.write_text("".join([*lines[:50], *lines[51:]]))
    with pytest.warns(UserWarning, match=r"run.csv: results may be wrong: "):
        found = palpate.touches(path)
    assert set(found.doubts) <= set(found.notes) != set()
    assert found.doubts
    for shown in (repr(found), found._repr_html_()):
        assert "results may be wrong: " in shown
    part = found[1:]
    assert (type(part), part.doubts, part.to_arrow().num_rows) == (type(found), found.doubts, len(found) - 1)
    assert palpate.touches(palpate.read(path)).doubts == found.doubts
