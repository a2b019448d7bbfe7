"""Formats of files: Excel, Parquet, Arrow, XDF, .gz, standard input; what is refused; packages that are missing."""

import gzip
import io
import json
import os
import subprocess
import sys
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np
import openpyxl
import palpate
import pyarrow as pa
import pytest
from command_lines import run
from palpate import files
from palpate.errors import RecordingError
from palpate.recording.verification import check
from project import FOUR, ROOT
from pyarrow import feather, parquet
from xdf import Stream, written

T = np.arange(50) / 40
TABLE = b"time (s),hard (pF),soft (pF)\n" + b"".join(
    b"%.3f,6.%03d,4.%03d\n" % (n / 40, n, n) for n in range(50)
)
BEGUN = datetime(2026, 3, 9, 12)
PAIR = np.random.default_rng(7).normal(6, 0.1, (300, 2))
TIMES = (1000.0 + np.arange(300) * 0.026).tolist()
PROBE = Stream("Probe", TIMES, PAIR, ["hard", "soft"])


def book(folder: Path, **sheets: list[list[Any]]) -> Path:
    made = openpyxl.Workbook()
    for name, rows in sheets.items():
        sheet = made.create_sheet(name)
        for row in rows:
            sheet.append(row)
    del made["Sheet"]
    made.save(folder / "book.xlsx")
    return folder / "book.xlsx"


def rows(
    time: Any = lambda t: t, header: tuple[str, ...] = ("time (s)", "C1 (pF)", "C2 (pF)")
) -> list[list[Any]]:
    return [list(header), *([time(float(t)), 6 + n / 100, 4 + n / 50] for n, t in enumerate(T))]


def test_a_workbook(tmp_path: Path) -> None:
    clock = rows(lambda t: (BEGUN + timedelta(seconds=t)).time(), ("time", "C1 (pF)", "C2 (pF)"))
    found = palpate.read(book(tmp_path, one=[["Logger 7"], [], *clock]))
    assert found.hard.tolist() == [6 + n / 100 for n in range(50)]
    # openpyxl has dates to 1 ms
    assert np.abs(found.t_hard_s - found.t_hard_s[0] - T).max() < 1.1e-3
    assert (
        found.understood
        == "time = time, times of day; hard = C1, pF; soft = C2, pF; 40 pairs a second; 50 rows"
    )


def test_a_sheet_of_several(tmp_path: Path) -> None:
    assert len(palpate.read(book(tmp_path, notes=[["text"], ["more"]], one=rows()))) == 50
    path = book(tmp_path, one=rows(), two=rows())
    with pytest.raises(
        ValueError, match=r"part: got none, allowed: the name of a sheet \(--part\): one, two"
    ):
        palpate.read(path)
    assert len(palpate.read(path, part="two")) == 50
    with pytest.raises(ValueError, match="part: got 'three', allowed"):
        palpate.read(path, part="three")


def test_wrong_cells_of_a_workbook(tmp_path: Path) -> None:
    for cell in ("6.1x", BEGUN):
        wrong = rows()
        wrong[11][1] = cell
        with pytest.raises(
            RecordingError, match=r"line 12: .* in column 2 \(C1 \(pF\)\) is neither"
        ):
            palpate.read(book(tmp_path, one=wrong))
    made = openpyxl.load_workbook(book(tmp_path, one=rows(header=("time (s)", "C1", "C2"))))
    for each in made["one"]["B"]:
        each.number_format = "0.0%"
    made.save(tmp_path / "percent.xlsx")
    with pytest.raises(RecordingError, match=r"'600%' in column 2 \(C1\) is neither a number"):
        palpate.read(tmp_path / "percent.xlsx")
    assert np.isnan(palpate.read(book(tmp_path, one=[*rows(), [1.25, None, 4.5]])).hard[-1])
    (tmp_path / "damaged.xlsx").write_bytes(b"PK\3\4" + bytes(300))
    with pytest.raises(RecordingError, match="cannot be read"):
        palpate.read(tmp_path / "damaged.xlsx")


