"""The device on the page: which board, how it is set, how it is; and what of it may be changed while it measures."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from palpate.ad7746.registers import CONVERSION_S, SUPPLY_V
from palpate.live import state_rules
from palpate.live.connection_state import ConnectionState, can_centre
from palpate.live.feed import Document, RefusedCommand
from palpate.live.measurement import PRESSED, LiveMeasurement
from palpate.live.signal_state import CHANNELS
from palpate.live.state_rules import Facts
from palpate.sources import Conditions
from palpate.sources.board import ConverterOptions
from palpate.sources.options import split

_CHANGED = ("usb", "i2c", "sim")  # sources that take the options of `ConverterOptions`
_LEVELS = ("1/8", "1/4", "3/8", "1/2")  # of the supply, both ways
_PINS = ["B", "A", "AB", "B,A", "A,B"]
_CAPF = "Conversion, CAPF: 0 is the fastest (11 ms), 7 has the least noise (110 ms); only 4 (62 ms) rejects the mains"
_EXCITATION = "Excitation pins of both bumps; of two, separated by a comma: hard, soft"
_COUNTED = "Pairs of readings: that came late; that never came; without a usable value; dropped: not estimated, but recorded"
_NEAR_LIMIT = 0.9  # of the range


class Device:
    """The device of a measurement: its message, and the buttons Set and Centre. `source`: its name, as the user gave it."""

    def __init__(self, measurement: LiveMeasurement, state: ConnectionState, source: str) -> None:
        self._measurement, self._state = measurement, state
        self._is_ours = split(source)[0] in _CHANGED

    def document(self) -> Document:
        """Return the message `device`."""
        device = self._measurement.device()
        return {
            "facts": _facts(
                device, self._state.facts(), self._measurement, self._state.measured_conditions
            ),
            "options": self._options(device) if self._is_ours else {},
            "can_centre": can_centre(self._measurement.stream.source),
        }

    def device(self, **options: Any) -> str:
        """Begin a new measurement with these options; return the message."""
        if not self._is_ours:
            raise RefusedCommand("device: this source has no settings")
        self._require_free("device")
        now = {
            name: option["value"]
            for name, option in self._options(self._measurement.device()).items()
        }
        ConverterOptions.parse("device", options)
        what = ", ".join(f"{name} {value}, before {now[name]}" for name, value in options.items())
        self._measurement.reopen(options, f"the converter was set again: {what}")
        return f"A new measurement has started: {what}."

    def centre(self) -> str:
        """Set the range again; return the message."""
        self._require_free("centre")
        self._measurement.stream.centre()
        return "The range is set again. If it moves, the baseline is measured again: do not touch anything."

    @staticmethod
    def _options(device: Mapping[str, Any]) -> Document:
        if not (settings := device.get("configuration")):
            return {}
        return {
            "capf": {
                "value": settings["capf"],
                "allowed": list(range(len(CONVERSION_S))),
                "title": _CAPF,
            },
            "excitation": {"value": _pins(settings), "allowed": _PINS, "title": _EXCITATION},
        }

    def _require_free(self, what: str) -> None:
        self._measurement.require_running(what)
        if self._measurement.moment.state in PRESSED and not self._measurement.stream.out_of_range:
            raise RefusedCommand(f"{what}: the probe is in contact; lift it first")


def _board(device: Mapping[str, Any]) -> str:
    """Return name and place of a board."""
    simulated = "simulated " if "simulated" in device else ""
    device = device["device"] if isinstance(device.get("device"), dict) else device
    usb = f"USB {device['bus']}/{device['address']}" if "usb" in device else ""
    place = usb or device.get("bus") or device.get("path") or device.get("port")
    return simulated + ", ".join(str(part) for part in (device.get("name"), place) if part)


def _facts(
    device: Mapping[str, Any],
    facts: Facts,
    measurement: LiveMeasurement,
    conditions: Sequence[Conditions],
) -> list[Document]:
    away, counters, pace = "unplugged" in facts.troubles, measurement.stream.counters, facts.pace
    slow = state_rules.slow(facts) is not None
    rate = f"{pace.per_s:.1f}" if math.isfinite(pace.per_s) else "-"
    rate += f" of {1 / facts.period_s:.1f}" if math.isfinite(facts.period_s) else ""
    numbers = {"Late": counters.late, "lost": counters.lost, "refused": counters.refused}
    numbers |= {"dropped": counters.dropped} if counters.dropped else {}
    found = (
        [_fact("Board", f"{board}{', gone' if away else ''}", warn=away)]
        if (board := _board(device))
        else []
    )
    found += [_fact("Chip", device["fingerprint"])] if device.get("fingerprint") else []
    return [
        *found,
        _fact("Pairs a second", "0" if away else rate, warn=away or slow),
        _fact(
            ", ".join(numbers),
            ", ".join(map(str, numbers.values())),
            warn=away or slow,
            title=_COUNTED,
        ),
        *_settings(device),
        *_conditions(conditions, facts.seen.baseline_s),
        *(_range(device, facts, number) for number in range(len(CHANNELS))),
    ]


def _fact(
    name: str, value: str, *, warn: bool = False, share: float | None = None, title: str = ""
) -> Document:
    return {"name": name, "value": value, "warn": warn, "share": share, "title": title}


def _settings(device: Mapping[str, Any]) -> list[Document]:
    settings = device.get("configuration")
    if not isinstance(settings, dict):
        return []
    pins = " and ".join(f"EXC{pin}" for pin in _pins(settings).split(","))
    chopped = ", chopped" if settings["chop"] else ""
    conversion = f"{1e3 * device['conversion_s']:.1f} ms{chopped} (CAPF {settings['capf']})"
    return [
        _fact(
            "Excitation", f"±{_LEVELS[settings['level']]} of the supply ({pins})", title=_EXCITATION
        ),
        _fact("Conversion", conversion, title=_CAPF),
    ]


def _pins(settings: Mapping[str, Any]) -> str:
    hard, soft = (settings[name]["excitation"] for name in CHANNELS)
    return str(hard) if hard == soft else f"{hard},{soft}"


def _conditions(measured: Sequence[Conditions], baseline_s: float) -> list[Document]:
    """Return temperature and supply, if they are measured."""
    known = [each.as_dict() for each in measured if "temperature_C" in each.values]
    if not known:
        return []
    newest, before = known[-1], [each for each in known if each["t_s"] <= baseline_s]
    temperature = f"{newest['temperature_C']:.1f} °C"
    if before and before[-1] is not newest:
        temperature += (
            f", {newest['temperature_C'] - before[-1]['temperature_C']:+.1f} since the baseline"
        )
    elif len(known) == 1:
        temperature += " at the begin"
    found = [_fact("Temperature", temperature)]
    if (supply := newest.get("supply_V")) is not None:
        found.append(
            _fact("Supply", f"{supply:.2f} V", warn=not SUPPLY_V[0] <= supply <= SUPPLY_V[1])
        )
    return found


def _range(device: Mapping[str, Any], facts: Facts, number: int) -> Document:
    """Return how much of its range a channel uses."""
    reading, full, settings = (
        facts.seen.channels[number].reading,
        facts.full_scale_pF,
        device.get("configuration"),
    )
    name = CHANNELS[number].capitalize()
    if isinstance(settings, dict):
        name += f", CIN{settings['hard_input'] if number == 0 else 3 - settings['hard_input']}"
    if not math.isfinite(reading) or "unplugged" in facts.troubles:
        return _fact(name, "-", warn="unplugged" in facts.troubles)
    if not math.isfinite(full):
        return _fact(name, f"{reading:.4f} pF")
    share = min(abs(reading) / full, 1.0)
    return _fact(
        name, f"{100 * share:.0f} % of range", warn=share > _NEAR_LIMIT, share=round(share, 2)
    )
