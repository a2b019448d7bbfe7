"""The steady error of the scene handheld on each scenario, beside the best of all other rows: at most 1.1 times that.

The others know when the press begins, and each is made for one case: the sums for a ratio that stays, the random walk for
one that moves. No row of later readings counts: offline results are compared with each other (theme offline).
"""

from collections.abc import Iterable, Iterator

from palpate import benchmark

from bench.accuracy.must_hold.row import Row
from bench.rivals import OFFLINE

TIMES = 1.1
OWN = ("handheld scene", "sliding scene")
_DRIFT = (
    "A baseline that drifts in the touch looks like a ratio that moves: what forgets nothing averages it, what follows it is "
    "wrong by all of it. The result after the release is corrected."
)
_MOVES = (
    "The ratio moves all the time; a memory of tens of pairs follows it, and has several times the error where it stays."
)
_MODEL = "The readings do not follow C1 = r C2, and the touch has a flag: any error between the rows is chance of the memory."
REASONS = {
    "slow-drift": _MOVES,
    "tilt-ramp": _MOVES,
    "rocking": _MOVES,
    "tilt-walk": _MOVES,
    "relaxing": _MOVES,
    "creep": "The soft bump creeps, so C1 / C2 moves and the ratio does not: the longer the memory, the nearer to the truth.",
    "lag": _MODEL,
    "drift-hard": _DRIFT,
    "drift-soft": _DRIFT,
    "drift-both": _DRIFT,
    "wander": _DRIFT,
    "thermal": _DRIFT,
    "jump": "A jump of a baseline is taken for a step of the ratio, and followed; the result after the release is corrected.",
    "bursts": "A burst of noise, 20 times as large, is an alarm: the estimate begins anew with what is in the burst.",
    "fast-converter": "1,000 pairs a second: forgetting 0.995 for each pair is a memory of 0.2 s; the sums forget nothing.",
}
"""Scenario -> why another row is better there."""


def best_of(rows: Iterable[benchmark.Row]) -> benchmark.Row:
    """Return the row with the least error of one scenario, without the scenes handheld and sliding and the offline row."""
    return min((row for row in rows if row.estimator not in (*OWN, OFFLINE)), key=lambda row: row.rmse)


def of_table(table: Iterable[benchmark.Row]) -> Iterator[Row]:
    """Return one row for each scenario."""
    rows = list(table)
    for name in dict.fromkeys(row.scenario for row in rows):
        here = [row for row in rows if row.scenario == name]
        [hand] = (row for row in here if row.estimator == OWN[0])
        yield compared(hand, best_of(here), REASONS.get(name, ""))


def compared(hand: benchmark.Row, best: benchmark.Row, reason: str = "") -> Row:
    """Return the row of one scenario."""
    times = hand.rmse / best.rmse
    beside = f"{100 * hand.rmse:.2g} %; "
    if times > 1:
        beside += f"best: {best.estimator} {100 * best.rmse:.2g} %, handheld is {times:.2f} times that"
    else:
        beside += f"the best; then {best.estimator} {100 * best.rmse:.2g} %"
    name = f"{hand.scenario}: steady rmse, handheld / best of the others"
    return Row(name, times, TIMES, "", beside=beside, reason=reason)
