"""Which ratio, exponent and age a calibration takes; its file; and what follows it: modulus, replay, report, page."""

import math
import re
from collections.abc import Mapping
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
from palpate.calibration.evidence import EXPONENTS, TouchEvidence
from palpate.calibration.fit import MeanRatios, curve, fit_curve
from palpate.calibration.provenance import present_time
from palpate.calibration.selection import RatioError, Track, choose_ratio, prediction_error
from palpate.calibration.specimen_files import write_session
from palpate.calibration.specimen_fit import SpecimenTouches, error_share, fit_specimens
from palpate.elasticity import SORBOTHANE_MPA
from palpate.live.calibration_fit import GuidedCalibration
from palpate.live.plan import KnownSpecimen
from palpate.live.run_files import RunFiles
from palpate.recording import session as stored
from palpate.recording import sidecar
from palpate.recording_protocol import RecordingProtocol
from palpate.repeatability import objections
from palpate.samples import blank
from palpate.simulation import hand
from palpate.simulation.probe import Simulation
from palpate.uncertainty import level_ratio

from bench.accuracy.another_hand import figures_of
from bench.accuracy.another_hand_rows import REFERENCE, WHOLE_HOLD
from bench.accuracy.another_hand_scores import Share
from bench.accuracy.other_sessions import DOMES, HAND, Calibrating, pressed, specimens
from bench.accuracy.session_calibration import Stated, calibrated

Runs = Mapping[str, RecordingProtocol]
"""A recording of the touches on each specimen."""
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


def tracks(runs: Runs, **settings: float) -> list[Track]:
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
    low, high = found.calibration.possible_exponents
    assert low - 0.1 <= exponent <= high + 0.1
    assert high - low <= 0.2
    said = found.calibration.about.contact_exponent
    assert said.endswith(f": repeated touches scatter least with {exponent:g}")
    for each in touched:
        offline = palpate.offline(each.recording, **settings)
        for one, live in zip(offline, found.touches(each), strict=True):
            assert one.level_ratio == pytest.approx(
                live.level_ratio, abs=3 * live.level_standard_error
            )
            assert one.level(exponent) == (one.level_ratio, one.level_standard_error)
            assert one.level(3.0) != one.level(exponent)


def test_the_simplest_ratio_if_none_is_better() -> None:
    """The scatter of this hand is true: no ratio and no age reduces it."""
    found = choose_ratio(tracks(hand.session(0, moduli=MODULI)), MODULI)
    assert (found.ratio, dict(found.settings)) == ("hold", {"contact_exponent": 1.0, "age": 0.0})
    assert re.fullmatch(
        r"hold: its error on a specimen left out is \d\.\d %; level \d\.\d %", found.about.ratio
    )
    assert (found.about.contact_exponent, found.about.age) == ("", "")


@pytest.fixture(scope="module")
def level_held() -> dict[str, Simulation]:
    """Return touches of a level probe on four specimens."""
    return {
        name: hand.session(0, hand=hand.Hand(oblique=0.0, tilt_deg=0.0), moduli={name: E})[name]
        for name, E in MODULI.items()
    }


def test_the_hold_of_a_level_probe_counts_at_least_as_a_hand(level_held: Runs) -> None:
    """Its own error is smaller than that of the level ratio; another hand would tilt the probe."""
    found = choose_ratio(tracks(level_held), MODULI)
    assert found.ratio == "level"
    assert re.search(
        r"level: .* is 0\.0\d+ %; hold 0\.0\d+ %, but a hand is assumed to scatter it by 3 %",
        found.about.ratio,
    )
    assert found.exponents == tuple(EXPONENTS)
    assert found.about.contact_exponent == "1 to 1.5: the touches were too level to show it"
    asked = choose_ratio(tracks(level_held), MODULI, ratio="hold")
    assert (asked.ratio, asked.settings["contact_exponent"]) == ("hold", 1.0)
    assert asked.about.ratio.startswith("hold, as given: its error")


@pytest.mark.parametrize(("bumps", "exponent"), [("flat", 1.0), ("domes", 1.5)])
def test_stated_bumps_are_the_only_ones(level_held: Runs, bumps: str, exponent: float) -> None:
    found = choose_ratio(tracks(level_held), MODULI, bumps=bumps)
    assert (found.ratio, found.exponents) == ("level", (exponent,))
    assert found.settings["contact_exponent"] == exponent
    assert found.about.contact_exponent == f"{exponent:g}, as stated: {bumps}"


def test_settings_of_the_tracks_are_kept(level_held: Runs) -> None:
    every = tracks(level_held, contact_exponent=1.5, age=0.8)
    found = choose_ratio(every, MODULI, ratio="level")
    assert dict(found.settings) == {"contact_exponent": 1.5, "age": 0.8}
    assert found.about.age == "0.8 s, as given"


def test_one_touch_on_each_specimen_compares_nothing(level_held: dict[str, Simulation]) -> None:
    once = {}
    for name, each in level_held.items():
        whole = palpate.Recording(each.t_hard_s, each.t_soft_s, each.hard, each.soft)
        once[name] = whole[0.0:10.0]
    found = choose_ratio(tracks(once), MODULI)
    assert found.about.ratio == "hold: there are too few touches to compare it with level"
    level = choose_ratio(tracks(once), MODULI, ratio="level")
    assert level.about.contact_exponent == "1 to 1.5: too few touches are repeated to show it"


