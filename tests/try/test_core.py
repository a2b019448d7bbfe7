"""The core in WebAssembly: the bits of a recording in the browser are those of the live page and of a replay."""

import json
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import palpate
import pytest
from build_core import build
from core_sample import block as sampled
from effort import draws, random_of
from gap_plays import TOUCH_S, Play
from palpate import SourceError
from palpate.live.desk.recorded import Recorded
from palpate.live.desk.states import of_file
from palpate.live.feed import Flag
from palpate.live.review import Review
from palpate.live.summary import Summary
from palpate.recording import check
from palpate.recording.foreign import recorded
from palpate.recording.rows import EARLIER, HEADER, format_rows
from palpate.recording.sidecar import made, text_of
from palpate.samples import Block, Status
from palpate.simulation import scenarios
from project import ROOT
from try_core import Node, bits, rows_in

OWN = ROOT / "tests" / "data" / "four-specimens.csv"


def review_of(path: Path) -> Review:
    """Read a recording as the live page does."""
    review = Review(recorded(path), {})
    review.start()
    review._thread.join()
    assert not review.error, review.error
    return review


def require_alike(found: Any, path: Path) -> Review:
    """Check rows, touches and events against the live page, to the last bit."""
    review = review_of(path)
    assert "refused" not in found, found
    assert bits(rows_in(found["blocks"])) == bits(review.levels.view(-1e9, 1e9, 10**9))
    summary = Summary(review)
    own = Recorded(review, summary)
    summary.known = own.rows
    rows = found["touches"]["rows"]
    assert len(rows) == len(review.touches)
    assert json.loads(json.dumps(summary.touches()["rows"])) == rows[-200:]
    events = json.loads(json.dumps(own.events()))
    assert {name: events[name] for name in ("marks", "tares", "flags")} == {
        name: found["events"][name] for name in ("marks", "tares", "flags")
    }
    assert events["gaps"] == found["events"]["gaps"]
    hello = summary.instrument("")
    same = (
        "origin_s",
        "samples",
        "seconds",
        "scene",
        "threshold",
        "statistic_unit",
        "calibrated",
        "scatter",
        "version",
    )
    assert {name: hello[name] for name in same} == {name: found["hello"][name] for name in same}
    assert review.counters.as_dict() | found["state"]["counters"] == review.counters.as_dict()
    word = check(path).verdict if path.with_suffix(".json").exists() else "not verified"
    assert found["hello"]["file"]["end"] == word
    return review


def test_a_recording_has_the_bits_of_a_replay(node: Node) -> None:
    found = node.open_paths(OWN, OWN.with_suffix(".json"))
    require_alike(found, OWN)
    touches = palpate.touches(palpate.read(OWN))
    assert [touch["ratio"] for touch in found["touches"]["rows"]] == [touch.ratio for touch in touches]
    assert found["state"]["messages"] == []
    assert found["hello"]["file"] == {
        "name": OWN.name,
        "rows": 1411,
        "missing": 0,
        "end": "complete, clean end",
        "seconds": 36.66,
    }


def test_a_damaged_recording_is_not_called_complete(node: Node, tmp_path: Path) -> None:
    data, text = OWN.read_bytes(), OWN.with_suffix(".json").read_text()
    rows = data.splitlines(keepends=True)
    digit = data.index(b"\n", 40_000) - 4
    closed = json.loads(text)["end"]
    damaged = {
        "cut": (data[:40_000], text),
        "removed": (b"".join(rows[:400] + rows[420:]), text),
        "changed": (data[:digit] + bytes([data[digit] ^ 1]) + data[digit + 1 :], text),
        "disordered": (b"".join(rows[:400] + rows[420:430] + rows[400:420] + rows[430:]), text),
        "sidecar": (data, text.replace('"notes"', '"notes" ', 1)),
        "torn": (data + b"1411,37.", text),
        "doubted": (data, text_of(json.loads(text) | {"end": closed | {"doubts": ["of a table"]}})),
        "unended": (data, text_of({name: value for name, value in json.loads(text).items() if name != "end"})),
        "failed": (data, text_of(json.loads(text) | {"end": closed | {"error": "unplugged"}})),
        "repaired": (data, text_of(json.loads(text) | {"end": closed | {"repaired": "8 bytes"}})),
        "rescued": (data, text_of(json.loads(text) | {"notes": ["rescued: run.csv was removed"]})),
    }
    found = {}
    for name, (content, sidecar) in damaged.items():
        path = tmp_path / f"{name}.csv"
        path.write_bytes(content)
        path.with_suffix(".json").write_text(sidecar)
        got = node.open_paths(path, path.with_suffix(".json"))
        found[name] = got["hello"]["file"]["end"]
        _, line = of_file(path.name, found[name], "")
        assert (got["state"]["line"]["level"], got["state"]["line"]["title"]) == (line.level, line.title), name
        assert found[name] == check(path).verdict, name
    assert not any(found[name].startswith("complete") for name in found if name != "failed")


