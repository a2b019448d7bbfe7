"""The registers by name, with their bits in words."""

from collections.abc import Callable
from typing import NamedTuple

from palpate.ad7746 import registers


class Register(NamedTuple):
    """A register, or two of one value: first address, name, content, bits in words."""

    address: int
    name: str
    content: bytes
    words: str


def named(dump: bytes) -> list[Register]:
    """Return the registers of a dump by name."""
    if len(dump) != registers.REGISTERS:
        raise ValueError(f"dump: got {len(dump)} bytes, allowed: {registers.REGISTERS}")
    found = []
    for (address, name, words), end in zip(
        _REGISTERS, [*(begin for begin, *_ in _REGISTERS[1:]), None], strict=True
    ):
        content = dump[address:end]
        found.append(Register(address, name, content, words(int.from_bytes(content, "big"))))
    return found


def _status(value: int) -> str:
    ready = [("capacitance", registers.RDYCAP), ("voltage or temperature", registers.RDYVT)]
    new = [name for name, bit in ready if not value & bit]
    excitation = (
        "excitation shorted or overloaded" if value & registers.EXCERR else "excitation not faulty"
    )
    return f"new data: {', '.join(new) or 'none'}; {excitation}"


def _cap_setup(value: int) -> str:
    if not value & registers.CAPEN:
        return "off"
    words = f"capacitive channel on, {'CIN2' if value & registers.CIN2 else 'CIN1'}"
    return (
        words
        + ", differential" * bool(value & registers.CAPDIFF)
        + ", chopped" * bool(value & registers.CAPCHOP)
    )


def _vt_setup(value: int) -> str:
    mode = ("internal temperature", "external temperature", "supply", "external voltage")[
        value >> 5 & 3
    ]
    return (
        f"measures {mode}" + ", chopped" * (value & registers.VTCHOP)
        if value & registers.VTEN
        else "off"
    )


def _exc_setup(value: int) -> str:
    driven = [
        name for name, bit in (("EXCA", registers.EXCA), ("EXCB", registers.EXCB)) if value & bit
    ]
    return f"{' and '.join(driven) or 'none'} driven, +-{('VDD/8', 'VDD/4', 'VDD*3/8', 'VDD/2')[value & 3]}"


_MODES = ("idle", "continuous", "single", "power-down", "reserved", "offset calibration", "gain calibration",
          "reserved")  # fmt: skip


def _config(value: int) -> str:
    cap, vt = registers.CONVERSION_S[value >> 3 & 7], registers.VT_CONVERSION_S[value >> 6]
    return f"{_MODES[value & 7]}; CAPF {value >> 3 & 7}: {1e3 * cap:.1f} ms, VTF {value >> 6}: {1e3 * vt:.1f} ms"


def _dac(value: int) -> str:
    steps = value & registers.DAC_STEPS
    return (
        f"{steps} steps, about {steps * registers.DAC_STEP_PF:.2f} pF"
        if value & registers.DAC_ENABLE
        else "off"
    )


def _voltage(value: int) -> str:
    return f"{registers.temperature_C(value):.2f} C, or {registers.supply_V(value):.3f} V, by VTMD of that conversion"


_REGISTERS: list[tuple[int, str, Callable[[int], str]]] = [
    (registers.STATUS, "STATUS", _status),
    (registers.CAP_DATA, "CAP_DATA", lambda value: f"{registers.capacitance_pF(value):.6f} pF after the CAPDACs"),
    (registers.VT_DATA, "VT_DATA", _voltage),
    (registers.CAP_SETUP, "CAP_SETUP", _cap_setup),
    (registers.VT_SETUP, "VT_SETUP", _vt_setup),
    (registers.EXC_SETUP, "EXC_SETUP", _exc_setup),
    (registers.CONFIG, "CONFIG", _config),
    (registers.CAPDAC_A, "CAPDAC_A", _dac),
    (registers.CAPDAC_B, "CAPDAC_B", _dac),
    (registers.CAP_OFFSET, "CAP_OFFSET",
     lambda value: f"{(value - registers.OFFSET_ZERO) * registers.OFFSET_STEP_PF:+.5f} pF"),
    (registers.CAP_GAIN, "CAP_GAIN", lambda _: "set in the factory"),
    (registers.VOLT_GAIN, "VOLT_GAIN", lambda _: "set in the factory"),
]  # fmt: skip