def test_a_scene_without_an_exponent_has_no_choice(level_held: Runs) -> None:
    paper = [Track(level_held["40 A"], {"scene": "paper"}, {})]
    assert choose_ratio(paper, MODULI).about == About()


@pytest.mark.parametrize(
    ("stated", "message"),
    [
        ({"ratio": "luck"}, "ratio: got 'luck', allowed: hold, level"),
        ({"bumps": "cones"}, "bumps: got 'cones', allowed: flat, domes"),
    ],
)
def test_an_unknown_choice_is_refused(stated: dict[str, str], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        choose_ratio([], MODULI, **stated)


def test_an_age_that_few_specimens_reach_is_not_chosen() -> None:
    """The only specimen that was held for .8 s was touched by a level and still hand."""
    moduli = {"soft": 0.3, "middle": 1.0, "firm": 3.0, "held": 6.0}
    tilted = HAND.at(1.5)
    pressers = {name: replace(tilted, hold_s=(0.6, 0.6)) for name in moduli}
    pressers["held"] = replace(HAND, tilt_deg=0.0, hold_s=(5.0, 5.0))
    random = np.random.default_rng(5)
    recordings = {}
    for name, modulus in moduli.items():
        recordings[name] = pressed(DOMES, modulus, [pressers[name]] * 4, random)
    found = choose_ratio(tracks(recordings), moduli, ratio="hold")
    assert found.settings["age"] <= 0.5


# Errors


def error_of(
    ratio: str = "hold", error: float = 0.05, *, touches: int = 40, freedom: int = 30
) -> RatioError:
    return RatioError(ratio, 0.0, error, touches, 10, freedom, np.zeros(1))


def test_the_hold_has_at_least_the_error_of_a_hand() -> None:
    assert error_of("hold", 0.001).expected == 0.03
    assert error_of("hold", 0.05).expected == 0.05
    assert error_of("level", 0.001).expected == 0.001
    assert error_of("hold", 0.001).percent == "0.10 %"
    assert error_of("hold", math.inf).percent == "an unknown amount"


def test_a_better_ratio_is_significantly_better() -> None:
    """With 30 degrees of freedom by 13 %, with many by a tenth; and it has to have its touches."""
    hold = error_of(error=0.05)
    assert error_of("level", 0.043).is_better_than(hold)
    assert not error_of("level", 0.044).is_better_than(hold)
    assert error_of("level", 0.0449, freedom=1000).is_better_than(hold)
    assert not error_of("level", 0.0451, freedom=1000).is_better_than(hold)
    # Of 20 touches: the mean of all presses is as good with an error smaller by sqrt(2).
    assert not error_of("level", 0.034, touches=20, freedom=1000).is_better_than(hold)
    assert error_of("level", 0.031, touches=20, freedom=1000).is_better_than(hold)


def test_the_error_of_a_specimen_left_out_by_leaving_it_out() -> None:
    """By fits without each specimen in turn: the leverages give the same within 5 %."""
    random = np.random.default_rng(6)
    moduli = np.geomspace(0.15, 6.0, 8)
    ratios = 1 + 9 / (1 + 2.0 / moduli)
    groups = {}
    for modulus, ratio in zip(moduli, ratios, strict=True):
        offset = 0.02 * random.standard_normal()
        groups[float(modulus)] = np.log(ratio) + offset + 0.005 * random.standard_normal(4)
    means = np.exp([group.mean() for group in groups.values()])
    squares = []
    for number in range(8):
        kept = np.arange(8) != number
        rows = MeanRatios(means[kept], np.zeros(7), np.full(7, 4.0), np.arange(7))
        fitted = fit_curve(np.log(moduli[kept]), rows, 1.0)
        predicted = curve(fitted.parameters, np.log(moduli[number]))
        squares.append(float(np.log(means[number] / predicted)) ** 2)
    within = float(np.mean([group.var(ddof=1) for group in groups.values()]))
    expected = math.sqrt(within * 3 / 4 + np.mean(sorted(squares)[:-1]))
    error, freedom = prediction_error(groups)
    assert error == pytest.approx(expected, rel=0.05)
    assert freedom == 8 * 3 + 8 - 3


def test_one_wrong_modulus_does_not_decide() -> None:
    random = np.random.default_rng(7)
    moduli = np.geomspace(0.15, 6.0, 8)
    right = {}
    for modulus in moduli.tolist():
        log_ratio = math.log(1 + 9 / (1 + 2.0 / modulus))
        right[modulus] = log_ratio + 0.01 * random.standard_normal(4)
    wrong = {
        modulus * (1.4 if modulus == moduli[3] else 1.0): each for modulus, each in right.items()
    }
    assert prediction_error(wrong)[0] < 4 * prediction_error(right)[0]


def test_the_error_of_few_specimens_is_their_scatter() -> None:
    """Two parameters are fitted: with three specimens the curve shows little."""
    groups = {0.2: np.array([0.0, 0.02]), 1.0: np.array([1.0, 1.02]), 4.0: np.array([2.0, 2.02])}
    error, freedom = prediction_error(groups)
    assert error == pytest.approx(0.02 / 2**0.5)
    assert freedom == 3
    single = {modulus: group[:1] for modulus, group in groups.items()}
    assert prediction_error(single) == (math.inf, 0)


def test_ratios_without_a_curve_have_no_error() -> None:
    """They fall with the modulus."""
    moduli = np.geomspace(0.15, 6.0, 6)
    falling = {float(E): np.log([9.0 - E, 9.1 - E]) for E in moduli}
    assert prediction_error(falling)[0] > 0.1


@pytest.mark.parametrize("factor", [0.2, 0.7, 2.0])
def test_the_share_of_the_errors_that_shows(factor: float) -> None:
    """By touches with errors of .2 to 3 %, whose scatter has no other reason."""
    random = np.random.default_rng(2)
    groups = []
    for _ in range(50):
        errors = np.geomspace(0.002, 0.03, 4)
        logs = 1.4 + factor * errors * random.standard_normal(4)
        groups.append([evidence_with(*values) for values in zip(logs, errors, strict=True)])
    # 150 degrees of freedom: 6 %; in steps of .05
    assert error_share(groups, 0) == pytest.approx(min(factor, 1.0), rel=0.2)


def test_few_touches_have_their_whole_errors() -> None:
    pair = [evidence_with(1.4, 0.1), evidence_with(1.41, 0.1)]
    assert error_share([pair, pair[:1]], 0) == 1.0
    assert error_share([], 0) == 1.0


def evidence_with(log_ratio: float, error: float) -> TouchEvidence:
    return TouchEvidence(np.array([log_ratio]), np.zeros(1), 0.0, error, 1.0, 0.3)


def test_what_does_not_exclude_a_touch() -> None:
    assert objections(example_touch("tilt", "changed", "short")) == ()
    assert objections(example_touch("offset", "drift", "creep")) == ("offset", "drift", "creep")
    bent = example_touch("offset", "drift", "creep", "curve", level_ratio=4.0)
    assert objections(bent, ratio_of=level_ratio) == ("drift", "creep", "curve")
    assert objections(example_touch("drift", "creep", "short", age_s=1.3)) == ("short",)
    assert objections(example_touch(), ratio_of=level_ratio) == ("no level ratio",)


def test_calibrate_replay_and_report_follow_the_choice(tilted: Path) -> None:
    printed = (tilted / "printed.txt").read_text()
    probe = tilted / "probe.toml"
    gel = tilted / "gel" / "gel.csv"
    assert re.search(
        r"^ratio: level: its error on a specimen left out is 0\.\d\d %; hold \d\.\d %$",
        printed,
        re.MULTILINE,
    )
    assert re.search(
        r"^contact exponent: 1: repeated touches scatter least with 1$", printed, re.MULTILINE
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
        ratio, error = found.ratio_of(touch)
        assert ratio == touch.level_ratio
        # With what the tilt costs: 2 % of it, and more of an unusual one.
        tilt = abs(math.log(touch.ratio / touch.level_ratio))
        own = found.error_share * touch.level_standard_error / ratio
        assert math.hypot(own, 0.02 * tilt) * 0.999 < error / ratio
        assert error / ratio < own + 0.05 * tilt + 0.001
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
    probe = tilted / "probe.toml"
    gel = tilted / "gel" / "gel.csv"
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
    block = blank(len(whole.hard))
    block["t_hard_ns"] = np.rint(1e9 * whole.t_hard_s)
    block["t_soft_ns"] = np.rint(1e9 * whole.t_soft_s)
    block["hard"] = whole.hard
    block["soft"] = whole.soft
    write_session(tmp_path / "all", {"run": block}, {"run": 1.0})
    path = tmp_path / "all" / "run.csv"
    touches = iter(enumerate(palpate.touches(palpate.read(path)), 1))
    known = [
        KnownSpecimen(str(E), E, tuple((*next(touches), True) for _ in range(4)))
        for E in (one.label_MPa for one in touched)
    ]
    used = list[Calibration]()
    plan = SimpleNamespace(
        known=lambda: known,
        progress=SimpleNamespace(),
        note=str,
        operator="",
        document=SimpleNamespace(operator=None, title=""),
        rows=(),
        on_changed=[],
        use_calibration=used.append,
    )
    watch: Any = SimpleNamespace(chips=set(), simulated=None, begun_at=present_time())
    for recorder in (SimpleNamespace(path=path), None):
        bench = SimpleNamespace(
            files=RunFiles(folder=tmp_path),
            settings={},
            hand=None,
            newest_recorder=recorder,
            use=lambda *_: None,
        )
        GuidedCalibration(bench, plan, watch).save_calibration()  # type: ignore[arg-type]
    assert [found.ratio for found in used] == ["level", "hold"]
    assert used[0].age_s > 0
    assert len(used[0].ratios) >= 36
    assert used[0].possible_exponents[1] == 1.5
