"""What the capacitance of each input with each excitation says about the wiring."""

import math
from typing import NamedTuple

from palpate.ad7746.configuration import HARD, NAMES, SOFT
from palpate.kit.bench import CONNECTED_PF, EXCITATIONS, Bench
from palpate.kit.chip import Level

_RANGE = "17 pF"
_OWN_SENSOR_PF = 0.2  # more than what open wires near each other have


class Fault(NamedTuple):
    """A mistake of the wiring: what it is, and what to do."""

    what: str
    do: str


def faults(bench: Bench) -> list[Fault]:
    """Return the mistakes that the levels show, for the options of the source.

    Swapped inputs are not among them: both are connected. Only a press shows which one is the hard bump.
    """
    found: list[Fault] = []
    for channel in (HARD, SOFT):
        pin = bench.pin(channel)
        wanted = bench.configuration.channel(channel).excitation
        found += [fault for name in wanted for fault in _short(pin, name, bench.levels[pin, name])]
        if not any(math.isnan(bench.levels[pin, name].pF) for name in wanted):
            found += _connection(bench, channel, wanted)
    return list(dict.fromkeys(found))


def _short(pin: int, excitation: str, level: Level) -> list[Fault]:
    if level.error:
        return [Fault(
            f"EXC{excitation} is shorted or overloaded (EXCERR)",
            f"pull the probe's plug off EXC{excitation}: if this goes away, the cable or the probe shorts EXC{excitation} to "
            "the shield",
        )]  # fmt: skip
    if math.isnan(level.pF):
        return [Fault(
            f"CIN{pin} is out of range with EXC{excitation}: more than {_RANGE}, or shorted",
            f"pull the probe's plug off CIN{pin}+: if it then reads about 0 pF, the cable or the probe shorts CIN{pin} to "
            f"EXC{excitation}",
        )]  # fmt: skip
    return []


def _connection(bench: Bench, channel: int, wanted: str) -> list[Fault]:
    pin = bench.pin(channel)
    answers = [name for name in EXCITATIONS if bench.answers(pin, name)]
    if not answers:
        return [_nothing(bench, channel, wanted)]
    if not set(answers) & set(wanted):
        return [_other_excitation(bench, channel, wanted, answers[0])]
    if pin == 2 and "A" not in wanted and abs(bench.levels[2, "A"].total_pF) > _OWN_SENSOR_PF:
        return [Fault(
            "CIN2 answers to EXCA, too: the board's own length sensor is on it",
            "take the resistors R1 and R2 off the board",
        )]  # fmt: skip
    return []


def _nothing(bench: Bench, channel: int, wanted: str) -> Fault:
    pin, bump = bench.pin(channel), f"the {NAMES[channel]} bump"
    for name in EXCITATIONS:
        if (minus := bench.minus_pF.get((pin, name), 0.0)) > CONNECTED_PF:
            what = f"{bump} is on CIN{pin}-: {minus:.2f} pF with EXC{name}"
            return Fault(what, f"move its wire from CIN{pin}- to CIN{pin}+")
    return Fault(
        f"nothing is connected to CIN{pin} ({bump})",
        f"connect {bump} between CIN{pin}+ and EXC{wanted[-1]}; check the plugs and the cable",
    )


def _other_excitation(bench: Bench, channel: int, wanted: str, answer: str) -> Fault:
    pin = bench.pin(channel)
    both = [answer if number == channel else bench.excitation(bench.pin(number)) for number in (HARD, SOFT)]
    option = both[0] if both[0] == both[1] else ",".join(both)
    own = "; or, with R1 and R2 still on the board, this is its own length sensor: take them off" if pin == 2 else ""
    return Fault(
        f"CIN{pin} ({NAMES[channel]} bump) answers to EXC{answer}, not to EXC{wanted}",
        f"move its wire from EXC{answer} to EXC{wanted}, or add excitation={option} to SOURCE{own}",
    )


def shown(level: Level) -> str:
    """Return a level in words.

    Examples
    --------
    >>> shown(Level(42, 0.03)), shown(Level(0, 0.0021)), shown(Level(0, float("nan"), True))
    ('6.92 pF', '0.002 pF', 'shorted')
    """
    if level.error:
        return "shorted"
    if math.isnan(level.pF):
        return "out of range"
    return f"{level.total_pF:.2f} pF" if abs(level.total_pF) >= 0.1 else f"{level.total_pF:.3f} pF"
