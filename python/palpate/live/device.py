"""The device on the page: which board, how it is set, how it is; and what of it may be changed while it measures."""

import math
from collections.abc import Sequence

from palpate.ad7746.registers import CONVERSION_S, SUPPLY_V
from palpate.files import Json
from palpate.live.channel_status import CHANNELS
from palpate.live.connection import ConnectionState, can_centre
from palpate.live.instruction_rules import StatusInputs, slow
from palpate.live.measurement import PRESSED, LiveMeasurement
from palpate.live.page_commands import DeviceCommand
from palpate.live.protocol import DeviceFact, DeviceMessage, DeviceOption, RefusedCommand
from palpate.sources import Conditions
from palpate.sources.board import ConverterOptions
from palpate.sources.options import split
from palpate.stream import StreamCounters

_CHANGED = ("usb", "i2c", "sim")  # sources that take the options of `ConverterOptions`
_LEVELS = ("1/8", "1/4", "3/8", "1/2")  # of the supply, both ways
_PINS: list[int | str] = ["B", "A", "AB", "B,A", "A,B"]
_CAPF = "Conversion, CAPF: 0 is the fastest (11 ms), 7 has the least noise (110 ms); only 4 (62 ms) rejects the mains"
_EXCITATION = "Excitation pins of both bumps; of two, separated by a comma: hard, soft"
_COUNTED = "Pairs of readings: that came late; that never came; without a usable value; dropped: not estimated, but recorded"
_NEAR_LIMIT = 0.9  # of the range


class Device:
    """The device of a measurement: its message, and the buttons Set and Centre. `source`: its name, as the user gave it."""

    def __init__(self, measurement: LiveMeasurement, state: ConnectionState, source: str) -> None:
        self._measurement = measurement
        self._state = state
        self._is_ours = split(source)[0] in _CHANGED

    def document(self) -> DeviceMessage:
        """Return the message `device`."""
        stream = self._measurement.stream
        device = self._measurement.device()
        conditions = self._state.measured_conditions
        return DeviceMessage(
            _facts(device, self._state.inputs, stream.counters, conditions),
            self._options(device),
            can_centre(stream.source),
        )

    def set(self, command: DeviceCommand) -> str:
        """Begin a new measurement with these options; return the message."""
        if not self._is_ours:
            raise RefusedCommand("device: this source has no settings")
        self._require_free("device")
        changed = command.changed()
        ConverterOptions.parse("device", changed)
        now = self._options(self._measurement.device())
        texts = []
        for name, value in changed.items():
            text = f"{name} {value}"
            if name in now:
                text += f", before {now[name].value}"
            texts.append(text)
        text = ", ".join(texts)
        self._measurement.reopen(changed, f"the converter was set again: {text}")
        return f"A new measurement has started: {text}."

    def centre(self) -> str:
        """Set the range again; return the message."""
        self._require_free("centre")
        self._measurement.stream.centre()
        return "The range is set again. If it moves, the baseline is measured again: do not touch anything."

    def _options(self, device: Json) -> dict[str, DeviceOption]:
        settings = device.get("configuration")
        if not settings or not self._is_ours:
            return {}
        conversions: list[int | str] = list(range(len(CONVERSION_S)))
        return {
            "capf": DeviceOption(settings["capf"], conversions, _CAPF),
            "excitation": DeviceOption(_pins(settings), _PINS, _EXCITATION),
        }

    def _require_free(self, command: str) -> None:
        self._measurement.require_running(command)
        is_pressed = self._measurement.tracker_state.state in PRESSED
        if is_pressed and not self._measurement.stream.out_of_range:
            raise RefusedCommand(f"{command}: the probe is in contact; lift it first")


def _board(device: Json) -> str:
    """Return name and place of a board."""
    simulated = "simulated " if "simulated" in device else ""
    if isinstance(device.get("device"), dict):
        device = device["device"]
    place = device.get("bus") or device.get("path") or device.get("port")
    if "usb" in device:
        place = f"USB {device['bus']}/{device['address']}"
    return simulated + ", ".join(str(part) for part in (device.get("name"), place) if part)


