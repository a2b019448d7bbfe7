"""The wiring of a board source: its options, each mistake in words, wires that come off, and no false alarm."""

import re
from pathlib import Path
from typing import Any

import palpate
import pytest
from command_lines import run
from effort import NIGHTLY
from palpate.ad7746.configuration import Configuration
from palpate.ad7746.simulator.chip import WIRINGS
from palpate.ad7746.wiring import InputCapacitance, Wiring
from palpate.errors import DeviceRefused
from palpate.flags import Suspicion
from palpate.samples import Sample, Status
from palpate.simulation.board_input import board_scenarios
from palpate.source_events import GapCause
from palpate.sources.board import ConverterOptions
from recording_bench import SampleReader

SHORT = "sim:tap"
DEMO = "the board's own length sensor, connected until R1 and R2 are removed"
# wiring -> parts of the message of the default options; those that cannot be measured.
REFUSED = {
    "exca": [
        "CIN1+ (socket P4) has 0.003 pF on EXCB, about 6.7 pF on EXCA: use excitation=A (as",
        "soft bump: CIN2+",
    ],
    "hard-exca": [
        "hard bump: CIN1+ (socket P4) has",
        "about 6.7 pF on EXCA: use excitation=A,B (as in usb:",
    ],
    "soft-exca": [
        "soft bump: CIN2+ has 0.003 pF on EXCB, about 4.4 pF on EXCA: use excitation=B,A (as in",
        DEMO,
    ],
    "demo-exca": ["use excitation=A (as in usb:?excitation=A)", "about 5.8 pF on EXCA", DEMO],
    "demo-alone": ["soft bump: CIN2+ has 0.003 pF on EXCB, 1.400 pF on EXCA", DEMO],
    "hard-minus": [
        "hard bump: CIN1+ (socket P4)",
        "its wire is at CIN1- (socket P3): move it to CIN1+",
    ],
    "hard-open": [
        "hard bump: CIN1+ (socket P4)",
        "nothing is connected: look at its wires, one to CIN1+, the other to EXCB",
    ],
    "soft-open": ["soft bump: CIN2+", "nothing is connected", "no socket for CIN2+ (P6)"],
    "open": [
        "no probe is connected",
        "wire the hard bump to CIN1+ and EXCB, the soft bump to CIN2+ and EXCB",
    ],
    "hard-shorted": ["hard bump: CIN1+ (socket P4) has more than 17 pF on EXCB: look for a short"],
    "soft-shorted": ["soft bump: CIN2+ has more than 17 pF on EXCB: look for a short"],
    "excb-shorted": ["EXCB (socket P2) is shorted or overloaded (the chip reports EXCERR)"],
}
MEASURED = {"demo": [f"1.400 pF on EXCA and about 4.4 pF on EXCB, {DEMO}", "on EXCB goes on"]}
# EXCA is not driven; swapped needs a press
QUIET = {"guide", "swapped", "exca-shorted", "differential"}


def begun(uri: str, **options: Any) -> tuple[float, list[str], str]:
    """Begin a measurement; return its time, s, what was said, and the refusal."""
    source: Any = palpate.open(uri, **options)
    said, refusal, begin = list[str](), "", source.clock.now_ns()
    source.notify = said.append
    try:
        source.__enter__()
        source.close()
    except DeviceRefused as error:
        refusal = str(error)
    return (source.clock.now_ns() - begin) / 1e9, said, refusal


@pytest.mark.parametrize("wiring", WIRINGS)
def test_every_mistake_is_named_at_the_begin(wiring: str) -> None:
    assert QUIET | set(REFUSED) | set(MEASURED) == set(WIRINGS)
    took_s, said, refusal = begun(f"{SHORT}?wiring={wiring}")
    assert [part for part in REFUSED.get(wiring, []) if part not in refusal] == []
    assert [part for part in MEASURED.get(wiring, []) if part not in " ".join(said)] == []
    assert (bool(refusal), bool(said), took_s < 1.0) == (
        wiring in REFUSED,
        wiring in MEASURED,
        True,
    )


def ratio_of(wiring: str, **options: Any) -> float:
    """Return the ratio of the changes in a press, 8.3 if it is measured right."""
    with palpate.open(f"sim:stiff-steady?wiring={wiring}&seed=1", **options) as source:
        pairs = [
            (sample.hard, sample.soft)
            for sample, _ in zip(SampleReader(source), range(150), strict=False)
        ]
    return (pairs[-1][0] - pairs[0][0]) / (pairs[-1][1] - pairs[0][1])


@pytest.mark.parametrize("excitation", ["A", "B", "AB", "A,B", "B,A"])
@pytest.mark.parametrize("wiring", WIRINGS)
def test_an_option_that_is_named_gives_the_true_ratio(wiring: str, excitation: str) -> None:
    right = {"hard_input": 2 if wiring == "swapped" else 1}
    _, said, refusal = begun(f"{SHORT}?wiring={wiring}", excitation=excitation, **right)
    named = set(re.findall("use excitation=([AB,]+)", " ".join([*said, refusal])))
    assert len(named) <= 1
    for option in named:
        assert ratio_of(wiring, excitation=option, **right) == pytest.approx(
            ratio_of("guide"), rel=0.05
        )
    # the length sensor alone: it cannot be told from a small bump
    if "may not be connected" in " ".join(said):
        assert wiring == "demo-alone"
    elif not refusal:
        assert ratio_of(wiring, excitation=excitation, **right) == pytest.approx(
            ratio_of("guide"), rel=0.05
        )


def test_a_short_at_the_other_excitation_is_not_an_open_input() -> None:
    for wiring in ("hard-shorted", "soft-shorted", "excb-shorted"):
        refusal = begun(f"{SHORT}?wiring={wiring}", excitation="A")[2]
        assert ("nothing is connected" in refusal, "short" in refusal) == (False, True)


