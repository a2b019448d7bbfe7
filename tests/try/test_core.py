"""Recordings in the browser's core: the bits of a replay, or a refusal in words."""

import base64
import json
from collections.abc import Callable
from math import nan
from pathlib import Path
from typing import Any

import numpy as np
import palpate
import pytest
from command_lines import document, run
from effort import draws, random_of
from example_touch import example_touch
from faulty_tables import at_the_lower_end, falling, jumped, loose, saturated
from freeze import recordings
from palpate import flags
from palpate.recording.rows import HEADER, format_rows
from palpate.recording.sidecar import made, text_of
from palpate.repeatability import objections
from palpate.simulation import hand, scenarios
from project import FOUR

SIDECAR = json.loads(FOUR.with_suffix(".json").read_text())


def opened(node: Any, **files: bytes) -> Any:
    """Return what the core makes of files: run_csv=b"..."."""
    return node("open", files=[{"name": name.replace("_", "."), "base64": base64.b64encode(data).decode()} for name, data in files.items()])  # fmt: skip


def of_path(node: Any, path: Path) -> Any:
    return opened(node, run_csv=path.read_bytes(), run_json=path.with_suffix(".json").read_bytes())


def require_same_touches(found: Any, path: Path) -> None:
    """Check all touches against `palpate replay`, to the last bit."""
    assert "refused" not in found, found
    replayed = document("replay", path)
    touches = replayed["touches"]
    judged = [(one["name"], one["time_s"], one["text"]) for one in replayed["judgements"]]
    told = [(one["name"], one["t_s"], one["text"]) for one in found["events"]["judgements"]]
    assert told == judged
    assert len(found["touches"]) == len(touches)
    for row, touch in zip(found["touches"], touches, strict=True):
        names = sorted(row.keys() & touch.keys() - {"advice", "uncertainty"})
        assert len(names) >= 18
        assert {name: row[name] for name in names} == {name: touch[name] for name in names}
        # two roots of sums of squares
        assert row["uncertainty"] == pytest.approx(touch["uncertainty"], rel=1e-12)
        for name in ("offset", "drift", "lag", "curve", "tilt", "shift"):
            assert row[name] == touch["effects"][name]
        assert [text.split(":")[0] for text in row["advice"]] == [
            text.split(":")[0] for text in touch["advice"]
        ]
        error = nan if touch["standard_error"] is None else touch["standard_error"]
        values = {
            name: touch[name]
            for name in ("samples", "revised", "age_s", "refused", "saturated", "outliers")
        }
        effects = {name: nan if size is None else size for name, size in touch["effects"].items()}
        measured = example_touch(*touch["flags"], standard_error=error, effects=effects, **values)
        assert row["kept"] == (not objections(measured))


def test_a_recording_has_the_bits_of_a_replay(node: Any) -> None:
    found = of_path(node, FOUR)
    require_same_touches(found, FOUR)
    recording = palpate.read(FOUR)
    tracker = palpate.Tracker(full_scale=SIDECAR["device"]["full_scale_pF"])
    rows = tracker.process(recording.t_hard_s, recording.t_soft_s, recording.hard, recording.soft)
    measured = rows["touch"] > 0
    for name, own in {
        "ratio": "ratio",
        "error": "standard_error",
        "statistic": "statistic",
    }.items():
        assert (
            np.array(found["rows"][name], float)[measured].tolist() == rows[own][measured].tolist()
        )
    assert found["rows"]["t"] == (np.rint(1e9 * recording.t_hard_s) * 1e-9).tolist()
    assert found["state"]["line"]["text"] == (
        "A recording: complete, clean end, 1411 rows, 0 missing. Nothing is being measured."
    )


def test_the_frozen_recordings_have_the_bits_of_a_replay_or_are_refused(
    node: Any, tmp_path: Path
) -> None:
    described = [path for path in recordings(tmp_path) if path.with_suffix(".json").exists()]
    answers = {path: of_path(node, path) for path in described}
    refused = {path.stem for path, found in answers.items() if "refused" in found}
    assert {"torn-described", "letter-described", "whole-unclean"} <= refused
    read = [path for path in described if path.stem not in refused]
    assert len(read) >= 6
    for path in read:
        require_same_touches(answers[path], path)


