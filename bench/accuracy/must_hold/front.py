"""The steady error of the scene handheld on each scenario, beside the best of all other rows: at most 1.1 times that.

The others know when the press begins, and each is made for one case: the sums for a ratio that stays, the random walk for
one that moves. No row of later readings counts: offline results are compared with each other (theme offline). The error is
the median over the seeds; that of the rms is printed beside it, in which each press counts that is lost or found late.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from palpate import benchmark

from bench.accuracy.must_hold.row import Row
from bench.peers import PEERS
from bench.rivals import OFFLINE

TIMES = 1.1
OWN = ("handheld scene", "sliding scene")
_DRIFT = (
    "A baseline that drifts in the touch is, until the release, a ratio that moves: what forgets nothing averages it, what "
    "follows it is wrong by all of it. The result after the release is corrected."
)
REASONS = {
    "slow-drift": "The baselines drift against the ratio, and what lags is nearer by chance: see slow-drift-back, where they drift "
    "the other way. The flag drift says so.",
    "tilt-walk": "The ratio is a random walk, for which the Kalman filter is made; its error where the ratio stays is twice as large.",
    **dict.fromkeys(("drift-hard", "drift-soft", "drift-both", "thermal"), _DRIFT),
    "wander": "A baseline that wanders in the touch: the longer the memory, the more of it is averaged.",
    "jump": "A jump of a baseline is a step of the ratio until the release, and followed; the result after it is corrected.",
    "creep": "The soft bump creeps: C1 / C2 moves, the ratio does not. The longer the memory, the nearer; the touch is flagged.",
    "bursts": "A burst of noise, 20 times as large, is an alarm: the estimate begins anew, with samples of the burst.",
    "fast-converter": "The error is that of the baseline, a mean with a memory of 64 readings; the others know that of 2,000 readings.",
}
"""Scenario -> why another row is better there."""


@dataclass(frozen=True)
class Compared:
    """The row of handheld on one scenario, and the best of the others.

    Attributes
    ----------
    hand, best : palpate.benchmark.Row
    rms_times : float
        As `times`, of the rms over all seeds, in which a lost press counts.
    """

    hand: benchmark.Row
    best: benchmark.Row
    rms_times: float

    @property
    def times(self) -> float:
        """How many times the error of the best other row that of handheld is."""
        return self.hand.rmse / self.best.rmse


def compare(rows: Sequence[benchmark.Row]) -> Compared:
    """Compare handheld with the other rows of one scenario, without the scene sliding and the offline row.

    Without the other libraries, too: they compute fixed 0.995, and are run with fewer seeds.
    """
    [hand] = (row for row in rows if row.estimator == OWN[0])
    others = [row for row in rows if row.estimator not in (*OWN, OFFLINE, *PEERS)]
    return Compared(hand, min(others, key=lambda row: row.rmse), hand.rms / min(row.rms for row in others))


def of_table(table: Iterable[benchmark.Row]) -> Iterator[Row]:
    """Return one row for each scenario."""
    rows = list(table)
    for name in dict.fromkeys(row.scenario for row in rows):
        yield row_of(compare([row for row in rows if row.scenario == name]), REASONS.get(name, ""))


def row_of(found: Compared, reason: str = "") -> Row:
    """Return the row of one scenario."""
    hand, best, times = found.hand, found.best, found.times
    beside = f"{100 * hand.rmse:.2g} %; "
    if times > 1:
        beside += f"best: {best.estimator} {100 * best.rmse:.2g} %, handheld is {times:.2f} times that"
    else:
        beside += f"the best; then {best.estimator} {100 * best.rmse:.2g} %"
    beside += f"; rms over all seeds: {found.rms_times:.3g} times"
    name = f"{hand.scenario}: steady rmse, handheld / best of the others"
    return Row(name, times, TIMES, "", beside=beside, reason=reason)
