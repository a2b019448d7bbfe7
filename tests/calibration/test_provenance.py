"""Where a calibration comes from: stored in its file, and read back strictly."""

import hashlib
import math
import tomllib
from datetime import UTC, datetime, timedelta, timezone
from pathlib import Path

import pytest
import tomli_w
from hypothesis import given
from hypothesis import strategies as st
from palpate import Calibration
from palpate.calibration.calibration_file import About
from palpate.calibration.provenance import (
    LONGEST_TEXT,
    UNKNOWN,
    FileChecksum,
    Provenance,
    joined_texts,
    recorded_at,
)
from palpate.errors import CalibrationError
from palpate.files import Json
from palpate.recording.sidecar import Sidecar
from project import FOUR

RATIOS = [2.0, 3.0, 4.0, 5.0]
MODULI = [0.18, 0.46, 1.0, 2.5]
CHECKSUM = "0123456789abcdef" * 4
WHOLE = Provenance(
    date=datetime(2026, 11, 29, 19, 20, 49, tzinfo=UTC),
    measured=datetime(2026, 11, 28, 8, tzinfo=UTC),
    probe="B2",
    operator="A. Bee",
    site="room 3",
    files=(FileChecksum("30OO.csv", 81118, CHECKSUM),),
    chips=("66 cc 5c 90",),
    simulated=False,
)
TEXTS = st.text(max_size=LONGEST_TEXT).filter(str.isprintable)
TIMES = st.datetimes(timezones=st.just(UTC)).map(lambda at: at.replace(microsecond=0))
CHECKSUMS = st.text("0123456789abcdef", min_size=64, max_size=64)
FILES = st.builds(FileChecksum, TEXTS, st.integers(0, 2**40), CHECKSUMS)
PROVENANCES = st.builds(
    Provenance,
    date=st.none() | TIMES,
    measured=st.none() | TIMES,
    probe=TEXTS,
    operator=TEXTS,
    site=TEXTS,
    files=st.lists(FILES, max_size=5).map(tuple),
    chips=st.lists(TEXTS, max_size=3).map(tuple),
    simulated=st.none() | st.booleans(),
)


def saved(path: Path, provenance: Provenance) -> Path:
    """Write a calibration with this provenance."""
    about = About(scene="handheld", provenance=provenance)
    Calibration.fit(RATIOS, MODULI, about=about).save(path)
    return path


@given(PROVENANCES)
def test_a_table_is_read_back(provenance: Provenance) -> None:
    """Through the text of the file, which has each type."""
    text = tomli_w.dumps({"provenance": provenance.as_dict()})
    assert Provenance.of_table(tomllib.loads(text)["provenance"]) == provenance


@pytest.mark.parametrize("provenance", [WHOLE, UNKNOWN, Provenance(simulated=True)])
def test_a_calibration_keeps_it(tmp_path: Path, provenance: Provenance) -> None:
    path = saved(tmp_path / "probe.toml", provenance)
    loaded = Calibration.load(path)
    assert loaded.about == About(scene="handheld", provenance=provenance)
    assert tomllib.loads(path.read_text())["about"] == {"scene": "handheld"}


def test_a_file_of_an_earlier_version_is_read(tmp_path: Path) -> None:
    path = saved(tmp_path / "probe.toml", WHOLE)
    document = tomllib.loads(path.read_text())
    del document["provenance"]
    path.write_text(tomli_w.dumps(document))
    loaded = Calibration.load(path)
    assert loaded.about.provenance == UNKNOWN
    assert len(UNKNOWN.missing()) == 8
    assert loaded.probe == Calibration.fit(RATIOS, MODULI).probe


