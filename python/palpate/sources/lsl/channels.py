"""Which channels of a stream are the two of the probe, and their unit."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from palpate.errors import ProtocolError, listed, quoted
from palpate.samples import Status
from palpate.sources.lsl.library import MANUFACTURER, SAMPLES
from palpate.tables.names import PAIRS, simple_name
from palpate.tables.units import PICOFARADS, unit_in

_WORDS = {
    "attofarads": "aF",
    "femtofarads": "fF",
    "picofarads": "pF",
    "nanofarads": "nF",
    "microfarads": "uF",
    "millifarads": "mF",
    "farads": "F",
}
"""Units as the conventions of LSL write them."""


NUMBERS = (1, 2, 4, 5, 6, 7)
"""The formats of LSL but 3, text."""
_LARGEST_OFFSET_S = 3600.0


@dataclass(frozen=True)
class Asked:
    """What the user says of the channels: each a label, or a position from 1; and their unit."""

    hard: str | None = None
    soft: str | None = None
    unit: str | None = None


class Channels:
    """The channels of a stream.

    Parameters
    ----------
    labels, units : sequence of str
        Of each channel; empty where the stream does not say it.
    asked : Asked
    own : bool
        The stream is one of palpate: its channels `SAMPLES` have their meaning.

    Raises
    ------
    ValueError
        A channel or its unit is not known.

    Examples
    --------
    >>> channels = Channels(["C1_nF", "C2_nF"], ["", ""], Asked(hard="C1_nF", soft="2"))
    >>> channels.values([0.5, float("nan")])
    (500.0, nan)
    """

    def __init__(self, labels: Sequence[str], units: Sequence[str], asked: Asked, own: bool = False) -> None:
        self._labels = labels
        self.names: dict[str, str] = {}
        self._places: list[tuple[int, float]] = []
        for name, wanted, usual in zip(("hard", "soft"), (asked.hard, asked.soft), _usual(labels), strict=True):
            place = usual if wanted is None and usual is not None else self._place(name, wanted)
            unit = asked.unit or self._unit(name, place, units[place])
            self.names[name] = f"{labels[place] or place + 1}, {unit}"
            self._places.append((place, PICOFARADS[unit]))
        if self._places[0][0] == self._places[1][0]:
            raise ValueError(f"hard, soft: got {self._shown(self._places[0][0])} for both, allowed: two channels")
        extra = SAMPLES[2:] if own else ()
        self._extra = {label: labels.index(label) for label in extra if label in labels}

    @property
    def numbered(self) -> bool:
        """Whether each sample has the number of its sender."""
        return "seq" in self._extra

    def values(self, row: Sequence[float]) -> tuple[float, float]:
        """Return both capacitances of a sample, pF; nan: none."""
        hard, soft = (float(row[place]) * factor for place, factor in self._places)
        return hard if math.isfinite(hard) else math.nan, soft if math.isfinite(soft) else math.nan

    def count(self, row: Sequence[float], name: str) -> int | None:
        """Return the number ("seq") or the gaps so far ("gaps") of the sender; None: there is none."""
        return _whole(row[self._extra[name]], name, 2**53) if name in self._extra else None

    def offset_ns(self, row: Sequence[float]) -> int:
        """Return how much later the soft channel was measured, ns; 0 if the stream does not say it."""
        if "soft_offset_s" not in self._extra:
            return 0
        if not abs(found := row[self._extra["soft_offset_s"]]) < _LARGEST_OFFSET_S:
            raise ProtocolError(f"lsl: soft_offset_s: got {found:g}, allowed: below {_LARGEST_OFFSET_S:g} s")
        return round(found * 1e9)

    def status(self, row: Sequence[float], values: tuple[float, float]) -> int:
        """Return the status of a sample; LOST if, and only if, a value is missing."""
        if math.isnan(values[0]) or math.isnan(values[1]):
            return int(Status.LOST)
        return _whole(row[self._extra["status"]], "status", Status.LOST - 1) if "status" in self._extra else 0

    def _place(self, name: str, wanted: str | None) -> int:
        count = len(self._labels)
        if wanted is None:
            found = []
        elif wanted in self._labels:
            found = [i for i, label in enumerate(self._labels) if label == wanted]
        else:
            found = [int(wanted) - 1] if wanted.isdecimal() and 1 <= int(wanted[:9]) <= count else []
        if len(found) != 1:
            there = listed([self._shown(i) for i in range(count)])
            got = "nothing" if wanted is None else quoted(wanted)
            raise ValueError(f"{name}: got {got}, allowed: {name}=LABEL or a position from 1, one of {there}")
        return found[0]

    def _unit(self, name: str, place: int, said: str) -> str:
        unit = said.strip() or unit_in(self._labels[place], PICOFARADS) or ""
        unit = _WORDS.get(unit.casefold(), _WORDS.get(f"{unit.casefold()}s", unit))
        if unit not in PICOFARADS:
            raise ValueError(
                f"unit: the stream says {quoted(said)} for {name}, channel {self._shown(place)}; "
                f"allowed: unit=, one of {', '.join(PICOFARADS)}"
            )
        return unit

    def _shown(self, place: int) -> str:
        return f"{place + 1} ({self._labels[place]})" if self._labels[place] else f"{place + 1}"


def _usual(labels: Sequence[str]) -> tuple[int | None, int | None]:
    """Return the channels whose labels say that they are the hard and the soft one."""
    simple = [simple_name(label) for label in labels]
    found = (
        (simple.index(hard), simple.index(soft))
        for hard, soft in PAIRS
        if simple.count(hard) == simple.count(soft) == 1
    )
    return next(found, (None, None))


def channels_of(info: Any, asked: Asked) -> Channels:
    """Return the channels of a stream with its description; errors as `Channels`, and for a stream of text."""
    if info.channel_format() not in NUMBERS:
        raise ValueError(f"lsl: the stream {quoted(info.name())} has no numbers, allowed: a stream of numbers")
    channel, labels, units = info.desc().child("channels").child("channel"), [], []
    for _ in range(info.channel_count()):  # a description with fewer of them has empty texts for the others
        labels.append(channel.child_value("label"))
        units.append(channel.child_value("unit"))
        channel = channel.next_sibling("channel")
    return Channels(labels, units, asked, info.desc().child_value("manufacturer") == MANUFACTURER)


def _whole(value: float, name: str, largest: int) -> int:
    if not (0 <= value <= largest and value == int(value)):
        raise ProtocolError(f"lsl: {name}: got {value:g}, allowed: a whole number from 0 to {largest}")
    return int(value)