@pytest.mark.parametrize("suffix", ["parquet", "arrow", "feather"])
@pytest.mark.parametrize("zone", [None, "UTC"])
def test_columns_of_other_programs(tmp_path: Path, suffix: str, zone: str | None) -> None:
    when = pa.array([BEGUN + timedelta(seconds=float(t)) for t in T], pa.timestamp("us", zone))
    fields = [
        pa.field("when", when.type),
        pa.field("C1", pa.float32(), metadata={"unit": "fF"}),
        pa.field("C2", pa.int64()),
    ]
    columns = pa.table(
        [when, pa.array(6000 + 100 * T, pa.float32()), pa.array(range(4000, 4050))],
        schema=pa.schema(fields),
    )
    path = tmp_path / f"other.{suffix}"
    (parquet.write_table if suffix == "parquet" else feather.write_feather)(columns, str(path))
    found = palpate.read(path)
    assert (found.t_hard_s.tolist(), found.soft.tolist()) == (
        T.tolist(),
        [n * 1e-3 for n in range(4000, 4050)],
    )
    assert found.hard == pytest.approx(6 + 0.1 * T, rel=1e-6)
    assert (found.zero_utc_ns is None) == (zone is None)
    path.write_bytes(path.read_bytes()[:-20])
    with pytest.raises(RecordingError, match="cannot be read"):
        palpate.read(path)


def save(folder: Path, *streams: Stream) -> Path:
    path = folder / "session.xdf"
    path.write_bytes(written(*streams))
    return path


def test_a_stream_of_an_xdf_file(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    marks = Stream("Marks", [1001.0], [["touch"]], ["mark"], kind="string")
    eeg = Stream("EEG", TIMES, PAIR * 9, ["Cz", "Pz"], unit="microvolts", kind="float32")
    path = save(tmp_path, eeg, PROBE, marks)
    with pytest.raises(
        ValueError, match=r"part: got none, allowed: the name of a stream \(--part\): EEG, Probe"
    ):
        palpate.read(path)
    with pytest.raises(ValueError, match="in microvolts, allowed: a capacitance"):
        palpate.read(path, part="EEG", columns={"hard": "Cz", "soft": "Pz"})
    recording = palpate.read(path, part="Probe")
    assert (recording.hard.tolist(), recording.soft.tolist()) == (
        PAIR[:, 0].tolist(),
        PAIR[:, 1].tolist(),
    )
    assert (recording.t_hard_s.tolist(), recording.zero_utc_ns) == (TIMES, None)
    assert "hard, pF; soft = soft, pF; 38.46 pairs a second; 300 rows" in recording.understood
    assert recording.notes == (
        "a stream without clock offsets: its times are on the clock of its sender",
    )
    assert capfd.readouterr() == ("", "")


def test_clock_offsets_are_used_and_times_are_not_smoothed(tmp_path: Path) -> None:
    jittered = (np.array(TIMES) + 0.005 * np.random.default_rng(1).uniform(size=300)).tolist()
    offsets = [(1000.0 + 2 * i, 50.0) for i in range(5)]
    recording = palpate.read(
        save(
            tmp_path, Stream("P", jittered, PAIR, ["hard", "soft"], rate=1 / 0.026, offsets=offsets)
        )
    )
    assert np.allclose(recording.t_hard_s, np.add(jittered, 50.0), rtol=0, atol=1e-6)
    assert recording.notes == ()


def test_a_damaged_xdf_file_is_refused(tmp_path: Path) -> None:
    path = save(tmp_path, PROBE)
    markers = written(Stream("Marks", [1.0], [["x"]], ["mark"], kind="string"))
    for wrong in (b"XDF:", b"XDF:\2\1", markers, path.read_bytes()[: path.stat().st_size // 2]):
        path.write_bytes(wrong)
        with pytest.raises(RecordingError, match=r"cannot be read|no stream has numbers"):
            palpate.read(path)


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"", "is empty"),
        (gzip.compress(TABLE)[:-20], "cannot be read: damaged, or not complete"),
        (gzip.compress(TABLE) + b"more", "Not a gzipped file"),
        (gzip.compress(TABLE + b"1,2,3\n" * 1000), "larger than 5,000 bytes"),
        (TABLE + b"1,2,3\n" * 1000, "larger than 5,000 bytes"),
    ],
)
def test_what_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, data: bytes, message: str
) -> None:
    assert files.LARGEST_TABLE == 500_000_000
    monkeypatch.setattr(files, "LARGEST_TABLE", 5000)
    (tmp_path / "run.csv").write_bytes(data)
    with pytest.raises(RecordingError, match=message):
        palpate.read(tmp_path / "run.csv")


