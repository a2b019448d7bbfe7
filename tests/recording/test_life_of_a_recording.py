"""A recording under any sequence of writing, checkpoints, kills, damage, repairs and reading: nothing lost, nothing silent."""

import tempfile
from pathlib import Path
from random import Random

import palpate
import pytest
from click.testing import CliRunner
from damage import DAMAGES, checkpoint, put_together, rows_of, survivors, torn_of
from effort import draws
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, precondition, rule
from palpate import RecordingError, check, read, recorded
from palpate.cli import main
from palpate.recording import sidecar
from palpate.recording.rows import HEADER

pytestmark = pytest.mark.usefixtures("quick_disk")
REFUSED = (RecordingError, ValueError)


class Life(RuleBasedStateMachine):
    """The files, and beside them what was written, whether it was closed, and whether anyone has changed the bytes."""

    def __init__(self) -> None:
        super().__init__()
        self.folder = tempfile.TemporaryDirectory()
        self.path = Path(self.folder.name) / "run.csv"
        self.beside = self.path.with_suffix(".json")

    def teardown(self) -> None:
        self.folder.cleanup()

    @initialize()
    def begin(self) -> None:
        self.rows, self.synced, self.writing = 0, b"", True
        self.path.write_bytes(HEADER.encode())
        self.document = sidecar.fresh({"name": "a board"}, {}, [])
        sidecar.save(self.beside, self.document)
        self.kept: dict[str, bytes] = {}

    @precondition(lambda self: self.writing)
    @rule(count=st.integers(1, 30))
    def write(self, count: int) -> None:
        with self.path.open("ab") as file:
            file.write(b"".join(rows_of(count, self.rows)))
        self.rows += count

    @precondition(lambda self: self.writing)
    @rule()
    def sync(self) -> None:
        self.synced = self.path.read_bytes()
        self.document["checkpoint"] = checkpoint(self.synced)
        sidecar.save(self.beside, self.document)

    @precondition(lambda self: self.writing)
    @rule(torn=st.integers(0, 40))
    def kill(self, torn: int) -> None:
        with self.path.open("ab") as file:
            file.write(rows_of(1, self.rows)[0][:torn])
        self.writing = False

    @precondition(lambda self: self.writing)
    @rule()
    def close(self) -> None:
        self.sync()
        end = {"dropped": 0, "clean": True, **self.document.pop("checkpoint")}
        sidecar.save(self.beside, {**self.document, "end": end})
        self.writing = False

    @precondition(lambda self: not self.writing)
    @rule(kind=st.sampled_from(sorted(DAMAGES)), seed=st.integers(0, 2**32))
    def damage(self, kind: str, seed: int) -> None:
        if data := self.path.read_bytes():
            self.path.write_bytes(DAMAGES[kind](data, Random(seed)))

    @precondition(lambda self: not self.writing)
    @rule(agreed=st.booleans())
    def repair(self, agreed: bool) -> None:
        before = self._files()
        data = before["run.csv"]
        there = survivors(data, rows_of(self.rows + 1))
        try:
            report = check(self.path, repair=True, remove_damage=agreed)
        except REFUSED:
            assert self._files() == before
            assert not there
            return
        after = self._files()
        found = iter(after["run.csv"].splitlines(keepends=True))
        assert all(row in found for row in there)
        assert not (agreed and report.damaged)
        if after["run.csv"] != data:
            assert agreed or len(data.rstrip(b"\0")) - len(after["run.csv"]) < 256
            new = max((name for name in after if name not in before and name.startswith("run.torn")), key=len)
            assert put_together(after["run.csv"], torn_of(self.path.with_name(new))) == data
            assert after[new.replace("run.torn", "run.csv.unrepaired")] == data
        self.kept |= {name: content for name, content in after.items() if "repaired" in name or "torn" in name}
        assert self.kept.items() <= after.items()

    @rule()
    def look(self) -> None:
        """All readers: rows that were not written are told, and so is each one that is missing."""
        data = self.path.read_bytes()
        before = self._files()
        try:
            report = check(self.path)
            recording = read(self.path)
        except REFUSED:
            assert not self.writing
            return
        finally:
            assert self._files() == before
        again = recorded(self.path)
        palpate.touches(again)
        assert (again.notes, again.doubts) == (recording.notes, recording.doubts)
        assert len(recording.hard) == report.survey.rows >= len(survivors(data, rows_of(self.rows + 1)))
        if not data.startswith(self.synced):
            assert recording.doubts
        elif recording.doubts:
            assert any("before the repair" in text or "written" in text for text in recording.doubts)
        assert report.verified == 0 or not recording.doubts
        assert not report.clean or data == self.synced

    @rule()
    def convert(self) -> None:
        target = self.path.with_name("converted.csv")
        done = CliRunner().invoke(main, ["convert", str(self.path), "-o", str(target), "--force"])
        assert done.exit_code in (0, 2, 4, 5), done
        if done.exit_code in (0, 5):
            again, source = read(target), read(self.path)
            assert len(again.hard) == len(source.hard)
            assert bool(again.doubts) == bool(source.doubts) == (done.exit_code == 5)
            assert bool(again.notes) >= bool(source.doubts)
            target.with_suffix(".json").unlink()
        target.unlink(missing_ok=True)

    def _files(self) -> dict[str, bytes]:
        return {path.name: path.read_bytes() for path in self.path.parent.iterdir()}


TestLife = pytest.mark.filterwarnings("error")(Life.TestCase)
TestLife.settings = settings(max_examples=draws(20, 400, at_least=5), stateful_step_count=25)
