"""Reference of what is between two touches: the baselines of both channels, the gate, and what a reading begins or ends."""

from dataclasses import dataclass, field

from palpate.reference.baseline import FIRST, Baseline
from palpate.reference.contact import Contact

SETTLES_S = 0.1  # the last tenth of a release takes time


@dataclass
class Idle:
    """Both baselines and the gate, reading by reading.

    Attributes
    ----------
    hard, soft : Baseline
    gate : Contact
    retaken : int
        How often the baseline was measured again: its first values were disturbed, or the channels fell far below it.

    Examples
    --------
    >>> idle = Idle()
    >>> [idle.take(26_000_000 * k, 9.0, 8.0, running=False) for k in (1, 2)]
    ['', '']
    """

    hard: Baseline = field(default_factory=Baseline)
    soft: Baseline = field(default_factory=Baseline)
    gate: Contact = field(default_factory=Contact)
    retaken: int = 0
    _since_ns: int = 0  # in contact: when a touch last took samples; later, of the release
    _settles: bool = False

    @property
    def ready(self) -> bool:
        """Whether both baselines are known."""
        return self.hard.ready and self.soft.ready

    def take(self, time_ns: int, hard: float, soft: float, *, running: bool) -> str:
        """Take a reading of both channels, pF; `running`: a touch takes samples; return what begins or ends."""
        # "begun": a touch; "released": the probe; "idle": the release is over, the baselines will be measured again;
        # "measured": the baselines are known; "": nothing of these.
        change = (hard - self.hard.now.expected) + (soft - self.soft.now.expected)
        small, large = sorted((self.hard.now.noise, self.soft.now.noise))
        noise = large + 0.42 * small  # the square root of the sum of the squares, about
        if not self.ready:
            return self._measure(time_ns, (hard, soft), change, noise)
        before = self.gate.state
        if running or before == "idle":
            self._since_ns = time_ns
        self.gate.update(change, noise, (time_ns - self._since_ns) / 1e9)
        now = self.gate.state
        if now == "contact" and before != "contact":
            self.hard.rewind()
            self.soft.rewind()
            return "begun"
        if now == "idle" and before != "idle":
            self._measure_again()
            self._since_ns, self._settles = time_ns, True
            return "idle"
        if self.gate.fell or (now == "idle" and max(self.hard.now.quiet, self.soft.now.quiet) >= FIRST):
            self.retaken += 1
            self.gate.reset()
            self._measure_again()
        elif now == "idle":
            self._follow(hard, soft)
        return "released" if before == "contact" and now != "contact" else ""

    def take_one(self, hard: float | None, soft: float | None) -> str:
        """Take a reading of which one channel or both have no value; return "measured" or ""."""
        before = self.ready
        if self.gate.state == "idle" and not self.gate.suspects and not self._settles:
            for baseline, value in ((self.hard, hard), (self.soft, soft)):
                if value is not None:
                    baseline.add(value)
        return "measured" if self.ready and not before else ""

    def _measure(self, time_ns: int, values: tuple[float, float], change: float, noise: float) -> str:
        """Take a reading while the baselines are measured; a touch that begins meanwhile has the old ones."""
        self.gate.update_between(change, noise)
        if self.gate.state == "contact":
            self.hard.keep()
            self.soft.keep()
            return "begun"
        self._settles = self._settles and (time_ns - self._since_ns) / 1e9 < SETTLES_S
        if self._settles:
            return ""
        for baseline, value in zip((self.hard, self.soft), values, strict=True):
            if not baseline.ready:
                baseline.add(value)
        return "measured" if self.ready else ""

    def _measure_again(self) -> None:
        self.hard.measure_again()
        self.soft.measure_again()

    def _follow(self, hard: float, soft: float) -> None:
        self.hard.add(hard)
        self.soft.add(soft)
        if not self.gate.suspects:
            self.hard.mark()
            self.soft.mark()
