"""Recordings for the tests of the report: a session of specimens with marks, and a calibration."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import palpate
from command_lines import run
from palpate.calibration.specimen_files import write_session
from palpate.recording import sidecar
from palpate.recording.session import Entry, Note, Plan, Specimen
from palpate.simulation.press import Press
from palpate.simulation.probe import Scenario, simulate

HOSTILE = "<script>fetch('//x')</script>\"'&</style>"  # a text that a page must only show


def calibrated(folder: Path) -> Path:
    """Write ten simulated specimens into folder/ten, a gel of 1.1 MPa into folder/gel, and folder/probe.toml."""
    for arguments in (["ten"], ["gel", "--object", "gel=1.1", "--seed", "7"]):
        assert run("simulate", "-o", folder / arguments[0], *arguments[1:]).exit_code == 0
    made = run(
        "calibrate",
        *specimens(folder),
        "--moduli",
        folder / "ten" / "moduli.csv",
        "-o",
        folder / "probe.toml",
    )
    assert made.exit_code == 0, made.output
    return folder / "probe.toml"


def specimens(folder: Path) -> list[Path]:
    """Return the recordings of the ten specimens."""
    return sorted(path for path in (folder / "ten").glob("*.csv") if path.name != "moduli.csv")


def change(path: Path, parts: Mapping[str, Any]) -> None:
    """Replace parts of the sidecar of a recording."""
    document = sidecar.load(path)
    assert document is not None
    sidecar.save(sidecar.sidecar_path(path), {**document, **parts})


def with_session(path: Path, *, odd: str = "") -> Path:
    """Record four touches with a session: 30 OO twice, of which one is discarded, a gel, and a touch of nothing known.

    Parameters
    ----------
    path : pathlib.Path
    odd : str
        Is in each text that may have it.
    """
    assert run("record", "sim:four-specimens", "-o", path, "--note", f"bench 2{odd}").exit_code == 0
    touches = palpate.touches(palpate.read(path))
    gel = f"gel{odd}"
    whats = [("30 OO", ""), ("30 OO", f"discarded{odd}"), (gel, ""), (None, "")]
    plan = Plan(
        f"gel series{odd}",
        f"operator 2{odd}",
        (Specimen("30 OO", 0.143, 2), Specimen(gel)),
        tuple(Entry(touch.start_s, *what) for touch, what in zip(touches, whats, strict=True)),
        (Note(12.0, f"bumps wiped{odd}"),),
    )
    marks = [
        {"t_s": touches[1].start_s + 1, "seq": 0, "text": f"slipped{odd}"},
        {"t_s": 18.0, "seq": 570, "text": "tare", "tare": True},
        {"t_s": 27.0, "seq": 860, "text": "unplugged for 2 s", "tare": True, "gap": True},
    ]
    change(path, {"session": plan.as_dict(), "marks": marks})
    return path


def softened(folder: Path) -> Path:
    """Write a recording of four touches on a gel that softens by 4, 2 and 1 %, in folder/gel.csv."""
    presses = []
    for number, share in enumerate((1.0, 0.96, 0.94, 0.93)):
        presses.append(Press(1.5 + 8.9 * number, [(0.0, 4.2 * share)], depth_pF=0.19))
    simulated = simulate(Scenario(presses=presses, duration_s=37.0), seed=3)
    return write_session(folder, {"gel": simulated.block()}, {"gel": 1.1})[0]


def recorded(folder: Path) -> None:
    """Write what `calibrated` does, and folder/session.csv."""
    calibrated(folder)
    with_session(folder / "session.csv")
