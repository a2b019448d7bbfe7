"""The sketch of cpp/examples/arduino on a simulated Uno with a simulated AD7746, which is recorded."""

from collections.abc import Iterable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from effort import NIGHTLY, Tally, random_of
from numpy.typing import NDArray
from palpate.ad7746.registers import SATURATED_CODES
from palpate.samples import Status
from project import need

pytest.importorskip("pty")

from arduino import uno

PAIRS = 10_000 if NIGHTLY else 300
# idle gauges, a step: chip.hpp
CAPDAC = {"capdac_hard": int(6.92 / 0.171), "capdac_soft": int(4.69 / 0.171)}
UNTOUCHED = 140  # pairs before the first press, at 4 s


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build the sketch, which must stay small, and the board."""
    for needed in uno.NEEDED:
        need(needed)
    folder = tmp_path_factory.mktemp("arduino")
    uno.build(folder)
    flash, ram = uno.bytes_of(folder / "sketch.elf")
    assert (flash <= 8000, ram <= 600) == (True, True), (flash, ram)
    return folder


def of(made: Any, channel: int, first_code: int, count: int) -> Any:
    """Return conversions of an input, beginning with a code."""
    mine = made[made["input"] == channel]
    begin = np.flatnonzero(mine["code"] == first_code)[0]
    return mine[begin : begin + count]


def test_every_pair_is_recorded_with_its_codes_and_times(
    built: Path, tmp_path: Path, tally: Tally
) -> None:
    rows = uno.record(built, tmp_path, PAIRS)[:PAIRS]
    assert rows["seq"].tolist() == list(range(PAIRS))
    assert set(rows["status"]) == {0}
    late_us = []
    for channel, name in ((1, "hard"), (2, "soft")):
        made = of(uno.conversions(tmp_path), channel, rows[f"{name}_raw"][0], PAIRS)
        assert rows[f"{name}_raw"].tolist() == made["code"].tolist()
        late_us.append(rows[f"t_{name}_s"] * 1e6 - made["middle_us"])
    differences = np.ptp(late_us)  # up to a constant: the two clocks begin at other moments
    assert differences < 1000
    assert np.max(np.abs(late_us[1] - late_us[0])) <= np.max(rows["t_uncertainty_us"]) < 2000
    tally.say(
        f"Arduino sketch: {PAIRS} pairs, all recorded, codes equal, times within {differences:.0f} us"
    )


def test_what_goes_wrong_is_said_and_repaired(built: Path, tmp_path: Path) -> None:
    """No chip at first; then EXCERR, an input out of range, the end of micros(), no chip for a while."""
    events = ("absent=0:0.4", "overloaded=1.5:1.7", "beyond=2:2.2", "micros=2.5")
    with uno.board(built, tmp_path, 100, *events) as port:
        said = list(uno.lines(port, 100))
    assert [line for line in said if not line.startswith("seq=")] == [
        "",
        "# AD7746 at 0x48: no answer, or not as set. Check VDD, GND, SDA, SCL. It is tried again.",
        "# AD7746, CAPF 0, excitation EXCB for both inputs, level 3: +-VDD/2",
        "# hard, CIN1: CAPDAC 40, code 8552462",
        "# soft, CIN2: CAPDAC 27, code 8538101",
        "# AD7746 answers again",
    ]
    pairs = pairs_of(said)
    assert numbers(said) == list(range(100))
    assert {pair["status"] for pair in pairs} == {
        0,
        int(Status.EXCITATION),
        int(Status.SOFT_SATURATED),
    }
    assert pairs[-1]["t_soft_us"] < pairs[0]["t_soft_us"]
    made = of(uno.conversions(tmp_path), 1, pairs[0]["hard_raw"], 100)
    since_us = [(pair["t_hard_us"] - pairs[0]["t_hard_us"]) % 2**32 for pair in pairs]
    assert since_us == pytest.approx(list(made["middle_us"] - made["middle_us"][0]), abs=1000)


def pairs_of(said: Iterable[str]) -> list[dict[str, int]]:
    return [uno.fields(line) for line in said if line.startswith("seq=")]


def numbers(said: Iterable[str]) -> list[int]:
    return [pair["seq"] for pair in pairs_of(said)]


def assert_true(pairs: list[dict[str, int]], made: NDArray[Any]) -> list[list[float]]:
    """Check each code and time by the conversion that was nearest; both clocks begin at the reset.

    Return the middles, s, shape (2, n).
    """
    middles: list[list[float]] = [[], []]
    for channel, name in enumerate(("hard", "soft")):
        mine = made[made["input"] == channel + 1]
        for pair in pairs:
            late_us = pair[f"t_{name}_us"] - mine["middle_us"]
            nearest = np.argmin(np.abs(late_us))
            assert (abs(late_us[nearest]) < 1000, pair[f"{name}_raw"]) == (
                True,
                mine["code"][nearest],
            )
            middles[channel].append(float(mine["middle_us"][nearest]) / 1e6)
    return middles


def test_one_failure_is_a_gap_and_two_begin_again(built: Path, tmp_path: Path) -> None:
    with uno.board(
        built, tmp_path, 60, "absent=1.0:1.01", "garbled=1.3:1.32", "beyond=0:9"
    ) as port:
        short = list(uno.lines(port, 60))
    assert sorted(np.diff(numbers(short))) == [1] * 57 + [2, 2]
    assert_true(pairs_of(short), uno.conversions(tmp_path))
    assert "# out of range: more than 17 pF, less than 0 pF, or a short" in short
    with uno.board(built, tmp_path, 60, "absent=1.0:1.5") as port:
        long = list(uno.lines(port, 60))
    first = numbers(long).index(0, 1)
    assert numbers(long) == [*range(first), *range(60 - first)]
    assert [line[:24] for line in long if "answer" in line] == [
        "# AD7746 at 0x48: no ans",
        "# AD7746 answers again",
    ]
    assert_true(pairs_of(long), uno.conversions(tmp_path))


def test_the_letter_c_centres_again(built: Path, tmp_path: Path) -> None:
    """While the probe is pressed: the hard channel moves by more than a step."""
    # pressed; waits for the letter
    with uno.board(built, tmp_path, UNTOUCHED + 60, "await=4.75") as port:
        pairs = pairs_of(uno.lines(port, UNTOUCHED + 60, UNTOUCHED + 20))
    assert_true(pairs, uno.conversions(tmp_path))
    again = [pair["seq"] for pair in pairs].index(0, 1)
    assert all(CAPDAC.items() <= pair.items() for pair in pairs[:again])
    [moved] = {pair["capdac_hard"] for pair in pairs[again:]}
    assert moved in {int((6.92 + 0.625 * tremor) / 0.171) for tremor in (0.95, 1.05)}


@pytest.mark.parametrize("seed", range(60 if NIGHTLY else 2))
def test_any_faults(built: Path, tmp_path: Path, seed: int) -> None:
    """No pair is wrong, whatever fails and when; what the chip tells is in the status."""
    rng = random_of(f"arduino {seed}")
    begins = {name: rng.uniform(0, 3) for name in ("absent", "garbled", "overloaded", "beyond")}
    spans = {
        name: (begin, begin + rng.choice([0.005, 0.02, 0.1, 0.5])) for name, begin in begins.items()
    }
    with uno.board(
        built, tmp_path, 90, *(f"{name}={begin}:{end}" for name, (begin, end) in spans.items())
    ) as port:
        pairs = pairs_of(uno.lines(port, 90))
    for pair, *both in zip(pairs, *assert_true(pairs, uno.conversions(tmp_path)), strict=True):
        failed = any(spans["overloaded"][0] <= middle < spans["overloaded"][1] for middle in both)
        saturated = (
            pair["soft_raw"] > 0xFFFFFF - SATURATED_CODES or pair["soft_raw"] < SATURATED_CODES
        )
        assert pair["status"] == Status.EXCITATION * failed + Status.SOFT_SATURATED * saturated
    assert all(
        after > before or after == 0 for before, after in pairwise(pair["seq"] for pair in pairs)
    )
