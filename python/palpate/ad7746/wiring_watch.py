"""Notices while pairs are read that a wire comes off, an excitation pin is shorted, or the converter stops measuring.

A reading only raises the suspicion: with a CAPDAC in use, an open input is saturated, or far below its idle value. A
look at the input itself decides, so that a deep press or a range that moved is never taken for it.
"""

from palpate.ad7746 import datasheet
from palpate.ad7746.configuration import HARD, NAMES, SOFT, Configuration
from palpate.ad7746.inputs import EMPTY_PF, Looking
from palpate.samples import Sample, Status

CONFIRM_S = 1.0
"""Suspicious readings for this long are looked into."""
_AGAIN_S = 5.0  # to the next look after one that found nothing
_BACK_S = 0.5
_FALLEN = 0.7  # share of the idle capacitance that is missing; it is known to 20 %
_SAME_CODES = 8  # the noise is above 8 codes rms at every speed: two are rarely the same
_SATURATED = (Status.HARD_SATURATED, Status.SOFT_SATURATED)


class _Channel:
    """What one channel looks like, and since when."""

    def __init__(self) -> None:
        self.suspicion = ""
        self.since_ns = 0
        self.told = ""
        self.text = ""
        self.code = -1
        self.same = 0

    def note(self, suspicion: str, t_ns: int) -> None:
        if suspicion != self.suspicion:
            self.suspicion, self.since_ns = suspicion, t_ns


class WiringWatch:
    """Follows the pairs of a driver.

    Parameters
    ----------
    look : Looking
        Called when the readings of a channel are suspicious.
    """

    def __init__(self, look: Looking) -> None:
        self._look = look
        self._channels = (_Channel(), _Channel())

    @property
    def present(self) -> str:
        """What is wrong now; empty: nothing."""
        return "; ".join(channel.text for channel in self._channels if channel.text)

    def take(self, sample: Sample, configuration: Configuration) -> list[str]:
        """Return what has changed with this sample, one text for each channel; empty: nothing.

        Parameters
        ----------
        sample : Sample
        configuration : Configuration
            Of the chip while it was read.

        Raises
        ------
        SourceError
            From `look`.
        """
        if sample.status & Status.LOST:
            return []
        told = [self._follow(number, sample, configuration) for number in (HARD, SOFT)]
        return [text for text in told if text]

    def _follow(self, number: int, sample: Sample, configuration: Configuration) -> str:
        channel = self._channels[number]
        channel.note(self._suspicion(number, sample, configuration), sample.t_hard_ns)
        lasting_s = (sample.t_hard_ns - channel.since_ns) / 1e9
        if channel.suspicion == channel.told:
            return ""
        if not channel.suspicion:
            return self._back(number) if lasting_s >= _BACK_S else ""
        if lasting_s < CONFIRM_S:
            return ""
        channel.since_ns = sample.t_hard_ns + round((_AGAIN_S - CONFIRM_S) * 1e9)
        text = self._confirmed(number, configuration)
        if text:
            channel.told, channel.text = channel.suspicion, text
        return text

    def _suspicion(self, number: int, sample: Sample, configuration: Configuration) -> str:
        value, code = (sample.hard, sample.hard_raw) if number == HARD else (sample.soft, sample.soft_raw)
        channel = self._channels[number]
        channel.same = channel.same + 1 if code == channel.code else 0
        channel.code = code
        steps = configuration.channel(number).capdac
        idle_pF = abs(steps) * datasheet.DAC_STEP_PF
        below = -value if steps < 0 else value
        if sample.status & Status.EXCITATION:
            return "short"
        saturated = bool(sample.status & _SATURATED[number])
        if below < EMPTY_PF - _FALLEN * idle_pF or (saturated and below < 0):
            return "flat"
        return "same" if channel.same >= _SAME_CODES and not saturated else ""

    def _confirmed(self, number: int, configuration: Configuration) -> str:
        suspicion = self._channels[number].suspicion
        plus, pins = f"{configuration.input(number)}+", configuration.channel(number).excitation
        if suspicion == "same":
            return f"{NAMES[number]} bump: every reading is the same: the converter does not measure; replug the board"
        looks = {name: self._look(plus, name) for name in pins}
        if suspicion == "short":
            shorted = " and ".join(f"EXC{name}" for name, found in looks.items() if found.shorted)
            text = f"{shorted} is shorted or overloaded (EXCERR): look at its wire, its plug and the probe"
            return f"{NAMES[number]} bump: {text}" if shorted else ""
        if not all(found.is_empty for found in looks.values()):
            return ""
        levels = " and ".join(f"{found} on EXC{name}" for name, found in looks.items())
        return f"{NAMES[number]} bump: CIN{plus} has {levels}: its wire is off: look at CIN{plus} and EXC{pins[0]}"

    def _back(self, number: int) -> str:
        self._channels[number].told = self._channels[number].text = ""
        return f"{NAMES[number]} bump: it is measured again"
