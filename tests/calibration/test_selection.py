"""Which ratio, exponent and age a calibration takes; its file; and what follows it: modulus, replay, report, page."""

import math
import re
from dataclasses import replace
from functools import reduce
from operator import add
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import palpate
import pytest
from command_lines import document, run
from example_touch import example_touch
from palpate import Calibration
from palpate.calibration.calibration_file import About
from palpate.calibration.provenance import present_time
from palpate.calibration.selection import Track, choose_ratio, fitted_exponent
from palpate.calibration.specimen_files import write_session
from palpate.calibration.specimen_fit import SpecimenTouches, error_share, fit_specimens
from palpate.elasticity import SORBOTHANE_MPA
from palpate.live.calibration_fit import GuidedCalibration
from palpate.live.files import RunFiles
from palpate.live.plan import KnownSpecimen
from palpate.recording import session as stored
from palpate.recording import sidecar
from palpate.repeatability import objections
from palpate.simulation import hand
from palpate.uncertainty import level_ratio

from bench.accuracy.another_hand import figures_of
from bench.accuracy.another_hand_rows import REFERENCE, WHOLE_HOLD
from bench.accuracy.another_hand_scores import Share
from bench.accuracy.other_sessions import DOMES, Calibrating, specimens
from bench.accuracy.session_calibration import Stated, calibrated

TILTED = hand.Hand(oblique=0.0, tilt_deg=0.5)
MODULI = {name: SORBOTHANE_MPA[name] for name in ("30 OO", "60 OO", "40 A", "70 A")}


