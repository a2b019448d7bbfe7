"""The rows of the bench lab: the worlds of each, and the limits that palpate must keep in them."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

from bench.accuracy.lab_scores import NEW_FLAGS, Limit, Measure
from bench.accuracy.lab_worlds import (
    Autoregressive,
    BaselineStep,
    Breathing,
    Channel,
    Drift,
    Falling,
    Fault,
    Flicker,
    Frozen,
    Jump,
    LooseWire,
    Moment,
    OneChannel,
    Outliers,
    Part,
    Presser,
    Rail,
    StepInPress,
    Walk,
    World,
)

_BURST = "two or three false readings in a row are most of the five that judge them"
_COARSE = "a stage that stops, printed far more coarsely than its noise, looks as a rail does"
_EARLY = (
    "4 decimals have not shown yet how often they stand still; each of these touches has a flag"
)
_SMALL = "less than a hand moves meanwhile: all are flagged, half of them are named"
_BREATH = (
    "a breath of 1 fF begins a touch by itself now and then, and a press at once after it is lost"
)
_WALK = "a walk begins a touch by itself now and then: one press of 60 was lost"

_PRICE = "screen, levels and slow noise double the work of a pair in a block"

KNOWN: dict[str, str] = {
    "price": _PRICE,
    "readings: 20 % of hard at its baseline, alone": _BURST,
    "readings: 20 % of soft at its baseline, alone": _BURST,
    "readings: 15 % of soft at its baseline, up to 3 in a row": _BURST,
    "readings: 20 % of soft at its baseline, up to 3 in a row": _BURST,
    "saturated: healthy: stage, 2 decimals": _COARSE,
    "frozen: from 1.5 s on": _EARLY,
    "step: 0.02 pF in the hold": _SMALL,
    **{
        f"slow noise: breathing, {rate} pairs/s, {depth} pF": _BREATH
        for rate in (38, 115, 1000)
        for depth in (0.05, 0.25)
    },
    "slow noise: walk, 1000 pairs/s, 0.05 pF": _WALK,
    "slow noise: walk, 1000 pairs/s, 0.25 pF": _WALK,
}
"""Theme and name of a row that is known not to hold, "theme: name" -> the reason, a sentence."""

CHANNELS: tuple[OneChannel, ...] = ("hard", "soft")
HARD_SOFT_OR_BOTH: tuple[Channel, ...] = ("hard", "soft", "both")
SIDES: tuple[tuple[float, str], ...] = ((1.0, "up"), (-1.0, "down"))
HAND = World()
NONE_LOST = Limit(Measure.LOST, high=0.0)
FEW_SILENT = Limit(Measure.SILENT, high=0.03)
CALLED: dict[Presser, float] = {"hand": 0.002, "stage": 0.002, "relaxing": 0.15}
"""Healthy presses, printed coarsely, that may be called saturated."""
KNOWN_ENDS_pF = (4.096, 8.192, 15.0)
BANDS_Hz = ((3.0, 12.0), (4.0, 5.0), (6.0, 7.0), (8.0, 9.0), (10.0, 10.5))
RATES = (38.46, 80, 115, 320, 1000)
NO_FALSE_FLAG = Limit(Measure.FLAGGED, high=0.002)
BAD_READINGS = (FEW_SILENT, Limit(Measure.COVERED, low=0.88), NONE_LOST)
IN_HOLD = (Limit(Measure.NAMED, low=0.80), Limit(Measure.NOTED, low=1.0), FEW_SILENT)
SATURATED = frozenset({"saturated", "frozen"})
JUMPED = frozenset({"jumped"})
STEPPED = frozenset({"step", "jumped"})


@dataclass(frozen=True)
class Compared:
    """How much larger the error and the median half-width may be than the stored ones."""

    error: float
    half_width: float

    def __str__(self) -> str:
        """Return the limit as text."""
        return f"error <= {self.error:g} and width <= {self.half_width:g} of before"


@dataclass(frozen=True)
class Row:
    """A line of the table.

    Attributes
    ----------
    theme, name : str
    worlds : tuple of World
    limits : tuple of Limit
    names : frozenset of str
        The flags and judgements that are right.
    only : int or None
        Number of the press of a session that counts; None: all.
    lost_in_a_session : int or None
        How many presses a session may lose.
    compared : Compared or None
        How much worse than the stored figures it may be.
    """

    theme: str
    name: str
    worlds: tuple[World, ...]
    limits: tuple[Limit, ...]
    names: frozenset[str] = NEW_FLAGS
    only: int | None = None
    lost_in_a_session: int | None = None
    compared: Compared | None = None

    @property
    def title(self) -> str:
        """Theme and name."""
        return f"{self.theme}: {self.name}"

    @property
    def limit_text(self) -> str:
        """All limits."""
        texts = [str(limit) for limit in self.limits]
        if self.lost_in_a_session is not None:
            texts.append(f"lost in a session <= {self.lost_in_a_session}")
        if self.compared is not None:
            texts.append(str(self.compared))
        return ", ".join(texts)


def with_fault(world: World, *faults: Fault) -> tuple[World, ...]:
    """Return a world with each fault of the signal."""
    return tuple(replace(world, faults=(fault,)) for fault in faults)


def with_reading_fault(world: World, *faults: Fault) -> tuple[World, ...]:
    """Return a world with each fault of the readings."""
    return tuple(replace(world, reading_faults=(fault,)) for fault in faults)


def readings() -> Iterator[Row]:
    """Return the rows of bad readings."""
    for channel in CHANNELS:
        for longest, kind in ((1, "alone"), (3, "up to 3 in a row")):
            for share in (0.05, 0.10, 0.15, 0.20):
                wires = with_reading_fault(HAND, LooseWire(channel, share, longest))
                name = f"{100 * share:.0f} % of {channel} at its baseline, {kind}"
                yield Row("readings", name, wires, BAD_READINGS)
        for share, size in ((0.05, 0.5), (0.02, 0.05)):
            name = f"{100 * share:.0f} % of {channel} off by {1000 * size:.0f} fF"
            outliers = with_reading_fault(HAND, Outliers(channel, share, size))
            yield Row("readings", name, outliers, BAD_READINGS)


def railed(name: str, low: float, decimals: int, *rails: Rail, by: Presser = "hand") -> Row:
    """Return a row of channels that end."""
    world = replace(HAND, by=by, decimals=decimals)
    return saturated_row(name, low, with_reading_fault(world, *rails))


def saturated_row(name: str, low: float, worlds: tuple[World, ...]) -> Row:
    """Return a row of worlds in which each press is saturated."""
    limits = (Limit(Measure.NAMED, low=low), Limit(Measure.SILENT, high=1 - low))
    return Row("saturated", name, worlds, limits, names=SATURATED)


def saturated() -> Iterator[Row]:
    """Return the rows of a channel that ends, and nobody says so."""
    own = (Rail("hard"), Rail("soft"))
    for decimals in (3, 4, 6):
        yield railed(f"at its own end, {decimals} decimals", 0.95, decimals, *own)
    known = [Rail(channel, at) for channel in CHANNELS for at in KNOWN_ENDS_pF]
    yield railed("at a known end, 2 decimals", 0.90, 2, *known)
    toggles = [Rail(channel, toggles=1e-4) for channel in CHANNELS]
    yield railed("last digit toggles, 4 decimals", 0.80, 4, *toggles)
    before = with_fault(replace(HAND, decimals=6), *own)
    yield saturated_row("before the noise, 6 decimals", 0.80, before)
    yield railed("pressed by a stage, 6 decimals", 0.80, 6, *own, by="stage")
    both = (Rail("hard", 4.096), Rail("soft", 4.096))
    world = replace(HAND, decimals=4, reading_faults=both)
    yield saturated_row("both channels at 4.096 pF", 0.90, (world,))
    yield from coarse()


def coarse() -> Iterator[Row]:
    """Return the rows of healthy presses that are printed coarsely, and may look saturated."""
    for decimals in (2, 3, 4):
        for by, called in CALLED.items():
            worlds = (replace(HAND, by=by, decimals=decimals),)
            limits = (Limit(Measure.CALLED, high=called),)
            yield Row("saturated", f"healthy: {by}, {decimals} decimals", worlds, limits)


def frozen() -> Iterator[Row]:
    """Return the rows of channels that are dead, and of a probe that falls."""
    named = (Limit(Measure.NAMED, low=0.95),)
    cases = {
        "from the start": (0.0, None),
        "from 1.5 s on": (1.5, None),
        "at 0 from the start": (0.0, 0.0),
        "at -4.096 pF from the start": (0.0, -4.096),
    }
    for name, (from_s, value) in cases.items():
        dead = [Frozen(channel, from_s, value) for channel in CHANNELS]
        coarse_hand = replace(HAND, rest_s=14.0, decimals=4)
        fine_hand = replace(coarse_hand, decimals=6)
        worlds = with_reading_fault(coarse_hand, *dead) + with_reading_fault(fine_hand, *dead)
        yield Row("frozen", name, worlds, named, names=SATURATED)
    falling = with_fault(HAND, Falling())
    limits = (Limit(Measure.SAID, low=0.95), Limit(Measure.SILENT, high=0.05))
    yield Row("falling", "both channels", falling, limits, names=frozenset({"falling"}))


def jumps() -> Iterator[Row]:
    """Return the rows of a level that jumps at rest, in ten presses each 7 s."""
    hand = replace(HAND, presses=10)
    for channel in HARD_SOFT_OR_BOTH:
        for sign, way in SIDES:
            for size in (0.02, 0.1, 0.3, 1.0, 3.0):
                name = f"{channel} {way} by {size:g} pF at rest"
                yield jump_row(name, with_fault(hand, Jump(channel, sign * size)))


def jump_row(name: str, worlds: tuple[World, ...]) -> Row:
    """Return a row of a level that jumps at rest."""
    limits = (FEW_SILENT, Limit(Measure.SAID, low=0.80))
    return Row("jump", name, worlds, limits, JUMPED, lost_in_a_session=1)


def steps() -> Iterator[Row]:
    """Return the rows of a step of either channel within a press, up or down."""
    hand = replace(HAND, presses=5)
    limits_of: dict[Part, tuple[Limit, ...]] = {
        "hold": IN_HOLD,
        "rise": (FEW_SILENT,),
        "fall": (FEW_SILENT,),
    }
    for part, limits in limits_of.items():
        for size in (0.02, 0.05, 0.164, 0.5):
            faults = [
                StepInPress(channel, sign * size, part) for channel in CHANNELS for sign, _ in SIDES
            ]
            yield step_row(f"{size:g} pF in the {part}", with_fault(hand, *faults), limits)


def step_row(name: str, worlds: tuple[World, ...], limits: tuple[Limit, ...]) -> Row:
    """Return a row of a step within the second press, which counts."""
    return Row("step", name, worlds, limits, STEPPED, only=1, lost_in_a_session=1)


def baselines() -> Iterator[Row]:
    """Return the rows of a baseline that moves during a press."""
    moments: tuple[tuple[Moment, str], ...] = (
        ("contact", "steps at the contact"),
        ("release", "steps at the release"),
        ("evenly", "drifts"),
    )
    for channel in CHANNELS:
        for when, text in moments:
            for size in (0.001, 0.003, 0.005, 0.01):
                name = f"{channel} {text}, {1000 * size:g} fF"
                yield baseline_row(name, BaselineStep(channel, size, when))


def baseline_row(name: str, fault: BaselineStep) -> Row:
    """Return the row of a baseline that moves; an even drift is compared with before."""
    worlds = with_fault(HAND, fault)
    if fault.when == "evenly":
        return Row("baseline", name, worlds, (NONE_LOST,), compared=Compared(1.03, 2.3))
    low = 0.65 if fault.size < 0.003 else 0.80
    return Row("baseline", name, worlds, (Limit(Measure.COVERED, low=low), NONE_LOST))


def slow_noise() -> Iterator[Row]:
    """Return the rows of noise that is not white, after 10 s of rest."""
    noises: tuple[tuple[str, Fault], ...] = (
        ("breathing", Breathing()),
        ("walk", Walk()),
        ("flicker", Flicker()),
        ("AR .9", Autoregressive()),
    )
    for name, noise in noises:
        for rate in (38.46, 115, 1000):
            for depth_pF in (0.05, 0.25):
                hand = replace(HAND, pair_s=1 / rate, depth_pF=depth_pF, rest_s=10.0)
                low = 0.75 if depth_pF < 0.1 or rate == 115 else 0.80
                limits = (Limit(Measure.COVERED, low=low), NONE_LOST)
                title = f"{name}, {rate:.0f} pairs/s, {depth_pF:g} pF"
                yield Row("slow noise", title, with_fault(hand, noise), limits)


def slow_pairs() -> Iterator[Row]:
    """Return the rows of slow converters, for hands that tremble differently."""
    cases = {
        "capf=4, 2 s of rest": (0.124, 2.0),
        "capf=4, 8 s of rest": (0.124, 8.0),
        "4.8 pairs/s, 2 s of rest": (1 / 4.8, 2.0),
        "capf=7, five pairs of rest": (0.2192, 5.2 * 0.2192),
        "capf=7, 8 s of rest": (0.2192, 8.0),
    }
    for name, (pair_s, rest_s) in cases.items():
        world = replace(HAND, pair_s=pair_s, rest_s=rest_s, hold_s=(2.0, 3.0))
        limits = (Limit(Measure.COVERED, low=0.85), NONE_LOST)
        yield Row("slow pairs", name, trembling(world), limits)
    limits = (Limit(Measure.COVERED, low=0.92), NONE_LOST)
    for rate in (22, 23, 24, 25):
        worlds = trembling(replace(HAND, pair_s=1 / rate))
        yield Row("slow pairs", f"{rate} pairs/s", worlds, limits)


def trembling(world: World) -> tuple[World, ...]:
    """Return hands that tremble in bands from wide to narrow."""
    return tuple(replace(world, tremor_hz=band) for band in BANDS_Hz)


KINDS = {
    "hand, 0.25 pF": HAND,
    "hand, 0.05 pF": replace(HAND, depth_pF=0.05),
    "hand, 1 pF": replace(HAND, depth_pF=1.0),
    "hand, trembles by 15 %": replace(HAND, tremor=0.15),
    "hand, trembles by 1 %": replace(HAND, tremor=0.01, sway=0.01),
    "hand, trembles at 8 to 9 Hz": replace(HAND, tremor_hz=(8.0, 9.0)),
    "domes": replace(HAND, exponent=1.5),
    "stage": replace(HAND, by="stage"),
    "relaxing object": replace(HAND, by="relaxing"),
}
OTHER_KINDS = {
    "stage, held for 6 to 9 s": replace(HAND, by="stage", hold_s=(6.0, 9.0), every_s=14.0),
    "taps of 0.7 s": replace(HAND, rise_s=(0.06, 0.15), hold_s=(0.4, 0.7), every_s=3.0),
    "levels drift by 0.1 fF/s": replace(HAND, faults=(Drift(1e-4),)),
}
"""Healthy kinds that are not in the rows of all kinds; their intervals may hold more often."""


def at_rates(*worlds: World) -> tuple[World, ...]:
    """Return worlds at each rate."""
    return tuple(replace(world, pair_s=1 / rate) for world in worlds for rate in RATES)


def healthy_row(
    name: str, worlds: tuple[World, ...], most: float = 0.98, width: float = 1.1
) -> Row:
    """Return a row of healthy presses; an interval may be `width` times as wide as before."""
    limits = (NO_FALSE_FLAG, Limit(Measure.COVERED, 0.92, most), NONE_LOST)
    return Row("healthy", name, worlds, limits, compared=Compared(1.03, width))


def healthy() -> Iterator[Row]:
    """Return the rows of healthy presses: of each kind, at each rate, of a tilted probe."""
    for name, world in KINDS.items():
        yield healthy_row(name, at_rates(world))
    for name, world in OTHER_KINDS.items():
        yield healthy_row(name, at_rates(world), most=1.0, width=2.3 if world.faults else 1.1)
    for rate in RATES:
        worlds = tuple(replace(world, pair_s=1 / rate) for world in KINDS.values())
        yield healthy_row(f"all of them at {rate:.0f} pairs/s", worlds)
    tilted = at_rates(replace(HAND, tilt=0.01), replace(HAND, tilt=0.05))
    limits = (Limit(Measure.CALLED, high=0.002), NONE_LOST)
    yield Row("healthy", "tilted by 1 and 5 %, no fault of a lab", tilted, limits)


def other_rates() -> Iterator[Row]:
    """Return a row of each kind of fault, in either channel, for faster converters."""
    for rate in (115, 1000):
        hand = replace(HAND, pair_s=1 / rate, presses=5)
        at_rate = f"{rate} pairs/s"
        wires = with_reading_fault(hand, LooseWire("hard", 0.1), LooseWire("soft", 0.1))
        name = f"10 % of one channel at its baseline, {at_rate}"
        yield Row("other rates", name, wires, BAD_READINGS)
        rails = with_reading_fault(replace(hand, decimals=4), Rail("hard"), Rail("soft"))
        yield saturated_row(f"at its own end, 4 decimals, {at_rate}", 0.95, rails)
        jumped = with_fault(hand, Jump("hard", 0.3, 1), Jump("soft", 0.3, 1))
        yield jump_row(f"up by 0.3 pF at rest, {at_rate}", jumped)
        stepped = with_fault(
            hand, StepInPress("hard", 0.1, "hold"), StepInPress("soft", 0.1, "hold")
        )
        yield step_row(f"0.1 pF in the hold, {at_rate}", stepped, IN_HOLD)


THEMES: dict[str, Callable[[], Iterator[Row]]] = {
    "readings": readings,
    "saturated": saturated,
    "frozen": frozen,
    "jump": jumps,
    "step": steps,
    "baseline": baselines,
    "slow noise": slow_noise,
    "slow pairs": slow_pairs,
    "other rates": other_rates,
    "healthy": healthy,
}
