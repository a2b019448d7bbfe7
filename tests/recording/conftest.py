"""Fixtures of the tests of recordings."""

import tempfile
from pathlib import Path

import pytest
from palpate.recording import recorder


@pytest.fixture
def quick_disk(monkeypatch: pytest.MonkeyPatch) -> None:
    """Wait for no disk: a test of what is in the files does not cut the power."""
    monkeypatch.setattr("os.fsync", lambda _: None)


@pytest.fixture
def quick_recorder(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Sync often; make a folder for recordings, and one for temporary files."""
    monkeypatch.setattr(recorder, "SYNC_S", 0.02)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "temporary"))
    (tmp_path / "temporary").mkdir()
    (tmp_path / "run").mkdir()