def _facts(
    device: Json,
    inputs: StatusInputs,
    counters: StreamCounters,
    conditions: Sequence[Conditions],
) -> list[DeviceFact]:
    is_gone = "unplugged" in inputs.troubles
    found = []
    board = _board(device)
    if board:
        if is_gone:
            board += ", gone"
        found.append(DeviceFact("Board", board, is_gone))
    if device.get("fingerprint"):
        found.append(DeviceFact("Chip", device["fingerprint"]))
    found += _rate_and_counts(inputs, counters, is_gone=is_gone)
    found += _settings(device)
    found += _conditions(conditions, inputs.seen.baseline_s)
    for number in range(len(CHANNELS)):
        found.append(_range(device, inputs, number))
    return found


def _rate_and_counts(
    inputs: StatusInputs, counters: StreamCounters, *, is_gone: bool
) -> list[DeviceFact]:
    """Return the rate of the pairs, and how many were not usual."""
    per_s = inputs.pace.per_s
    rate = "-"
    if math.isfinite(per_s):
        rate = f"{per_s:.1f}"
    if math.isfinite(inputs.period_s):
        rate += f" of {1 / inputs.period_s:.1f}"
    if is_gone:
        rate = "0"
    warn = is_gone or slow(inputs) is not None
    numbers = {"Late": counters.late, "lost": counters.lost, "refused": counters.refused}
    if counters.dropped:
        numbers["dropped"] = counters.dropped
    counts = ", ".join(map(str, numbers.values()))
    return [
        DeviceFact("Pairs a second", rate, warn),
        DeviceFact(", ".join(numbers), counts, warn, title=_COUNTED),
    ]


def _settings(device: Json) -> list[DeviceFact]:
    settings = device.get("configuration")
    if not isinstance(settings, dict):
        return []
    pins = " and ".join(f"EXC{pin}" for pin in _pins(settings).split(","))
    level = f"±{_LEVELS[settings['level']]} of the supply ({pins})"
    chopped = ", chopped" if settings["chop"] else ""
    conversion = f"{1e3 * device['conversion_s']:.1f} ms{chopped} (CAPF {settings['capf']})"
    return [
        DeviceFact("Excitation", level, title=_EXCITATION),
        DeviceFact("Conversion", conversion, title=_CAPF),
    ]


def _pins(settings: Json) -> str:
    hard = str(settings["hard"]["excitation"])
    soft = str(settings["soft"]["excitation"])
    return hard if hard == soft else f"{hard},{soft}"


def _conditions(measured: Sequence[Conditions], baseline_s: float) -> list[DeviceFact]:
    """Return temperature and supply, if they are measured."""
    known = [each.as_dict() for each in measured if "temperature_C" in each.values]
    if not known:
        return []
    newest = known[-1]
    before = [each for each in known if each["t_s"] <= baseline_s]
    temperature = f"{newest['temperature_C']:.1f} °C"
    if before and before[-1] is not newest:
        change = newest["temperature_C"] - before[-1]["temperature_C"]
        temperature += f", {change:+.1f} since the baseline"
    elif len(known) == 1:
        temperature += " at the begin"
    found = [DeviceFact("Temperature", temperature)]
    supply = newest.get("supply_V")
    if supply is not None:
        is_wrong = not SUPPLY_V[0] <= supply <= SUPPLY_V[1]
        found.append(DeviceFact("Supply", f"{supply:.2f} V", is_wrong))
    return found


def _range(device: Json, inputs: StatusInputs, number: int) -> DeviceFact:
    """Return how much of its range a channel uses."""
    reading = inputs.seen.channels[number].reading
    full_pF = inputs.full_scale_pF
    settings = device.get("configuration")
    name = CHANNELS[number].capitalize()
    if isinstance(settings, dict):
        hard_input = settings["hard_input"]
        inputs_of_chip = (hard_input, 3 - hard_input)
        name += f", CIN{inputs_of_chip[number]}"
    is_gone = "unplugged" in inputs.troubles
    if is_gone or not math.isfinite(reading):
        return DeviceFact(name, "-", is_gone)
    if not math.isfinite(full_pF):
        return DeviceFact(name, f"{reading:.4f} pF")
    share = min(abs(reading) / full_pF, 1.0)
    text = f"{100 * share:.0f} % of range"
    return DeviceFact(name, text, share > _NEAR_LIMIT, round(share, 2))
