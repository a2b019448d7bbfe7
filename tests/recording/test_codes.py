"""Codes of other converters: every reader computes with the scale of the description what the source gave, bit for bit."""

import json
from pathlib import Path
from typing import Any

import palpate
import pytest
from hypothesis import given
from hypothesis import strategies as st
from palpate import Sample, Stream
from palpate.errors import ProtocolError, RecordingError
from palpate.recording import sidecar
from palpate.recording.csv_reader import RecordingFile
from palpate.sources import Codes
from palpate.sources.base import described
from recording_bench import SampleReader, Scripted, record, sample

WIDE = Codes(zero=-5, per_pF=700_000_001 / 3, largest=2**31 - 1)
scales = st.builds(
    Codes,
    st.integers(-(2**31), 2**31 - 1),
    st.floats(1e-3, 1e12, allow_subnormal=False),
    st.integers(1, 2**31 - 1),
)


def samples_of(scale: Codes, codes: list[int]) -> list[Sample]:
    return [
        Sample(i, i * 10**7, i * 10**7, code, -1, scale.pF(code), 2.0)
        for i, code in enumerate(codes)
    ]


@given(scales, st.lists(st.integers(0, 2**31 - 1), min_size=1, max_size=20))
def test_a_recording_gives_back_every_value(
    tmp_path_factory: pytest.TempPathFactory, scale: Codes, codes: list[int]
) -> None:
    written = samples_of(scale, [code % (scale.largest + 1) for code in codes])
    path = record(tmp_path_factory.mktemp("codes") / "run.csv", written, codes=scale._asdict())
    with palpate.open(str(path)) as source:
        assert list(SampleReader(source)) == written
    assert palpate.check(path).clean


def test_a_stream_refuses_what_a_replay_would_read_otherwise(tmp_path: Path) -> None:
    """Codes of another converter without their scale would be read as those of an AD7746."""
    source = Scripted([*samples_of(WIDE, [5, 6])])
    message = r"source: sample \d+: hard: got 4.28\d+e-08, allowed: the pF of its code"
    with (
        pytest.raises(ProtocolError, match=message),
        Stream(source, record=tmp_path / "run.csv") as stream,
    ):
        list(stream)


@pytest.mark.parametrize(
    ("codes", "message"),
    [
        (5, "codes: got 5, allowed: the keys zero, per_pF, largest"),
        (
            {"zero": 0, "per_pF": 0, "largest": 9},
            "codes: per_pF: got 0, allowed: a number from 1e-6",
        ),
        (
            {"zero": 0, "per_pF": 1.0, "largest": 2**31},
            "codes: largest: got 2147483648, allowed: an integer from 1",
        ),
    ],
)
def test_a_scale_that_is_none(codes: Any, message: str, tmp_path: Path) -> None:
    with pytest.raises(ProtocolError, match=message):
        described(Scripted([], codes=codes))
    path = record(tmp_path / "run.csv", [sample(0)])
    beside = sidecar.sidecar_path(path)
    document = json.loads(beside.read_text())
    document["device"]["codes"] = codes
    beside.write_text(json.dumps(document))
    with pytest.raises(RecordingError, match=message):
        sidecar.load(path)


def test_without_a_sidecar_codes_of_another_converter_are_left_out(tmp_path: Path) -> None:
    path = record(tmp_path / "run.csv", samples_of(WIDE, [7, 2**30]), codes=WIDE._asdict())
    sidecar.sidecar_path(path).unlink()
    read = RecordingFile(path)
    [block] = read.blocks()
    assert (read.codes, block["hard_raw"].max()) == (None, -1)
    assert block["hard"].tolist() == [s.hard for s in samples_of(WIDE, [7, 2**30])]
    assert any(note.startswith("the codes are not those of an AD7746") for note in read.notes)
    own = record(tmp_path / "own.csv", [sample(i) for i in range(9)])
    sidecar.sidecar_path(own).unlink()
    assert RecordingFile(own).codes == Codes()
