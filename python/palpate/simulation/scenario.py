"""Settings of a simulation: presses, hand, probe, gauges, baselines, converter, faults."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import inf

from palpate.simulation.baseline import Baseline
from palpate.simulation.bumps import Bumps, Gauge
from palpate.simulation.converter import Converter, Stamps
from palpate.simulation.faults import Faults
from palpate.simulation.press import Press
from palpate.simulation.ranges import within
from palpate.simulation.substrate import Substrate
from palpate.simulation.tilt import Tilt
from palpate.simulation.tremor import Peaks, Spectrum


@dataclass(frozen=True)
class Scenario:
    """Settings of a simulation. Each part has its own class; pairs are (hard, soft).

    Attributes
    ----------
    presses : sequence of Press
    duration_s : float
        Length of the simulation.
    tremor : float
        Hand tremor, rms, relative to the force of the press.
    spectrum : Peaks, Lines or Record
        Of the tremor.
    tilt : Tilt
        Changes of the ratio.
    substrate : Substrate
        Distance of the bumps, tremor of the angle; what `Press.tilt_deg` does.
    bumps : Bumps
        Bumps that are not level, bottom out, have cross-talk.
    gauges : (Gauge, Gauge)
        Curves, creep and lag.
    baselines : (Baseline, Baseline)
        Level, drift, wander, jump, thermal change.
    converter : Converter
        Speed, noise, resolution.
    stamps : Stamps
        Errors of the reported times.
    faults : Faults
        Lost conversions, spikes, noise bursts, pickup.

    Raises
    ------
    ValueError
        A value is outside its range.

    Examples
    --------
    >>> from dataclasses import replace
    >>> from palpate.simulation import simulate
    >>> light = Scenario(presses=[Press(1.0, [(0.0, 2.5)], depth_pF=0.02)], duration_s=9.0)
    >>> simulate(replace(light, faults=Faults(lost=0.01))).hard.shape
    (346,)
    """

    presses: Sequence[Press] = ()
    duration_s: float = 10.0
    tremor: float = 0.01
    spectrum: Spectrum = field(default_factory=Peaks)
    tilt: Tilt = field(default_factory=Tilt)
    substrate: Substrate = field(default_factory=Substrate)
    bumps: Bumps = field(default_factory=Bumps)
    gauges: tuple[Gauge, Gauge] = field(default_factory=lambda: (Gauge(), Gauge()))
    baselines: tuple[Baseline, Baseline] = field(default_factory=lambda: (Baseline(0.62), Baseline(-0.41)))
    converter: Converter = field(default_factory=Converter)
    stamps: Stamps = field(default_factory=Stamps)
    faults: Faults = field(default_factory=Faults)

    def __post_init__(self) -> None:
        """Check the ranges."""
        within(self, 0, inf, "tremor")
        within(self, 0, 1e7, "duration_s")

    @property
    def contact_s(self) -> float:
        """Time of the first contact, s; inf: none."""
        return min((press.start_s for press in self.presses), default=inf)
