"""Another chip and a simulated calibration are refused; what is unknown, old or missing is said."""

from dataclasses import replace
from datetime import UTC, datetime, timedelta
from itertools import product

import pytest
from palpate.calibration.origin import (
    OLD,
    AcceptedOrigin,
    ReadingsOrigin,
    mismatches,
    missing_remark,
    origin_remarks,
    provenance_document,
    refusal,
    require_origin,
)
from palpate.calibration.provenance import UNKNOWN, FileChecksum, Provenance
from palpate.errors import CalibrationRefused
from palpate.files import Json
from palpate.recording.sidecar import Sidecar

A = "66 cc 5c 90"
B = "61 12 5c 34"
NOW = datetime(2026, 11, 29, tzinfo=UTC)
REAL = Provenance(NOW, NOW, "B2", "A. Bee", "room 3", (FileChecksum("a.csv", 0, "0" * 64),), (A,), simulated=False)  # fmt: skip
SIMULATED = Provenance(date=NOW, simulated=True)
PROBE = ReadingsOrigin(A, simulated=False, measured=NOW)
SIMULATOR = ReadingsOrigin(A, simulated=True)
NOTHING = ReadingsOrigin()


@pytest.mark.parametrize("chip", ["", A, B])
@pytest.mark.parametrize("simulated", [True, False, None])
def test_what_is_refused(chip: str, simulated: bool | None) -> None:
    """Only what is known on both sides, and differs."""
    for of, kind in product([(), (A,), (A, B)], [True, False, None]):
        calibration = replace(REAL, chips=of, simulated=kind)
        found = mismatches(calibration, ReadingsOrigin(chip, simulated))
        expected = set()
        if kind is True and simulated is False:
            expected = {AcceptedOrigin.SIMULATED}
        elif not (kind is False and simulated is True) and chip and of and chip not in of:
            expected = {AcceptedOrigin.OTHER_CHIP}
        assert {each.accepted_by for each in found} == expected


def test_the_refusal_says_what_to_do() -> None:
    origin = replace(PROBE, chip=B)
    assert refusal(REAL, origin) == (
        f"the calibration was made with the chip {A}, but the readings are from {B}, allowed: "
        "readings from the same chip; calibrate with this one, or use it anyway with "
        "--accept other-chip"
    )
    assert refusal(SIMULATED, PROBE) == (
        "the calibration was made from simulated touches, but the readings are from a probe, "
        "allowed: a calibration of this probe; make one with palpate calibrate, or use it anyway "
        "with --accept simulated"
    )
    with pytest.raises(CalibrationRefused, match=r"^run\.csv: the calibration was made from sim"):
        require_origin("run.csv", SIMULATED, PROBE)


@pytest.mark.parametrize(
    ("calibration", "origin", "accepted"),
    [
        (REAL, replace(PROBE, chip=B), AcceptedOrigin.OTHER_CHIP),
        (SIMULATED, PROBE, AcceptedOrigin.SIMULATED),
    ],
)
def test_what_is_accepted_is_said(
    calibration: Provenance, origin: ReadingsOrigin, accepted: AcceptedOrigin
) -> None:
    [other] = set(AcceptedOrigin) - {accepted}
    assert refusal(calibration, origin, [other])
    require_origin("run.csv", calibration, origin, [str(accepted)])
    remark, *others = origin_remarks(calibration, origin, NOW)
    assert remark.endswith(f"; used anyway because of --accept {accepted}")
    assert others == []