def test_a_sidecar_of_another_name_is_named(node: Node, tmp_path: Path) -> None:
    other = tmp_path / "other.json"
    other.write_bytes(OWN.with_suffix(".json").read_bytes())
    found = node.open_paths(OWN, other)
    assert found["hello"]["file"]["end"] == "not verified"
    assert "(other.json: not used)" in found["state"]["messages"][0]


def save(path: Path, block: Block, device: dict[str, Any], **parts: Any) -> Path:
    """Write samples as a recording with its sidecar."""
    data = HEADER.encode() + format_rows(block)
    path.write_bytes(data)
    path.with_suffix(".json").write_text(text_of(made(device, len(block), data) | parts))
    return path


def disturbed(seed: int) -> tuple[Block, dict[str, Any], dict[str, Any]]:
    """Return samples with faults of each kind, and what a sidecar says of them."""
    random = np.random.default_rng(seed)
    name = random.choice(["stiff-steady", "not-level", "step-up", "weak", "drift"][: 2 + seed % 2])
    block = scenarios.run(str(name), seed=seed).block()
    for status in (Status.HARD_SATURATED, Status.SOFT_SATURATED, Status.EXCITATION, Status.LOST):
        block["status"][random.random(len(block)) < 0.01] = int(status)
    lost = block["status"] == Status.LOST
    block["hard"][lost], block["hard_raw"][lost] = np.nan, -1
    if seed % 3 == 0:
        block["hard_raw"] = block["soft_raw"] = -1
    if seed % 4 == 1:
        block["soft_raw"][:50], block["soft"][:50] = -1, np.nan
    block["seq"] += 7 + np.cumsum(random.random(len(block)) < 0.01)
    late = random.random(len(block)) < 0.004
    for side in ("t_hard_ns", "t_soft_ns"):
        block[side] += np.cumsum(late * 1_000_000_000) - 3_000_000_000
    marks = [
        {"seq": int(seq), "t_s": float(seq), "text": f"m {seq}", **kind}
        for seq, kind in zip(
            random.choice(block["seq"], 4),
            ({}, {"tare": True}, {"tare": True, "gap": True}, {"tare": True}),
            strict=True,
        )
    ]
    device = {"name": "test", "full_scale_pF": [4.0, 0.9, "inf"][seed % 3], "stamps": ["host", "converter"][seed % 2]}
    settings = [{}, {"scene": "sliding"}, {"scene": "handheld", "seconds": 2.0}, {"samples": 60}, {"release": 0.4}][
        seed % 5
    ]
    return block, device, {"marks": marks, "settings": settings}


@pytest.mark.parametrize("seed", range(draws(20, at_least=4)))
def test_disturbed_recordings_have_the_bits_of_the_live_page(node: Node, tmp_path: Path, seed: int) -> None:
    block, device, parts = disturbed(seed)
    path = save(tmp_path / "run.csv", block, device, **parts)
    review = require_alike(node.open_paths(path, path.with_suffix(".json")), path)
    assert review.touches or seed


@pytest.mark.parametrize("seed", range(draws(6, at_least=2)))
def test_recordings_of_a_board_that_is_unplugged(node: Node, tmp_path: Path, seed: int) -> None:
    path = tmp_path / "run.csv"
    try:
        with palpate.Stream(Play(seed), record=path, seconds=TOUCH_S, notify=lambda _: None) as stream:
            for _ in stream.batches():
                pass
    except SourceError:
        pass
    found = node.open_paths(path, path.with_suffix(".json"))
    require_alike(found, path)


