"""A repair removes only what is no row, keeps what it removes, and keeps the files before it."""

import errno
import json
from pathlib import Path
from random import Random

import pytest
from click.testing import CliRunner
from damage import DAMAGES, finished, killed, put_together, rows_of, survivors, torn_of
from effort import draws
from palpate import RecordingError, check, read, recorded
from palpate.cli import main
from palpate.recording import repair, sidecar
from palpate.recording.rows import HEADER
from tally import Tally

pytestmark = pytest.mark.usefixtures("quick_disk")
ROWS, SYNCED = 60, 50
TRIES = draws(50, 1000)


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def holed(path: Path, *, closed: bool = False) -> tuple[Path, bytes]:
    """Write a recording of 2000 rows with 512 zero bytes in it; return it, and its bytes."""
    (finished(path, 2000) if closed else killed(path, 2000, 1990))
    data = path.read_bytes()
    data = data[:30_000] + bytes(512) + data[30_512:]
    path.write_bytes(data)
    return path, data


@pytest.mark.parametrize("kind", DAMAGES)
def test_no_row_is_lost_and_every_byte_can_be_had_again(tmp_path: Path, kind: str, tally: Tally) -> None:
    kinds = list(DAMAGES)
    for seed in range(kinds.index(kind), TRIES, len(kinds)):
        random, folder = Random(seed), tmp_path / str(seed)
        folder.mkdir()
        path = killed(folder / "run.csv", ROWS, SYNCED, torn=random.randrange(40))
        data = DAMAGES[kind](path.read_bytes(), random)
        for _ in range(random.choice((0, 0, 1, 3))):
            data = DAMAGES[random.choice(kinds)](data, random) if data else data
        path.write_bytes(data)
        before = contents(folder)
        left = survivors(data, rows_of(ROWS + 1))
        try:
            report = check(path, repair=True, remove_damage=True)
        except (RecordingError, ValueError):  # nothing in it is known
            assert not left
            assert contents(folder) == before
            continue
        after = path.read_bytes()
        found = iter(after.splitlines(keepends=True))
        lost = sum(row not in found for row in left)  # in this order
        assert lost == 0, (seed, kind)
        assert report.repaired
        assert not report.damaged
        assert report.survey.rows >= len(left)
        assert len(read(path).hard) == report.survey.rows
        kept = folder / "run.csv.unrepaired"
        assert (kept.read_bytes() if kept.exists() else after) == data
        assert (folder / "run.json.unrepaired").read_bytes() == before["run.json"]
        if kept.exists():
            assert put_together(after, torn_of(folder / "run.torn")) == data
        tally.fault(f"damaged, then repaired: {kind}", len(left), lost)


def test_zeros_in_the_middle_cost_the_rows_that_they_hit(tmp_path: Path) -> None:
    path, data = holed(tmp_path / "run.csv")
    report = check(path)
    [place] = report.damaged
    assert (place.lines, place.offset < 30_000, place.offset + place.bytes > 30_512) == (1, True, True)
    assert report.survey.rows == len(survivors(data, rows_of(2000)))
    assert place.rows_before + (report.survey.rows - place.rows_before) == report.survey.rows > 1980
    assert place.line == place.rows_before + 2
    for reader in (read, lambda path: list(recorded(path).blocks())):
        with pytest.raises(RecordingError, match=rf"line {place.line}: .*palpate check --repair"):
            reader(path)
    before = contents(tmp_path)
    refused = check(path, repair=True)
    assert refused.faults[-1].startswith(f"not repaired: {place.bytes:,} damaged bytes would be taken out")
    assert contents(tmp_path) == before
    repaired = check(path, repair=True, remove_damage=True)
    assert repaired.survey.rows == report.survey.rows
    assert repaired.survey.lost == 2000 - repaired.survey.rows
    assert repaired.survey.gaps == 1
    again = recorded(path)
    assert sum(map(len, again.blocks())) == repaired.survey.rows
    [doubt] = again.doubts  # the checkpoint was of rows that are gone: the new checksum must not hide it
    assert doubt.startswith("before the repair: the rows were changed after they were written")
    assert any(note.startswith(f"repaired: removed {place.bytes} bytes of 1 damaged place") for note in again.notes)
    assert repaired.verified == 0


