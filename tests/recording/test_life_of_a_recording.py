"""A recording under any sequence of writing, checkpoints, failing disks, kills, damage, repairs and reading.

What was synced can be read, and nothing is lost or changed in silence.
"""

import errno
import os
import re
import tempfile
from collections.abc import Callable
from contextlib import suppress
from io import FileIO
from pathlib import Path
from random import Random
from unittest import mock

import palpate
import pytest
from command_lines import run
from effort import draws
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, precondition, rule
from palpate import check, read, recorded
from palpate.errors import RecordingError
from palpate.file_locks import unlock
from palpate.recording import sidecar, writer
from palpate.recording.rows import HEADERS
from palpate.samples import block_of
from recording_bench import DAMAGES, damaged, rows_of, sample, survivors

pytestmark = pytest.mark.usefixtures("quick_disk")
REFUSED = (RecordingError, ValueError)
WRITING = precondition(lambda self: self.writing)
OVER = precondition(lambda self: not self.writing)


DISTURBANCES: dict[str, tuple[str, Callable[[Path], object], str]] = {
    "removed": ("run.csv", Path.unlink, "was removed, renamed or moved"),
    "replaced": ("run.csv", lambda path: path.with_name("kept").write_text("x") and path.with_name("kept").replace(path),
                 "was replaced by another file"),
    "extended": ("run.csv", lambda path: path.write_bytes(path.read_bytes() + b"x"),
                 r"was changed by another program, from \d+ bytes to \d+,"),
    "edited": ("run.json", lambda path: path.write_text("precious"), "was changed by another program"),
}  # fmt: skip