@pytest.mark.parametrize("seed", range(draws(20, at_least=5)))
def test_marks_and_settings_are_those_of_a_replay(node: Any, tmp_path: Path, seed: int) -> None:
    """Tares, gaps, lost pairs, a full scale, stamps of the host, settings of the tracker."""
    random = np.random.default_rng(seed)
    block = scenarios.run(
        str(random.choice(["stiff-steady", "step-up", "drift-hard"])), seed=seed
    ).block()
    block["seq"] += 7 + np.cumsum(random.random(len(block)) < 0.01)
    kinds: tuple[dict[str, bool], ...] = ({}, {"tare": True}, {"tare": True, "gap": True})
    places = random.choice(block["seq"], 3)
    marks = [
        {"seq": int(seq), "t_s": 1.0, "text": f"m {seq}", **kind}
        for seq, kind in zip(places, kinds, strict=True)
    ]
    device = {
        "name": "test",
        "full_scale_pF": [4.0, 0.9, "inf"][seed % 3],
        "stamps": ["host", "converter"][seed % 2],
    }
    settings = [{}, {"scene": "sliding"}, {"seconds": 2.0}, {"samples": 60}, {"release": 0.4}][
        seed % 5
    ]
    path, data = tmp_path / "run.csv", HEADER.encode() + format_rows(block)
    path.write_bytes(data)
    sidecar = made(device, len(block), data) | {"marks": marks, "settings": settings}
    path.with_suffix(".json").write_text(text_of(sidecar))
    found = of_path(node, path)
    require_same_touches(found, path)
    assert found["lost"] == block["seq"][-1] - block["seq"][0] + 1 - len(block)
    assert f"A recording: {palpate.check(path).verdict}, " in found["state"]["line"]["text"]
    assert [mark["text"] for mark in found["events"]["marks"]] == [mark["text"] for mark in marks]


def test_a_small_error_does_not_exclude_a_touch(node: Any, tmp_path: Path) -> None:
    """Tilts with an offset of .1 to 3 %: up to 1 %, a third of a hand's scatter, a touch counts."""
    kept = {}
    for number, tilt in enumerate((0.02, 0.1, 0.15, 0.2, 0.3)):
        session = hand.session(4, hand=hand.Hand(oblique=0.0, tilt_deg=tilt), moduli={"gel": 1.1})
        block = session["gel"].block()
        path = tmp_path / f"{number}.csv"
        data = HEADER.encode() + format_rows(block)
        path.write_bytes(data)
        device = {"name": "test", "full_scale_pF": 4.0, "stamps": "converter"}
        path.with_suffix(".json").write_text(text_of(made(device, len(block), data)))
        found = of_path(node, path)
        require_same_touches(found, path)
        for row in found["touches"]:
            if row["flags"] == ["offset"]:
                kept[abs(row["offset"])] = row["kept"]
    assert kept == {offset: offset < 0.03 / 3 for offset in kept}
    assert set(kept.values()) == {True, False}


def test_what_is_no_whole_recording_is_refused(node: Any) -> None:
    own, sidecar = FOUR.read_bytes(), FOUR.with_suffix(".json").read_bytes()
    assert "allowed: run.csv together with run.json" in opened(node, run_csv=own)["refused"]
    assert "got a.xlsx, allowed: one recording" in opened(node, a_xlsx=b"PK")["refused"]
    edited = sidecar.replace(b'"notes"', b'"notes" ', 1)
    assert "run.json: it was changed" in opened(node, run_csv=own, run_json=edited)["refused"]
    strict = text_of(SIDECAR | {"settings": {"threshold": 3.0}}).encode()
    assert (
        "threshold: got 3, allowed here: 10"
        in opened(node, run_csv=own, run_json=strict)["refused"]
    )
    rng = random_of("damage")
    for _ in range(draws(50, at_least=20)):  # any byte
        at = rng.randrange(len(own))
        damaged = own[:at] + bytes([own[at] ^ 1 << rng.randrange(8)]) + own[at + 1 :]
        assert "checksum differs" in opened(node, run_csv=damaged, run_json=sidecar)["refused"]


def test_each_flag_of_the_core_has_a_sentence(node: Any) -> None:
    # `stiffens` is tested in Python
    of_core = [flag.value for flag in flags.Flag if flag is not flags.Flag.STIFFENS]
    assert list(node("advice")) == of_core


@pytest.mark.parametrize("made", [jumped, saturated, falling, loose, at_the_lower_end])
def test_what_is_judged_has_the_sentences_of_palpate(
    node: Any, tmp_path: Path, made: Callable[[Path], Path]
) -> None:
    path = tmp_path / "run.csv"
    run("record", made(tmp_path), "-o", path)
    require_same_touches(of_path(node, path), path)