@pytest.fixture(scope="module")
def tilted(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Touches with a tilted probe of flat bumps: on four specimens, and on a gel of 1.1 MPa."""
    folder = tmp_path_factory.mktemp("tilted")
    for name, moduli, seed in (("four", MODULI, 3), ("gel", {"gel": 1.1}, 5)):
        runs = hand.session(seed, hand=TILTED, moduli=moduli)
        write_session(folder / name, {each: one.block() for each, one in runs.items()}, moduli)
    made = run(
        "calibrate",
        *(folder / "four").glob("*.csv"),
        "--moduli",
        folder / "four" / "moduli.csv",
        "-o",
        folder / "probe.toml",
    )
    assert made.exit_code == 0, made.output
    (folder / "printed.txt").write_text(made.stdout)
    return folder


def tracks(runs: dict[str, Any], **settings: float) -> list[Track]:
    return [
        Track(each, settings, {t.start: name for t in palpate.touches(each)})
        for name, each in runs.items()
    ]


def test_a_whole_session_with_domes_that_creep() -> None:
    """On three sessions: 60 touches, 15 means; of these one may be missed by chance."""
    found = figures_of(REFERENCE, 3)
    assert found.shares[Share.WITHOUT] == 0
    assert found.rms < 2.5
    assert found.mean_rms < 1.5
    assert found.coverage >= 92
    assert found.mean_coverage >= 92
    assert figures_of(WHOLE_HOLD, 3).rms > 5 * found.rms


@pytest.mark.parametrize("exponent", [1.0, 1.5])
def test_the_exponent_by_the_scatter(exponent: float) -> None:
    """With creep to 0.1; and the level ratio afterwards is the live one within its error."""
    touched = specimens(Calibrating(replace(DOMES, exponent=exponent)), 1)
    found = calibrated(touched, Stated())
    settings: Any = found.settings
    assert found.calibration.ratio == "level"
    assert settings["contact_exponent"] == exponent
    assert settings["age"] > 0
    every = tracks({str(one.label_MPa): one.recording for one in touched})
    assert fitted_exponent(every, settings["age"], ("creep",)) == pytest.approx(exponent, abs=0.1)
    for each in touched:
        offline = palpate.offline(each.recording, **settings)
        for one, live in zip(offline, found.touches(each), strict=True):
            assert one.level_ratio == pytest.approx(
                live.level_ratio, abs=3 * live.level_standard_error
            )
            assert one.level(exponent) == (one.level_ratio, one.level_standard_error)
            assert one.level(3.0) != one.level(exponent)


def test_the_simplest_ratio_if_none_is_better() -> None:
    level_held = {
        name: hand.session(0, hand=hand.Hand(oblique=0.0, tilt_deg=0.0), moduli={name: E})[name]
        for name, E in MODULI.items()
    }
    found = choose_ratio(tracks(level_held))
    assert (found.ratio, dict(found.settings)) == ("hold", {"contact_exponent": 1.0, "age": 0.0})
    asked = choose_ratio(tracks(level_held), ratio="level")
    assert (asked.ratio, asked.settings["contact_exponent"]) == ("level", 1.0)
    assert "assumed" in asked.about.contact_exponent
    given = choose_ratio(tracks(level_held, contact_exponent=1.5, age=0.8), ratio="level")
    assert dict(given.settings) == {"contact_exponent": 1.5, "age": 0.8}
    once = {
        name: each[0.0:10.0]
        for name, each in (
            (n, palpate.Recording(r.t_hard_s, r.t_soft_s, r.hard, r.soft))
            for n, r in level_held.items()
        )
    }
    assert "too few touches are repeated" in choose_ratio(tracks(once)).about.ratio
    assert choose_ratio([Track(level_held["40 A"], {"scene": "paper"}, {})]).about == About()


def test_the_share_of_the_errors_that_shows() -> None:
    random = np.random.default_rng(2)
    for factor in (0.2, 0.7, 2.0):
        groups = [
            [(4 + 0.01 * factor * e, 0.01) for e in random.standard_normal(4)] for _ in range(50)
        ]
        # 150 degrees of freedom: 6 %
        assert error_share(groups) == pytest.approx(min(factor, 1.0), rel=0.2)
    assert error_share([[(4.0, 0.1), (4.1, 0.1)], []]) == 1.0


def test_what_does_not_exclude_a_touch() -> None:
    assert objections(example_touch("tilt", "changed", "short")) == ()
    assert objections(example_touch("offset", "drift", "creep")) == ("offset", "drift", "creep")
    bent = example_touch("offset", "drift", "creep", "curve", level_ratio=4.0)
    assert objections(bent, ratio_of=level_ratio) == ("drift", "creep", "curve")
    assert objections(example_touch("drift", "creep", "short", age_s=1.3)) == ("short",)
    assert objections(example_touch(), ratio_of=level_ratio) == ("no level ratio",)


def test_calibrate_replay_and_report_follow_the_choice(tilted: Path) -> None:
    printed, probe, gel = (
        (tilted / "printed.txt").read_text(),
        tilted / "probe.toml",
        tilted / "gel" / "gel.csv",
    )
    assert re.search(
        r"^ratio: level, which scatters by 0\.1\d % within the specimens; hold \d\.\d %$",
        printed,
        re.MULTILINE,
    )
    assert re.search(
        r"^contact exponent: 1, as the scatter is least at 1\.0", printed, re.MULTILINE
    )
    found = Calibration.load(probe)
    assert (found.ratio, found.contact_exponent, found.age_s, [*found.accepted]) == (
        "level",
        1.0,
        0.0,
        ["offset"],
    )
    assert found.about.ratio in printed
    [*touches] = palpate.touches(palpate.read(gel))
    for touch, shown in zip(
        touches, document("replay", gel, "--calibration", probe)["touches"], strict=True
    ):
        assert found.ratio_of(touch) == (
            touch.level_ratio,
            found.error_share * touch.level_standard_error,
        )
        assert (
            shown["modulus"]["value_MPa"]
            == found.modulus_of(touch).value
            == pytest.approx(1.1, rel=0.01)
        )
        assert {"tilt", "offset"} & {*shown["flags"]}
    assert palpate.most_reliable(touches, accept=["offset"], ratio_of=found.ratio_of) in touches
    made = palpate.report.write_report(
        tilted / "gel.html", [gel], palpate.report.ReportOptions(probe)
    )
    assert made.results["kept"] == 4
    assert made.verdict.startswith("gel: 1.1")


def test_a_touch_that_was_measured_otherwise_has_no_modulus(tilted: Path) -> None:
    probe, gel = tilted / "probe.toml", tilted / "gel" / "gel.csv"
    other = run(
        "replay", gel, "--calibration", probe, "--set", "age=1", "--set", "contact_exponent=1.5"
    ).stdout
    assert (
        "no modulus: measured with age 1 and contact_exponent 1.5, but calibrated with age 0 and contact_exponent 1: use --set"
        in other
    )
    fast = example_touch(level_ratio=math.nan)
    found = Calibration.load(probe)
    assert "press more slowly" in found.modulus_of(fast).reason
    assert found.modulus_of(fast).as_dict()["value_MPa"] is None
    with pytest.raises(ValueError, match="no usable touch"):
        found.agreement([fast])


def test_files_with_and_without_a_choice(tilted: Path, tmp_path: Path) -> None:
    text = (tilted / "probe.toml").read_text()
    older = tmp_path / "older.toml"
    older.write_text(re.sub(r"\[touch\].*?\n\n", "", text, flags=re.DOTALL))
    found = Calibration.load(older)
    assert (found.ratio, found.contact_exponent, found.age_s, found.error_share) == (
        "hold",
        1.0,
        0.0,
        1.0,
    )
    for wrong, said in {
        'ratio = "luck"': "ratio: got 'luck'",
        'ratio = "hold"\nage_s = -1.0': "age_s: got",
    }.items():
        older.write_text(
            text.replace('ratio = "level"\n', f"{wrong}\n", 1).replace("\nage_s = 0.0", "")
        )
        with pytest.raises(palpate.errors.CalibrationError, match=said):
            Calibration.load(older)
    runs = hand.session(0, moduli=MODULI)
    mixed = [
        SpecimenTouches(n, E, palpate.touches(runs[n], age=float(n == "40 A")))
        for n, E in MODULI.items()
    ]
    with pytest.raises(palpate.errors.CalibrationError, match="several ages, exponents or kinds"):
        fit_specimens(mixed)


def test_a_replay_shows_the_ratio_of_the_session(tilted: Path, tmp_path: Path) -> None:
    path = tmp_path / "gel.csv"
    for suffix in (".csv", ".json"):
        path.with_suffix(suffix).write_bytes(
            (tilted / "gel" / "gel.csv").with_suffix(suffix).read_bytes()
        )
    held = run("replay", path).stdout
    read = sidecar.load(path)
    assert read
    sidecar.save(
        path.with_suffix(".json"), {**read, "session": stored.Plan(ratio="level").as_dict()}
    )
    shown = run("replay", path).stdout
    assert "The ratios are level ratios" in shown
    assert "The ratios are level ratios" not in held
    with pytest.raises(ValueError, match="ratio: got 'luck'"):
        stored.Plan(ratio="luck")


def test_the_page_chooses_from_its_recording(tmp_path: Path) -> None:
    """One recording with the touches on all specimens; without it, the ratio of the hold."""
    touched = specimens(Calibrating(), 2)
    whole = reduce(add, [one.recording for one in touched])
    np.savetxt(tmp_path / "table.csv", np.column_stack([whole.t_hard_s, whole.hard, whole.soft]), delimiter=",", header="time s,hard pF,soft pF", comments="")  # fmt: skip
    path = tmp_path / "run.csv"
    assert (
        run(
            "convert", tmp_path / "table.csv", "-o", path, "--map", "time=1,hard=2,soft=3"
        ).exit_code
        == 0
    )
    touches = iter(enumerate(palpate.touches(palpate.read(path)), 1))
    known = [
        KnownSpecimen(str(E), E, tuple((*next(touches), True) for _ in range(4)))
        for E in (one.label_MPa for one in touched)
    ]
    used, plan = (
        list[Calibration](),
        SimpleNamespace(known=lambda: known, progress=SimpleNamespace(), note=str, operator=""),
    )
    watch: Any = SimpleNamespace(chips=set(), simulated=None, begun_at=present_time())
    for recorder in (SimpleNamespace(path=path), None):
        bench = SimpleNamespace(
            files=RunFiles(folder=tmp_path), how={}, newest_recorder=recorder, use=lambda *_: None
        )
        GuidedCalibration(bench, plan, watch).save_calibration()  # type: ignore[arg-type]
        used.append(plan.progress.calibration)
    assert [found.ratio for found in used] == ["level", "hold"]
    assert used[0].age_s > 0
    assert len(used[0].ratios) >= 36  # one time for both channels: some have the flag "lag"