def test_forms_that_palpate_wrote_or_an_editor_makes(node: Node, tmp_path: Path) -> None:
    block, device, parts = disturbed(2)
    data = save(tmp_path / "run.csv", block, device, **parts).read_bytes()
    cells = [line.split(b",") for line in data.splitlines()]
    without = b"".join(b",".join([*line[:7], line[8]]) + b"\n" for line in cells)
    assert without.startswith(",".join(EARLIER).encode())
    for name, text in {
        "windows": data.replace(b"\n", b"\r\n"),
        "earlier": without,
        "open": data[:-1],
        "alone": data,
    }.items():
        path = tmp_path / f"{name}.csv"
        path.write_bytes(text)
        found = node.open((path.name, text))
        require_alike(found, path)
        assert "no sidecar: drop" in found["state"]["messages"][0]
    path = tmp_path / "other-codes.csv"  # no sidecar says their scale
    path.write_bytes(
        HEADER.encode()
        + format_rows(block)[:0]
        + b"0,0.0,0.013,100,200,0.5,0.25,-1,0\n1,0.026,0.039,101,200,0.6,0.25,-1,0\n"
    )
    found = node.open_paths(path)
    require_alike(found, path)
    assert any("not those of an AD7746" in text for text in found["state"]["messages"])


def test_the_simulated_session_has_the_bits_of_python(node: Node, tmp_path: Path) -> None:
    found, path = node.ask("sample"), tmp_path / "simulated.csv"
    path.write_bytes(HEADER.encode() + format_rows(sampled()))
    review = review_of(path)
    assert bits(rows_in(found["blocks"])) == bits(review.levels.view(-1e9, 1e9, 10**9))
    ratios = [touch.ratio for touch in review.touches]
    assert [touch["ratio"] for touch in found["touches"]["rows"]] == ratios
    assert [truth["touch"] for truth in found["truth"]] == [*range(1, len(ratios) + 1)]
    for truth, touch in zip(found["truth"], review.touches, strict=True):
        assert not touch.flags
        assert abs(touch.ratio - truth["touch_ratio"]) < 4 * touch.standard_error
    assert found["state"]["messages"] == []


@pytest.mark.parametrize("step_s", [0.026, 0.4, 7.0, 100.0])
def test_rows_that_come_in_parts_are_the_same(node: Node, step_s: float) -> None:
    whole = node.ask("sample")
    found = node.ask("play", times=[*np.arange(0, 60, step_s), 1e3])
    assert bits(rows_in(found["blocks"])) == bits(rows_in(whole["blocks"]))
    assert found["touches"] == whole["touches"]
    assert (rows_in(found["blocks"])["flags"] & Flag.MEASURED).any()


def test_the_sizes_and_that_a_build_is_always_the_same(node: Node, tmp_path: Path) -> None:
    build(tmp_path)
    assert {path.name: path.read_bytes() for path in tmp_path.glob("*.*")} == {
        path.name: path.read_bytes() for path in node.folder.glob("*.*") if path.name != "package.json"
    }
    assert (tmp_path / "palpate.wasm").stat().st_size < 40_000
    assert (tmp_path / "sample.js").stat().st_size < 20_000


def damaged(data: bytes, rng: Random) -> bytes:
    """Return bytes with a change behind the header."""
    at = rng.randrange(60, len(data))
    match rng.randrange(4):
        case 0:
            return data[:at] + bytes([rng.choice(b"0123456789,.-\n\0 e")]) + data[at + 1 :]
        case 1:
            return data[:at] + data[at + rng.randrange(1, 60) :]
        case 2:
            return data[:at] + data[rng.randrange(len(data)) :][: rng.randrange(1, 99)] + data[at:]
    return data[: max(at, 100)]


def test_a_damaged_file_is_refused_or_read_as_the_live_page_does(node: Node, tmp_path: Path) -> None:
    rng, path, read, count = random_of("damage"), tmp_path / "run.csv", 0, draws(200, at_least=40)
    for _ in range(count):
        data = OWN.read_bytes()[:9000]
        for _ in range(rng.choice([1, 1, 2, 5])):
            data = damaged(data, rng)
        path.write_bytes(data)
        found = node.open_paths(path)
        if "refused" not in found:
            require_alike(found, path)
            read += 1
    assert 0.1 < read / count < 0.95