def test_a_second_repair_overwrites_nothing(tmp_path: Path) -> None:
    path, first = holed(tmp_path / "run.csv")
    check(path, repair=True, remove_damage=True)
    middle = contents(tmp_path)
    path.write_bytes(middle["run.csv"][:900] + b"\xff" + middle["run.csv"][901:])
    second = path.read_bytes()
    assert "not read" in check(path).faults[-1]
    again = check(path, repair=True, remove_damage=True)
    assert {name: data for name, data in contents(tmp_path).items() if name in middle and "un" in name[4:]} == {
        name: data for name, data in middle.items() if "un" in name[4:]
    }
    assert (tmp_path / "run.csv.unrepaired").read_bytes() == first
    assert (tmp_path / "run.csv.unrepaired-2").read_bytes() == second
    assert put_together(path.read_bytes(), torn_of(tmp_path / "run.torn-2")) == second
    assert sum("before the repair" in fault for fault in again.faults) == 2


def test_a_torn_row_is_removed_without_a_question_and_verified_rows_stay_so(tmp_path: Path) -> None:
    path = killed(tmp_path / "run.csv", ROWS, SYNCED, torn=17)
    assert check(path).verified == SYNCED
    report = check(path, repair=True)
    assert (report.faults, report.verified, report.survey.rows) == ((), SYNCED, ROWS)
    [finding] = report.findings
    removed, left = finding.split("; ", 1)
    assert removed == "repaired: removed 17 bytes of an incomplete row (kept in run.torn)"
    assert left == "50 of 60 rows are verified"
    end = json.loads((tmp_path / "run.json").read_text())["end"]
    assert (end["rows"], end["verified"], end["clean"]) == (ROWS, SYNCED, False)
    assert recorded(path).doubts == ()
    assert check(path, repair=True) == report
    assert len(contents(tmp_path)) == 5


def test_a_changed_row_stays_a_doubt_after_the_repair(tmp_path: Path) -> None:
    path = killed(tmp_path / "run.csv", ROWS, SYNCED)
    data = path.read_bytes()
    path.write_bytes(data.replace(b"838861", b"838862", 1))
    report = check(path, repair=True)
    assert report.repaired
    assert [fault[:30] for fault in report.faults] == ["before the repair: the rows we"]
    assert read(path).doubts == report.faults
    assert report.verified == 0


def test_a_finished_recording_is_repaired_only_if_it_has_damaged_places(tmp_path: Path) -> None:
    path = finished(tmp_path / "run.csv", ROWS)
    data = path.read_bytes()
    reasons = {
        data.replace(b"838861", b"838862", 1): (
            "every line is a row, and which ones are not as they were written cannot be known"
        ),
        data[:-22]: "1 rows that were written are missing: take the file from a copy",
    }
    for wrong, reason in reasons.items():
        path.write_bytes(wrong)
        before = contents(tmp_path)
        report = check(path, repair=True)
        assert report.changed == (len(wrong) == len(data))
        assert report.faults[-1] == f"not repaired: {reason}"
        assert contents(tmp_path) == before
    (tmp_path / "holed").mkdir()
    path, data = holed(tmp_path / "holed" / "run.csv", closed=True)
    report = check(path, repair=True, remove_damage=True)
    assert "before the repair: 1992 rows in the file, but 2000 were written" in report.faults
    assert put_together(path.read_bytes(), torn_of(path.with_suffix(".torn"))) == data


def test_a_lost_header_or_sidecar_does_not_cost_the_rows(tmp_path: Path) -> None:
    path = killed(tmp_path / "run.csv", ROWS, SYNCED)
    data = path.read_bytes()
    for header in (b"", HEADER.encode().replace(b"t_hard", b"t\xffhard")):
        path.write_bytes(header + data.removeprefix(HEADER.encode()))
        with pytest.raises(RecordingError, match="line 1: "):
            read(path)
    assert check(path, repair=True, remove_damage=True).survey.rows == ROWS
    assert path.read_bytes() == data
    path, _ = holed(tmp_path / "other.csv")
    path.with_suffix(".json").unlink()
    report = check(path, repair=True, remove_damage=True)
    assert report.survey.lost > 0
    assert any("no valid sidecar (other.json is missing)" in fault for fault in report.faults)
    assert read(path).full_scale_pF == pytest.approx(4.0958, abs=1e-4)


@pytest.mark.parametrize("closed", [True, False])
def test_a_header_that_is_repaired_leaves_no_doubt(tmp_path: Path, closed: bool) -> None:
    """The bytes are again those that were recorded: they agree with the checksum of that time."""
    path = finished(tmp_path / "run.csv", ROWS) if closed else killed(tmp_path / "run.csv", ROWS, SYNCED)
    data = path.read_bytes()
    path.write_bytes(data.replace(b"t_hard", b"t\xffhard", 1))
    assert check(path).faults
    report = check(path, repair=True, remove_damage=True)
    assert path.read_bytes() == data
    assert (report.faults, report.verified) == ((), ROWS if closed else SYNCED)
    assert report.findings[0].endswith(f"wrote the missing header; {report.verified} of {ROWS} rows are verified")
    path.write_bytes(data.replace(b"838861", b"838862", 1))
    assert check(path).faults