def test_a_bump_at_the_negative_input_is_named_with_differential_too() -> None:
    refusal = begun(f"{SHORT}?wiring=hard-minus", differential="yes")[2]
    assert "its wire is at CIN1- (socket P3): exchange its wires at CIN1+ and CIN1-" in refusal
    exchanged = {("1+", "B"): 2.0, ("1-", "B"): 6.9, ("2+", "B"): 4.7, ("2-", "B"): 1.5}
    look = lambda name, pin: InputCapacitance(exchanged.get((name, pin), 0.003))
    [found] = Wiring(look, Configuration(differential=True), kit=True).mistakes()
    expected = "hard bump: CIN1+ minus CIN1- is -4.90 pF: exchange its wires at CIN1+ an"
    assert (str(found)[: len(expected)], found.fatal) == (expected, False)


def test_a_sentence_says_what_excitation_a_cannot_show() -> None:
    said = begun(f"{SHORT}?wiring=exca&excitation=A")[1]
    assert said == [
        f"soft bump: EXCA also drives {DEMO}: remove them; the readings cannot show whether they are there"
    ]
    _, said, _ = begun(f"{SHORT}?wiring=demo&excitation=B,AB")
    assert [
        f"{DEMO}: remove them, or use excitation=B (as in usb:?excitation=B)" in text
        for text in said
    ] == [True]
    assert begun(f"{SHORT}?wiring=guide&excitation=AB")[1] == []  # nothing is on EXCA


def test_the_registers_of_the_options() -> None:
    options = {
        "excitation": "A,AB",
        "level": 1,
        "chop": True,
        "differential": True,
        "soft_input": 1,
    }
    configuration = ConverterOptions.parse("sim", options).configuration
    assert [configuration.registers(number)[0].hex() for number in (0, 1)] == [
        "e1000902",
        "a1002902",
    ]
    assert ConverterOptions().configuration == Configuration()


def test_record_says_in_words_what_is_wrong(tmp_path: Path) -> None:
    """It ends if a wire is wrong, and goes on, with a sentence beside the touch, if the inputs are swapped."""
    refused, swapped = (
        run("record", f"sim:stiff-steady?wiring={name}&seed=1", "-o", tmp_path / f"{name}.csv")
        for name in ("exca", "swapped")
    )
    assert (refused.exit_code, all(part in refused.stderr for part in REFUSED["exca"])) == (3, True)
    assert (
        swapped.exit_code,
        swapped.stdout.count("touch 1: swapped: the soft channel changed more"),
    ) == (0, 1)
    assert [path.name for path in tmp_path.glob("*.csv")] == ["swapped.csv"]


@pytest.mark.parametrize(
    ("fault", "text"),
    [
        (
            "wire-off:1@3",
            "hard bump: CIN1+ has 0.003 pF on EXCB: its wire is off: look at CIN1+ and EXCB",
        ),
        ("excitation-shorted:1000@3", "soft bump: EXCB is shorted or overloaded (EXCERR)"),
    ],
)
def test_a_wire_that_comes_off_is_told_and_marked_within_5_s(fault: str, text: str) -> None:
    with palpate.open(f"sim:soft-steady?fault={fault}") as source:
        samples = SampleReader(source)
        first = next(sample for sample in samples if samples.gaps)
    assert 3.0 < first.t_hard_ns / 1e9 < 5.0  # of 8 allowed
    [(seq, gap_text)] = samples.gaps
    assert (seq, text in gap_text, samples.causes) == (first.seq, True, [GapCause.WIRING])


def test_a_wire_that_is_put_on_again_is_told() -> None:
    with palpate.open("sim:soft-steady?fault=wire-off:2@3,wire-off:0@6") as source:
        samples = SampleReader(source)
        last: Sample = list(samples)[-1]
    (_, off), (_, back) = samples.gaps
    assert ("its wire is off" in off, back) == (True, "soft bump: it is measured again")
    assert last.status == Status.OK


def test_a_converter_that_repeats_itself_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    source: Any = palpate.open("sim:soft-steady")
    with source:
        source.kit.chip.noisy = False
        monkeypatch.setattr(source.kit.chip, "_bumps", lambda bump, begin_s, end_s: 5.0)
        samples = SampleReader(source)
        list(zip(samples, range(60), strict=False))
    [(_, text)] = samples.gaps
    assert text.count("bump: every reading is the same: the converter does not measure") == 2


@pytest.mark.parametrize("overload", ["9", "-9"])
def test_a_signal_that_leaves_the_range_is_not_a_wire(overload: str) -> None:
    """The look shows that the input is not empty: what was added is there, too."""
    with palpate.open(f"sim:soft-steady?fault=overload:{overload}@3") as source:
        samples = SampleReader(source)
        assert {sample.status for sample in samples} != {Status.OK}
    assert samples.gaps == []


@pytest.mark.parametrize(
    "name", list(board_scenarios()) if NIGHTLY else ["bursts", "saturating", "lost-10"]
)
def test_no_false_alarm(name: str) -> None:
    """Right wiring: no message at the begin, while measuring, or beside a touch."""
    for seed in range(5 if NIGHTLY else 1):
        said: list[str] = []
        source = palpate.open(f"sim:{name}?seed={seed + 1}")
        source.notify = said.append
        with source:
            samples = SampleReader(source)
            assert all(sample.seq >= 0 for sample in samples)
        assert said == []
        assert [text for _, text in samples.gaps if "bump" in text] == []
        touches = palpate.touches(palpate.simulation.run(name, seed + 1))
        assert not [
            text
            for touch in touches
            for text in palpate.advice(touch)
            if text.flag is Suspicion.SWAPPED
        ]
