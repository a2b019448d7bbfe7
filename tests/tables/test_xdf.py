"""XDF files of the Lab Streaming Layer."""

import logging
import struct
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import numpy as np
import palpate
import pytest
from effort import examples
from hypothesis import given
from hypothesis import strategies as st
from palpate import RecordingError
from xdf import Stream, chunk, written

TIMES = (1000.0 + np.arange(300) * 0.026).tolist()
RANDOM = np.random.default_rng(7)
PAIR = RANDOM.normal(6, 0.1, (300, 2))
PROBE = Stream("Probe", TIMES, PAIR, ["hard", "soft"])
MARKS = Stream("Marks", [1001.0], [["touch"]], ["mark"], kind="string")
EEG = Stream("EEG", TIMES, RANDOM.normal(0, 30, (300, 3)), ["Cz", "Pz", "Oz"], unit="microvolts", kind="float32")


def save(folder: Path, *streams: Stream) -> Path:
    path = folder / "session.xdf"
    path.write_bytes(written(*streams))
    return path


def test_a_stream_with_two_channels(tmp_path: Path) -> None:
    recording = palpate.read(save(tmp_path, PROBE))
    assert recording.hard.tolist() == PAIR[:, 0].tolist()
    assert recording.soft.tolist() == PAIR[:, 1].tolist()
    assert (recording.t_hard_s == TIMES).all()
    assert "hard, pF; soft = soft, pF; 38.46 pairs a second; 300 rows" in recording.understood
    assert recording.zero_utc_ns is None
    assert any("clock of its sender" in note for note in recording.notes)


def test_the_stream_with_the_channels_is_found_among_others(tmp_path: Path) -> None:
    recording = palpate.read(save(tmp_path, EEG, PROBE, MARKS))
    assert recording.hard.tolist() == PAIR[:, 0].tolist()
    notes = " ".join(recording.notes)
    assert "stream 'Probe' is used: the only one of 2" in notes
    assert "streams of text are left out: 'Marks'" in notes


def test_by_name_and_unit(tmp_path: Path) -> None:
    path = save(tmp_path, Stream("Logger", TIMES, PAIR * 1000, ["a", "b"], unit="fF"), EEG)
    recording = palpate.read(path, columns={"hard": "Logger/a", "soft": "b"})
    assert np.allclose(recording.hard, PAIR[:, 0], rtol=1e-15)


def test_several_that_fit_are_an_error_that_names_them(tmp_path: Path) -> None:
    path = save(tmp_path, PROBE, Stream("Second", TIMES, PAIR + 1, ["hard", "soft"]))
    with pytest.raises(ValueError, match=r"part: .* 2 of 2 streams .*allowed: .*Probe, Second"):
        palpate.read(path)
    assert palpate.read(path, part="Second").hard.tolist() == (PAIR[:, 0] + 1).tolist()
    with pytest.raises(ValueError, match="got 'third', allowed: the name of a stream: Probe, Second"):
        palpate.read(path, part="third")


def test_one_channel_a_stream_is_joined_by_time(tmp_path: Path) -> None:
    later = [time + 0.010 for time in TIMES]
    path = save(tmp_path, Stream("A", TIMES, PAIR[:, :1], ["hard"]), Stream("B", later, PAIR[:, 1:], ["soft"]), MARKS)
    recording = palpate.read(path)
    assert recording.hard.tolist() == PAIR[:, 0].tolist()
    assert recording.soft.tolist() == PAIR[:, 1].tolist()
    assert np.allclose(recording.t_soft_s - recording.t_hard_s, 0.010, rtol=0, atol=1e-9)


def test_clock_offsets_are_used_and_times_are_not_smoothed(tmp_path: Path) -> None:
    jittered = [time + 0.005 * RANDOM.uniform() for time in TIMES]
    offsets = [(1000.0 + 2 * i, 50.0) for i in range(5)]
    probe = Stream("Probe", jittered, PAIR, ["hard", "soft"], rate=1 / 0.026, offsets=offsets)
    recording = palpate.read(save(tmp_path, probe))
    assert np.allclose(recording.t_hard_s, np.add(jittered, 50.0), rtol=0, atol=1e-6)
    assert not any("sender" in note for note in recording.notes)