def test_a_changed_sidecar_of_a_killed_recording_is_told_the_same_after_the_repair(tmp_path: Path) -> None:
    path = killed(tmp_path / "run.csv", ROWS, SYNCED)
    beside = path.with_suffix(".json")
    beside.write_text(beside.read_text().replace("a board", "a bored"))
    assert any(f"the first {SYNCED} of {ROWS} rows are verified" in note for note in read(path).notes)
    report = check(path, repair=True)
    assert report.findings == (f"repaired: wrote the missing end; {SYNCED} of {ROWS} rows are verified",)
    assert report.verified == SYNCED
    assert [fault[:41] for fault in report.faults] == ["before the repair: the sidecar was change"]


def test_without_a_sidecar_there_is_nothing_to_repair(tmp_path: Path) -> None:
    path = killed(tmp_path / "run.csv", ROWS, SYNCED, torn=9)
    path.with_suffix(".json").unlink()
    assert check(path, repair=True).faults[-1].startswith("not repaired: every line is a row")
    assert sorted(contents(tmp_path)) == ["run.csv"]


@pytest.mark.parametrize("call", range(8))
def test_a_full_disk_leaves_everything_as_it_was(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, call: int) -> None:
    """Whichever file cannot be synced: one more each time, until the repair succeeds."""
    path, _ = holed(tmp_path / "run.csv")
    before, calls = contents(tmp_path), 0

    def full(_: int) -> None:
        nonlocal calls
        calls += 1
        if calls > call:
            raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    monkeypatch.setattr("palpate.files.sync", lambda _: None)
    if call < 5:
        with pytest.raises(
            RecordingError, match="cannot be repaired: No space left on device; all files are as they were"
        ):
            check(path, repair=True, remove_damage=True)
        assert contents(tmp_path) == before
    else:
        assert check(path, repair=True, remove_damage=True).repaired


def test_a_file_that_changed_during_the_repair_is_left_alone(tmp_path: Path) -> None:
    path = killed(tmp_path / "run.csv", ROWS, SYNCED, torn=9)
    recording = recorded(path)
    for _ in recording.blocks():
        pass
    with path.open("ab") as file:
        file.write(b"more")
    before = contents(tmp_path)
    with pytest.raises(RecordingError, match="it has changed in the meantime; all files are as they were"):
        repair.repair(recording, [])  # type: ignore[arg-type]
    assert contents(tmp_path) == before


def test_the_command_asks_on_a_terminal_only(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path, data = holed(tmp_path / "run.csv")

    def run(*options: str, text: str = "") -> str:
        result = CliRunner().invoke(main, ["check", str(path), *options], input=text)
        assert result.exit_code == 4
        return result.stdout + result.stderr

    refused = run("--repair", text="y\n")
    assert "would be taken out, and kept in a file: not confirmed; --yes confirms it\n" in refused
    assert "a damaged recording is not read" not in refused
    assert "got 512 zero bytes, allowed: text" in refused
    monkeypatch.setattr("palpate.cli.check._is_terminal", lambda: True)
    asked = run("--repair", text="n\n")
    assert "bytes in 1 place are no rows. Remove them, and keep them in a file? [y/N]" in asked
    assert "would be taken out, and kept in a file: not confirmed\n" in asked
    assert path.read_bytes() == data
    assert "repaired: removed" in run("--repair", text="y\n")
    path.write_bytes(data)
    assert "1 damaged place" in run("--repair", "--yes")
    assert CliRunner().invoke(main, ["check", str(path), "--yes"]).exit_code == 2


def test_a_link_stays_a_link(tmp_path: Path) -> None:
    (tmp_path / "disk").mkdir()
    path = killed(tmp_path / "disk" / "run.csv", ROWS, SYNCED, torn=5)
    for suffix in (".csv", ".json"):
        (tmp_path / f"link{suffix}").symlink_to(path.with_suffix(suffix))
    assert check(tmp_path / "link.csv", repair=True).repaired
    assert (tmp_path / "link.csv").is_symlink()
    assert check(path).repaired
    assert sidecar.load(path) == sidecar.load(tmp_path / "link.csv")
