"""The device on the page: which board, how it is set, how it is; and what of it may be changed while it measures."""

import math
from collections.abc import Mapping
from typing import Any

from palpate.ad7746.datasheet import CONVERSION_S, SUPPLY_V
from palpate.live.desk import faults
from palpate.live.desk.facts import Facts
from palpate.live.desk.standing import Standing, can_centre
from palpate.live.desk.watching import CHANNELS, PRESSED
from palpate.live.protocol import Command, Refused
from palpate.live.session import Session
from palpate.sources.board import CONVERTER
from palpate.sources.options import split

_CHANGED = ("usb", "i2c", "sim")  # sources that take the options of `CONVERTER`
_LEVELS = ("±VDD/8", "±VDD/4", "±3/8 VDD", "±VDD/2")
_PINS = ["B", "A", "AB", "B,A", "A,B"]
_TITLES = {
    "capf": "Conversion: 0 is the fastest (11 ms), 7 has the least noise (110 ms); only 4 (62 ms) rejects the mains",
    "excitation": "Excitation pins of both bumps; of two, separated by a comma: hard, soft",
}
_NEAR_LIMIT = 0.9  # of the range


class Device:
    """The device of a session.

    Parameters
    ----------
    session : Session
    standing : Standing
    source : str
        Name of the source, as given by the user.

    Attributes
    ----------
    orders : dict
        Name of a command -> function.
    """

    def __init__(self, session: Session, standing: Standing, source: str) -> None:
        self.orders = {"device": self._set, "centre": self._centre}
        self._session, self._standing = session, standing
        self._is_ours = split(source)[0] in _CHANGED
        self._described: tuple[tuple[int, int], dict[str, Any]] = (0, 0), {}

    def document(self) -> dict[str, Any]:
        """Return the message `device`."""
        source, told = self._session.stream.source, self._description()
        facts = self._standing.facts()
        return {
            "board": _board(told),
            "facts": [fact for fact in _facts(told, facts, self._session) if fact],
            "options": self._options(told) if self._is_ours else {},
            "can_centre": can_centre(source),
        }

    def _description(self) -> dict[str, Any]:
        """Return what the source says of itself: anew after each gap, where it may be another board."""
        source = self._session.stream.source
        key = self._session.number, len(source.gaps)
        if self._described[0] != key:
            self._described = key, source.describe()
        return self._described[1]

    @staticmethod
    def _options(told: Mapping[str, Any]) -> dict[str, Any]:
        if not (settings := told.get("configuration")):
            return {}
        values = {"capf": settings["capf"], "excitation": _pins(settings)}
        allowed = {"capf": list(range(len(CONVERSION_S))), "excitation": _PINS}
        return {
            name: {"value": values[name], "allowed": allowed[name], "title": title} for name, title in _TITLES.items()
        }

    def _require_free(self, what: str) -> None:
        if not self._session.running:
            raise Refused(f"{what}: the measurement has ended; press Measure again first")
        if self._session.moment.state in PRESSED and not self._session.stream.out_of_range:
            raise Refused(f"{what}: the probe is in contact; lift it first")

    def _set(self, command: Command) -> str:
        """Begin a new measurement with these options."""
        if not self._is_ours:
            raise Refused("device: this source has no settings")
        self._require_free("device")
        now = {name: option["value"] for name, option in self._options(self._description()).items()}
        given = {name: self._checked(name, value) for name, value in command.given.items()}
        changed = {name: value for name, value in given.items() if str(value) != str(now[name])}
        if not changed:
            raise Refused("device: these are the present settings")
        what = ", ".join(f"{name} {value}, before {now[name]}" for name, value in changed.items())
        self._session.reopen(changed, f"the converter was set again: {what}")
        return f"A new measurement has started: {what}."

    @staticmethod
    def _checked(name: str, value: Any) -> Any:
        try:
            CONVERTER[name](name, value)
        except ValueError as error:
            raise Refused(str(error)) from error
        return value

    def _centre(self, _: Command) -> str:
        stream = self._session.stream
        if not can_centre(stream.source):
            raise Refused("centre: this source has no range that can be set")
        self._require_free("centre")
        try:
            stream.centre()
        except RuntimeError as refusal:  # pressed since
            raise Refused(str(refusal)) from refusal
        return "The range is set again. If it moves, the baseline is measured again: do not touch anything."