FILE = {"name": "30OO.csv", "bytes": 81118, "sha256": CHECKSUM}


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"chip": "66 cc"}, "provenance: got 'chip', allowed: date, measured, .*did you mean"),
        ({"date": 20261129}, "date: got 20261129, allowed: a date and time, UTC, as 2026-"),
        ({"date": "yesterday"}, "date: got 'yesterday', allowed: a date and time"),
        ({"date": "2026-11-29T19:20:49"}, "date: got '2026-11-29T19:20:49', allowed"),
        ({"date": "2026-11-29T19:20:49+01:00"}, "allowed: a date and time, UTC"),
        ({"measured": "2026-11-29"}, "measured: got '2026-11-29', allowed"),
        ({"probe": 2}, "probe: got 2, allowed: a text of up to 200 characters"),
        ({"operator": "a" * 201}, "operator: got 'aaa.*allowed: a text of up to 200"),
        ({"site": "\x1b[2J"}, "site: got .*allowed: a text of up to 200 characters that can"),
        ({"simulated": 1}, "simulated: got 1, allowed: true or false"),
        ({"simulated": "no"}, "simulated: got 'no', allowed: true or false"),
        ({"chips": "66 cc"}, "chips: got '66 cc', allowed: a list"),
        ({"chips": [66]}, "chips: got 66, allowed: a text"),
        ({"files": FILE}, "files: got .*allowed: a list"),
        ({"files": ["30OO.csv"]}, "files: got '30OO.csv', allowed: a table"),
        ({"files": [{"name": "30OO.csv", "bytes": 1}]}, "files: got no sha256, allowed: one in"),
        ({"files": [{**FILE, "md5": ""}]}, "files: got 'md5', allowed: name, bytes, sha256"),
        ({"files": [{**FILE, "bytes": -1}]}, "bytes: got -1, allowed: a whole number, 0 or more"),
        ({"files": [{**FILE, "bytes": True}]}, "bytes: got True, allowed: a whole number"),
        ({"files": [{**FILE, "sha256": "ab"}]}, "sha256: got 'ab', allowed: 64 digits"),
        ({"files": [{**FILE, "sha256": "X" * 64}]}, "sha256: got .*allowed: 64 digits"),
        ({"files": [FILE] * 10_001}, "files: got 10001, allowed: up to 10000"),
    ],
)
def test_a_table_of_another_form_is_refused(table: Json, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Provenance.of_table(table)


def test_the_error_names_the_file(tmp_path: Path) -> None:
    path = saved(tmp_path / "probe.toml", UNKNOWN)
    path.write_text(path.read_text().replace("[provenance]", "[provenance]\nsimulated = 0"))
    with pytest.raises(CalibrationError, match=r"probe\.toml: not a calibration of palpate: prov"):
        Calibration.load(path)
    with pytest.raises(ValueError, match="provenance: got 3, allowed: a table"):
        Provenance.of_table(3)


@pytest.mark.parametrize(
    "date",
    [
        datetime(2026, 11, 29),
        datetime(2026, 11, 29, tzinfo=timezone(timedelta(hours=1))),
        datetime(2026, 11, 29, 0, 0, 0, 5, tzinfo=UTC),
    ],
)
def test_a_date_is_utc_in_whole_seconds(date: datetime) -> None:
    with pytest.raises(ValueError, match=r"date: got .*allowed: a date and time, UTC, whole sec"):
        Provenance(date=date)


def test_the_lines() -> None:
    assert WHOLE.lines() == [
        "calibrated: 2026-11-29 19:20:49 UTC, from 1 file; measured: 2026-11-28 08:00:00 UTC",
        "probe: B2; operator: A. Bee; site: room 3; chip: 66 cc 5c 90; touches: measured with a probe",
    ]
    when, what = Provenance(site="room 3", chips=("a", "b")).lines()
    assert when == "calibrated: date not stated, from 0 files"
    assert what == (
        "site: room 3; chip: a and b; not stated: date, date of the touches, probe, operator, "
        "files, whether the touches are simulated"
    )
    simulated = Provenance(operator="A. Bee", simulated=True).lines()
    assert simulated[1] == "operator: A. Bee; touches: simulated, no probe was used"


def test_the_age_is_that_of_the_touches() -> None:
    assert WHOLE.made == WHOLE.measured
    assert Provenance(date=WHOLE.date).made == WHOLE.date
    assert UNKNOWN.made is None


def test_a_checksum_of_a_file_that_grows(tmp_path: Path) -> None:
    """It is of the bytes that were there."""
    path = tmp_path / "run.csv"
    path.write_bytes(FOUR.read_bytes()[:50_000])
    then = FileChecksum.of(path)
    path.write_bytes(FOUR.read_bytes())
    assert then.bytes == 50_000
    assert then.sha256 == hashlib.sha256(path.read_bytes()[:50_000]).hexdigest()
    assert FileChecksum.of(path).bytes == path.stat().st_size
    with pytest.raises(OSError, match="Is a directory"):
        FileChecksum.of(tmp_path)


def test_a_name_that_cannot_be_stored_is_shown_by_escapes(tmp_path: Path) -> None:
    path = tmp_path / ("long" * 50 + "\x1b.csv")
    path.write_bytes(b"")
    name = FileChecksum.of(path).name
    assert name.startswith("longlong")
    assert name.endswith("... (205 characters)")
    path = tmp_path / "a\x1b.csv"
    path.write_bytes(b"")
    assert FileChecksum.of(path).name == "a\\x1b.csv"


def test_operators_are_joined_within_the_limit() -> None:
    names = [f"operator number {number}" for number in range(100)]
    assert joined_texts(["", ""]) == ""
    assert Provenance(operator=joined_texts(names)).operator.startswith("operator number 0, ")


@pytest.mark.parametrize(
    ("entries", "expected"),
    [
        ({}, None),
        ({"started": "2026-11-27T11:02:00+01:00"}, "2026-11-27 10:02:00+00:00"),
        ({"started": "2026-11-27T11:02:00"}, None),
        ({"started": "0001-01-01T00:00:00+14:00"}, None),
        ({"started": "Monday"}, None),
        ({"started": "Monday", "clock": {"zero_utc_ns": 86_400_000_000_001}}, "1970-01-02 00"),
        ({"clock": {"zero_utc_ns": math.nan}}, None),
    ],
)
def test_when_a_recording_began(entries: Json, expected: str | None) -> None:
    found = recorded_at(Sidecar(entries))
    assert (found is None) == (expected is None)
    assert str(found).startswith(str(expected))