class Life(RuleBasedStateMachine):
    """The files, and beside them what was written, what was synced, and whether anyone has changed the bytes."""

    def __init__(self) -> None:
        super().__init__()
        self.folder = tempfile.TemporaryDirectory()
        self.path = Path(self.folder.name) / "run.csv"

    def teardown(self) -> None:
        self._release()
        self.folder.cleanup()

    @initialize()
    def begin(self) -> None:
        self.rows, self.synced, self.writing, self.damaged = 0, b"", True, False
        self.missing = 0
        self.writer = writer.Writer(self.path, sidecar.fresh({"name": "a board"}, {}, []))
        self.kept: dict[str, bytes] = {}

    @WRITING
    @rule(count=st.integers(1, 30))
    def write(self, count: int) -> None:
        self.writer.write(block_of(sample(self.rows + i) for i in range(count)))
        self.missing += count if self.writer.error else 0
        self.rows = self.writer.written.rows

    @WRITING
    @rule()
    def sync(self) -> None:
        self.writer.checkpoint({})
        if not self.writer.error:
            self.synced = self.path.read_bytes()

    @WRITING
    @rule(room=st.integers(0, 300))
    def fill_the_disk(self, room: int) -> None:
        """Leave no room for the whole of the next rows: no part of them is left in the file."""

        def write_part(file: FileIO, data: bytes) -> None:
            os.write(file.fileno(), data[:room])
            raise OSError(errno.ENOSPC, "No space left on device")

        before, error = self.path.read_bytes(), self.writer.error
        with mock.patch.object(writer, "write", write_part):
            self.write(10)
        assert self.path.read_bytes() == before
        assert self.writer.error is error, "it can be tried again"

    @WRITING
    @rule(forgotten=st.booleans())
    def fail_to_sync(self, forgotten: bool) -> None:
        """Write the rows again before the next sync: the system may have forgotten them."""
        before = self.path.read_bytes()
        with mock.patch.object(
            writer, "to_disk", side_effect=OSError(errno.EIO, "Input/output error")
        ):
            assert not self.writer.checkpoint({})
        if forgotten and not self.writer.error:
            with self.path.open("r+b") as file:
                file.seek(len(self.synced))
                file.write(bytes(len(before) - len(self.synced)))
        self.sync()
        assert self.path.read_bytes() == before

    @WRITING
    @precondition(lambda _: os.name != "nt")  # there an open file cannot be removed or renamed
    @rule(kind=st.sampled_from(sorted(DISTURBANCES)))
    def disturb(self, kind: str) -> None:
        """Report it with the next write, which comes each 0.1 s; overwrite no file of another program."""
        if self.writer.error:
            return
        before, (name, act, said) = self._files(), DISTURBANCES[kind]
        act(self.path.with_name(name))
        after = self._files()
        self.write(1)
        self.writer.checkpoint({})
        if name == "run.csv":
            assert re.fullmatch(f".*{name}: {said} while it was recorded", str(self.writer.error))
        else:
            assert self.writer.error is None, "rows do not depend on the sidecar"
            assert not self.writer.sidecar.save()
            assert said in self.writer.sidecar.retry.reason
        with suppress(RecordingError):
            self.writer.end({}, {"dropped": self.missing})
        self._release()
        assert self._files().get(name) == after.get(name)
        self.path.with_name(name).write_bytes(before[name])

    @WRITING
    @rule()
    def lose_the_sidecar(self) -> None:
        """Write it again."""
        self.path.with_suffix(".json").unlink()
        self.writer.sidecar.add("notes", "again")
        assert self.writer.sidecar.save()
        assert (sidecar.load(self.path) or {})["notes"][-1] == "again"

    @WRITING
    @rule(
        end=st.sampled_from(["close", "kill", "cut power"]),
        share=st.floats(0, 1),
        zeros=st.sampled_from([0, 1, 4096]),
    )
    def end(self, end: str, share: float, zeros: int) -> None:
        """End by a close, a kill while a row is written, or a power cut: of what was not synced any part is left."""
        if end == "close":
            self.writer.end({}, {"dropped": self.missing})
        self._release()
        data = self.path.read_bytes()
        assert data.startswith(self.synced)
        if end == "cut power":
            left = len(self.synced) + round(share * (len(data) - len(self.synced)))
            self.path.write_bytes(data[:left] + bytes(zeros if left else 0))
        elif not self.writer.error:
            row = rows_of(1, self.rows)[0]
            torn = round(share * len(row)) if end == "kill" else 0
            self.path.write_bytes(data + row[:torn])
            self.synced = self.synced if end == "kill" else data

    @OVER
    @rule(kind=st.sampled_from(DAMAGES), seed=st.integers(0, 2**32))
    def damage(self, kind: str, seed: int) -> None:
        if data := self.path.read_bytes():
            self.path.write_bytes(damaged(kind, data, Random(seed)))
            self.damaged = True

    @rule(agreed=st.booleans(), syncs=st.sampled_from([0, 1, 2, 3, 4, 99]))
    def repair(self, agreed: bool, syncs: int) -> None:
        """Repair on a disk that is full after some syncs: if a file cannot be written, all are as they were."""
        before, left = self._files(), iter(range(syncs))

        def fsync(_: int) -> None:
            if next(left, None) is None:
                raise OSError(errno.ENOSPC, "No space left on device")

        data = before["run.csv"]
        there = survivors(data, rows_of(self.rows + 1))
        try:
            with mock.patch("os.fsync", fsync), mock.patch("palpate.files.sync"):
                report = check(self.path, repair=True, remove_damage=agreed)
        except REFUSED:
            assert self._files() == before
            # A file whose first line is damaged is none of palpate: the error asks what it is.
            headed = data.partition(b"\n")[0].removesuffix(b"\r") in HEADERS
            assert syncs < 99 or (self.damaged and not (headed and there))
            return
        after = self._files()
        assert report.running == self.writing
        assert not self.writing or after == before
        found = iter(after["run.csv"].splitlines(keepends=True))
        assert all(row in found for row in there)
        assert not (agreed and report.damaged)
        if after["run.csv"] != data:
            assert agreed or len(data.rstrip(b"\0")) - len(after["run.csv"]) < 256
            [new] = [
                name
                for name in after
                if name not in before and name.startswith("run.csv.unrepaired")
            ]
            assert after[new] == data
        self.kept |= {name: content for name, content in after.items() if "repaired" in name}
        assert self.kept.items() <= after.items()

    @rule()
    def look(self) -> None:
        """Every reader reports rows that were not written, and rows that are missing."""
        data = self.path.read_bytes()
        before = self._files()
        try:
            report = check(self.path)
            recording = read(self.path)
        except REFUSED:
            assert self.damaged
            return
        finally:
            assert self._files() == before
        again = recorded(self.path)
        palpate.touches(again)
        assert (again.notes, again.doubts) == (recording.notes, recording.doubts)
        assert (
            len(recording.hard)
            == report.survey.rows
            >= len(survivors(data, rows_of(self.rows + 1)))
        )
        if not data.startswith(self.synced):
            assert recording.doubts
        elif recording.doubts:
            assert any(
                re.search("before the repair|written|cut off", text) for text in recording.doubts
            )
        assert report.verified == 0 or all("cut off" in text for text in recording.doubts)
        assert not report.clean or data == self.synced

    @rule()
    def convert(self) -> None:
        target = self.path.with_name("converted.csv")
        done = run("convert", self.path, "-o", target, "--force")
        assert done.exit_code in (0, 2, 4, 5), done
        if done.exit_code in (0, 5):
            again, source = read(target), read(self.path)
            assert len(again.hard) == len(source.hard)
            assert bool(again.doubts) == bool(source.doubts) == (done.exit_code == 5)
            assert bool(again.notes) >= bool(source.doubts)
            target.with_suffix(".json").unlink()
        target.unlink(missing_ok=True)

    def _release(self) -> None:
        if not self.writer._file.closed:
            unlock(self.writer._file)
            self.writer._file.close()
        self.writing = False

    def _files(self) -> dict[str, bytes]:
        return {path.name: path.read_bytes() for path in self.path.parent.iterdir()}


TestLife = pytest.mark.filterwarnings("error")(Life.TestCase)
TestLife.settings = settings(max_examples=draws(200, 2000), stateful_step_count=25)