def _board(told: Mapping[str, Any]) -> str:
    """Return name and place of a board."""
    inner = told.get("device")
    device = inner if isinstance(inner, dict) else told
    usb = f"USB {device['bus']}/{device['address']}" if "usb" in device else ""
    place = usb or device.get("bus") or device.get("path") or device.get("port") or ""
    return ", ".join(str(part) for part in (device.get("name", ""), place) if part)


def _facts(told: Mapping[str, Any], facts: Facts, session: Session) -> list[dict[str, Any] | None]:
    away, counters, pace = "unplugged" in facts.troubles, session.counters, facts.pace
    slow = faults.slow(facts) is not None
    numbers = [counters.late, counters.lost, counters.refused]
    names = "Late, lost, refused"
    if counters.dropped:
        numbers, names = [*numbers, counters.dropped], f"{names}, dropped"
    return [
        _fact("Board", f"{_board(told)}{', gone' if away else ''}", warn=away) if _board(told) else None,
        _fact("Chip", told["fingerprint"]) if told.get("fingerprint") else None,
        _fact("Pairs a second", "0" if away else _rate(pace.per_s, facts.period_s), warn=away or slow),
        _fact(names, ", ".join(map(str, numbers)), warn=away or slow),
        *_settings(told),
        *_conditions(session.stream.source.conditions, facts.seen.baseline_s),
        *(_range(told, facts, number) for number in range(len(CHANNELS))),
    ]


def _fact(name: str, value: str, *, warn: bool = False, share: float | None = None) -> dict[str, Any]:
    return {"name": name, "value": value, "warn": warn, "share": share}


def _rate(per_s: float, period_s: float) -> str:
    told = f"{per_s:.1f}" if math.isfinite(per_s) else "-"
    return f"{told} of {1 / period_s:.1f}" if math.isfinite(period_s) else told


def _settings(told: Mapping[str, Any]) -> list[dict[str, Any]]:
    settings = told.get("configuration")
    if not isinstance(settings, dict):
        return []
    pins = " and ".join(f"EXC{pin}" for pin in _pins(settings).split(","))
    milliseconds = 1e3 * told["conversion_s"]
    return [
        _fact("Excitation", f"{pins}, {_LEVELS[settings['level']]}"),
        _fact("Conversion", f"CAPF {settings['capf']}, {milliseconds:.1f} ms{', chopped' if settings['chop'] else ''}"),
    ]


def _pins(settings: Mapping[str, Any]) -> str:
    hard, soft = (settings[name]["excitation"] for name in CHANNELS)
    return str(hard) if hard == soft else f"{hard},{soft}"


def _conditions(given: Any, baseline_s: float) -> list[dict[str, Any]]:
    """Return temperature and supply, if they are measured."""
    known = [each for each in given if "temperature_C" in each]
    if not known:
        return []
    newest, before = known[-1], [each for each in known if each["t_s"] <= baseline_s]
    temperature = f"{newest['temperature_C']:.1f} °C"
    if before and before[-1] is not newest:
        temperature += f", {newest['temperature_C'] - before[-1]['temperature_C']:+.1f} since the baseline"
    elif len(known) == 1:
        temperature += " at the begin"
    found = [_fact("Temperature", temperature)]
    if (supply := newest.get("supply_V")) is not None:
        found.append(_fact("Supply", f"{supply:.2f} V", warn=not SUPPLY_V[0] <= supply <= SUPPLY_V[1]))
    return found


def _range(told: Mapping[str, Any], facts: Facts, number: int) -> dict[str, Any] | None:
    """Return how much of its range a channel uses."""
    reading, full, settings = facts.seen.readings[number], facts.full_scale_pF, told.get("configuration")
    name = CHANNELS[number].capitalize()
    if isinstance(settings, dict):
        name += f", CIN{settings['hard_input'] if number == 0 else 3 - settings['hard_input']}"
    if not math.isfinite(reading) or "unplugged" in facts.troubles:
        return _fact(name, "-", warn="unplugged" in facts.troubles)
    if not math.isfinite(full):
        return _fact(name, f"{reading:.4f} pF")
    share = min(abs(reading) / full, 1.0)
    return _fact(name, f"{100 * share:.0f} % of range", warn=share > _NEAR_LIMIT, share=round(share, 2))