def test_times_that_are_left_out_follow_from_the_rate(tmp_path: Path) -> None:
    sparse: list[float | None] = [time if i % 7 == 0 else None for i, time in enumerate(TIMES)]
    recording = palpate.read(save(tmp_path, Stream("Probe", sparse, PAIR, ["hard", "soft"], rate=1 / 0.026)))
    assert np.allclose(recording.t_hard_s, TIMES, rtol=0, atol=1e-9)


def test_a_torn_file_says_so(tmp_path: Path) -> None:
    path = save(tmp_path, PROBE)
    data = path.read_bytes()
    path.write_bytes(data[: data.rindex(b"\x04", 0, len(data) - 120) - 20])
    recording = palpate.read(path)
    assert 280 < len(recording.hard) < 300
    assert recording.hard.tolist() == PAIR[: len(recording.hard), 0].tolist()
    assert "the last chunk is incomplete: left out" in recording.notes


HEADER = struct.pack("<I", 1) + PROBE.xml.encode()
TEXTS = struct.pack("<I", 1) + MARKS.xml.encode()


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (b"", "without a stream of numbers"),
        (b"\x02\x01", "got a number of 2 bytes"),
        (b"\x01\x01\0\0", "a chunk of 1 bytes"),
        (chunk(3, struct.pack("<IBI", 1, 4, 1)), "which has no header"),
        (chunk(2, HEADER) + chunk(2, HEADER), "a second header"),
        (chunk(2, HEADER) + chunk(3, struct.pack("<IBQ", 1, 8, 2**62)), "got 0 bytes for 4611686018427387904 samples"),
        (chunk(2, HEADER) + chunk(4, bytes(4)), "no header"),
        (chunk(2, HEADER.replace(b">2<", b">2000000000<")), "channel_count: got '2000000000'"),
        (chunk(2, HEADER.replace(b"double64", b"float128")), "channel_format: got 'float128'"),
        (chunk(2, HEADER + b" " * 1_000_001), "got a header of"),
        (chunk(2, b"\1\0\0\0<info>"), "damaged at byte"),
        (chunk(2, HEADER), "without a sample"),
        (chunk(2, TEXTS) + chunk(3, struct.pack("<IBQ", 1, 8, 2**62)), "without a stream of numbers"),
    ],
)
def test_damaged_files_are_refused(tmp_path: Path, data: bytes, said: str) -> None:
    path = tmp_path / "wrong.xdf"
    path.write_bytes(b"XDF:" + data)
    with pytest.raises(RecordingError, match=said):
        palpate.read(path)


@examples(100)
@given(st.data())
def test_any_bytes_are_a_recording_or_refused(tmp_path_factory: pytest.TempPathFactory, data: st.DataObject) -> None:
    whole = written(Stream("P", TIMES[:40], PAIR[:40], ["hard", "soft"], offsets=[(1000.0, 1.0), (1001.0, 1.0)]))
    cut = data.draw(st.integers(0, len(whole)))
    middle = bytearray(whole[4:cut])
    for _ in range(data.draw(st.integers(0, 3)) if middle else 0):
        middle[data.draw(st.integers(0, len(middle) - 1))] = data.draw(st.integers(0, 255))
    path = tmp_path_factory.getbasetemp() / "any.xdf"
    path.write_bytes(b"XDF:" + middle)
    with suppress(RecordingError, ValueError):
        palpate.read(path)


def test_nothing_is_printed_or_left_behind(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    logger = logging.getLogger("pyxdf.pyxdf")
    before = logger.propagate, list(logger.handlers)
    palpate.read(save(tmp_path, PROBE))
    assert capfd.readouterr() == ("", "")
    assert (logger.propagate, logger.handlers) == before


def test_pyxdf_is_imported_only_for_such_a_file(tmp_path: Path) -> None:
    path = save(tmp_path, PROBE)
    code = (
        "import sys, palpate; palpate.read('tests/data/four-specimens.csv'); assert 'pyxdf' not in sys.modules;"
        f"palpate.read({str(path)!r}); assert 'pyxdf' in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_without_pyxdf_the_message_has_the_command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pyxdf", None)
    with pytest.raises(palpate.MissingExtra, match=r"pip install 'palpate\[tables\]'"):
        palpate.read(save(tmp_path, PROBE))