@pytest.mark.parametrize(
    ("calibration", "origin", "expected"),
    [
        (REAL, PROBE, []),
        (SIMULATED, SIMULATOR, []),
        (UNKNOWN, NOTHING, []),
        (UNKNOWN, PROBE, []),
        (UNKNOWN, SIMULATOR, []),
        (REAL, SIMULATOR, ["the readings are simulated, but the calibration was made with a probe"]),
        (REAL, replace(SIMULATOR, chip=B), ["the readings are simulated, but the calibration was made with a probe"]),
        (
            SIMULATED,
            NOTHING,
            ["the calibration was made from simulated touches, and the readings do not state whether a probe made them"],
        ),
        (
            REAL,
            NOTHING,
            ["the readings do not state their chip and whether they are simulated: not compared with the calibration"],
        ),
        (
            REAL,
            replace(PROBE, chip=""),
            ["the readings do not state their chip: not compared with the calibration"],
        ),
        (replace(REAL, chips=()), replace(PROBE, chip=""), []),
    ],
)  # fmt: skip
def test_what_is_said(calibration: Provenance, origin: ReadingsOrigin, expected: list[str]) -> None:
    assert origin_remarks(calibration, origin, NOW) == expected


def test_an_old_calibration_is_said() -> None:
    """By the date of the readings, else by the present time; of a simulation never."""
    old = replace(REAL, measured=NOW - OLD - timedelta(days=1))
    text = (
        "the calibration is from 2025-11-28, more than a year before the readings: check it on a "
        "specimen of known modulus, or calibrate again"
    )
    assert origin_remarks(old, PROBE, NOW) == [text]
    assert origin_remarks(old, replace(PROBE, measured=None), NOW) == [text]
    assert origin_remarks(old, replace(PROBE, measured=NOW - OLD), NOW) == []
    assert origin_remarks(replace(old, date=NOW, measured=NOW - OLD), PROBE, NOW) == []
    [late] = origin_remarks(REAL, replace(PROBE, measured=NOW - 2 * OLD), NOW)
    assert "more than a year after the readings" in late
    assert origin_remarks(replace(SIMULATED, date=NOW - 3 * OLD), SIMULATOR, NOW) == []


def test_a_date_in_the_future_is_said() -> None:
    [remark] = origin_remarks(REAL, PROBE, NOW - timedelta(days=2))
    assert remark == (
        "the calibration is dated 2026-11-29, in the future: check the clock of the computer"
    )
    assert origin_remarks(REAL, PROBE, NOW - timedelta(hours=14)) == []


def test_a_missing_field_is_said() -> None:
    assert missing_remark(REAL) == ""
    assert missing_remark(SIMULATED) == ""
    assert missing_remark(replace(REAL, chips=())) == "the calibration does not state: chip"
    assert missing_remark(replace(REAL, probe="", site="")) == (
        "the calibration does not state: probe, site; palpate calibrate has --probe --site"
    )
    assert "files, chip, whether the touches are simulated; palpate" in missing_remark(UNKNOWN)


def test_the_document_has_each_remark_once() -> None:
    document = provenance_document(UNKNOWN, ["one", "", "one"])
    assert document == {"provenance": {}, "remarks": [missing_remark(UNKNOWN), "one"]}


@pytest.mark.parametrize(
    ("device", "expected"),
    [
        ({}, NOTHING),
        ({"name": "recording", "file": "run.csv"}, NOTHING),
        ({"name": "table of another program"}, NOTHING),
        ({"name": "LSL stream"}, NOTHING),
        ({"name": "serial port"}, ReadingsOrigin(simulated=False)),
        ({"converter": "AD7746", "fingerprint": A}, ReadingsOrigin(A, simulated=False)),
        ({"converter": "AD7746", "fingerprint": ""}, ReadingsOrigin(simulated=False)),
        ({"converter": "AD7746", "fingerprint": A, "simulated": {}}, SIMULATOR),
        ({"name": "simulated probe"}, ReadingsOrigin(simulated=True)),
    ],
)
def test_the_origin_of_a_device(device: Json, expected: ReadingsOrigin) -> None:
    assert ReadingsOrigin.of_device(device) == expected


def test_the_origin_of_a_recording() -> None:
    sidecar = Sidecar({"device": {"name": "x"}, "started": "2026-11-29T01:00:00+01:00"})
    assert ReadingsOrigin.of_sidecar(sidecar) == ReadingsOrigin(simulated=False, measured=NOW)
    assert ReadingsOrigin.of_sidecar(Sidecar()) == NOTHING
