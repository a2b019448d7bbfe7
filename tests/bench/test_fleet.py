"""The bench of many recordings runs; it compares all touches itself."""

import pytest
from click.testing import CliRunner

from bench.speed import fleet


def test_each_way_is_timed_and_gives_the_same_touches(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fleet, "REPEATS", 1)
    result = CliRunner().invoke(fleet.main, ["--files", "3", "--touches", "1", "--jobs", "2"])
    assert result.exit_code == 0, result.output
    for name in ("one by one", "jobs=2", "Dask, threads", "Dask, processes", "in memory, jobs=2"):
        assert f"\n{name:24} " in result.output


def test_other_touches_are_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fleet, "ways", lambda paths, _jobs: {"one by one": lambda: [[]] * len(paths)})
    result = CliRunner().invoke(fleet.main, ["--files", "2", "--touches", "1", "--jobs", "1"])
    assert result.exit_code == 1
    assert "in memory, one by one: other touches than one by one" in str(result.exception)
