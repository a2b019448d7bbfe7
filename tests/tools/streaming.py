"""Samples of a scenario, as a source would give them to a stream."""

from palpate import Sample, Status
from palpate.simulation import scenarios


def four(seed: int = 1) -> list[Sample | Exception]:
    """Return a scenario's samples, as a source would give them, with some that have no value."""
    run = scenarios.run("four-specimens", seed)
    rows: list[Sample | Exception] = []
    for i, (th, ts, h, s, hr, sr) in enumerate(
        zip(run.t_hard_s, run.t_soft_s, run.hard, run.soft, run.hard_raw, run.soft_raw, strict=True)
    ):
        if i % 97 == 5:
            continue
        flag = {17: Status.EXCITATION, 31: Status.HARD_SATURATED}.get(i % 101, Status.OK)
        rows.append(Sample(i, round(th * 1e9), round(ts * 1e9), int(hr), int(sr), float(h), float(s), flag))
    return rows