def test_clean_text_and_own_recordings_need_no_package(tmp_path: Path) -> None:
    (tmp_path / "clean.csv").write_bytes(TABLE)
    code = (
        "import sys; sys.modules.update(dict.fromkeys(['pandas', 'pyarrow', 'openpyxl', 'pyxdf', 'polars']))\n"
        f"import palpate, numpy; found = palpate.read({str(tmp_path / 'clean.csv')!r})\n"
        "assert found.hard.tolist() == [6 + n / 1000 for n in range(50)] and found.t_soft_s[1] == 0.025\n"
        f"assert len(palpate.touches({str(FOUR)!r})) == 4\n"
        "assert len(palpate.read({'t_s': numpy.arange(9.), 'C1': numpy.arange(9.), 'C2': numpy.arange(9.)}, unit='pF')) == 9\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True, cwd=ROOT)
    loaded = "import sys, palpate; palpate.read({!r}); print([m for m in ('pandas', 'pyarrow', 'palpate.importers.formats') if m in sys.modules])"
    done = subprocess.run(
        [sys.executable, "-c", loaded.format(str(FOUR))], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "[]"


def test_a_recording_of_palpate_in_gz_is_verified_and_not_repaired(tmp_path: Path) -> None:
    own = tmp_path / "run.csv.gz"
    own.write_bytes(gzip.compress(FOUR.read_bytes()))
    (tmp_path / "run.json").write_bytes(FOUR.with_suffix(".json").read_bytes())
    report = check(own)
    assert (report.clean, report.faults, report.verified) == (True, (), report.survey.rows)
    torn = FOUR.read_bytes()[:-30]
    own.write_bytes(gzip.compress(torn + b"\n1,2\n" + torn[-2000:]))
    before = own.read_bytes()
    faults = check(own, repair=True, remove_damage=True).faults
    assert "not repaired: it is standard input, or a packed or converted file" in faults[-1]
    assert own.read_bytes() == before


def test_every_command_reads_standard_input(tmp_path: Path) -> None:
    data, new = gzip.compress(TABLE), tmp_path / "new.csv"
    assert "-: readable" in run("check", "-", text=data).stdout
    assert f"{new}: 50 rows" in run("convert", "-", "-o", new, text=data).stdout
    assert "50 rows" in run("import", "-", text=data).stdout
    output = run("record", "-", "-o", tmp_path / "recorded.csv", text=data).stdout
    assert palpate.read(tmp_path / "recorded.csv").hard.size > 30, output
    given = FOUR.read_bytes()
    touches = [
        json.loads(run("replay", name, "--json", text=given).stdout)["touches"]
        for name in ("-", FOUR)
    ]
    assert touches[0] == touches[1] != []


def test_standard_input_is_read_once_and_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(TABLE)))
    assert (palpate.read("-").hard.size, palpate.read("-").hard.size) == (50, 50)


@pytest.mark.skipif(sys.platform == "win32", reason="no pseudo terminals")
def test_a_terminal_is_not_waited_for() -> None:
    import pty

    leader, follower = pty.openpty()
    command = [sys.executable, "-m", "palpate", "check", "-"]
    result = subprocess.run(
        command, stdin=follower, capture_output=True, text=True, timeout=100, check=False
    )
    os.close(leader)
    os.close(follower)
    assert result.returncode == 4
    assert (
        "standard input is a terminal: send a file to it, as in palpate check - < run.csv"
        in result.stderr
    )
