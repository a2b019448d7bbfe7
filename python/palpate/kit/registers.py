"""The registers by name, with their bits in words."""

from collections.abc import Callable
from typing import NamedTuple

from palpate.ad7746 import datasheet


class Register(NamedTuple):
    """A register, or two of one value: first address, name, content, bits in words."""

    address: int
    name: str
    content: bytes
    words: str


def named(dump: bytes) -> list[Register]:
    """Return the registers of a dump by name.

    Parameters
    ----------
    dump : bytes
        All 19 registers, from STATUS on.

    Returns
    -------
    list of Register

    Raises
    ------
    ValueError
        Not 19 bytes.

    Examples
    --------
    >>> for register in named(bytes.fromhex("0780000080000080000b008800800066cc5c90"))[3:6]:
    ...     print(f"{register.address:02X} {register.name:10} {register.content.hex()}  {register.words}")
    07 CAP_SETUP  80  capacitive channel on, CIN1
    08 VT_SETUP   00  off
    09 EXC_SETUP  0b  EXCA driven, +-VDD/2
    """
    if len(dump) != datasheet.REGISTERS:
        raise ValueError(f"dump: got {len(dump)} bytes, allowed: {datasheet.REGISTERS}")
    found = []
    for (name, (address, words)), end in zip(_REGISTERS.items(), [*_BEGINS[1:], len(dump)], strict=True):
        content = dump[address:end]
        found.append(Register(address, name, content, words(int.from_bytes(content, "big"))))
    return found


def _status(value: int) -> str:
    ready = [("capacitance", datasheet.RDYCAP), ("voltage or temperature", datasheet.RDYVT)]
    new = [name for name, bit in ready if not value & bit]
    excitation = "excitation shorted or overloaded" if value & datasheet.EXCERR else "excitation not faulty"
    return f"new data: {', '.join(new) or 'none'}; {excitation}"


def _capacitance(value: int) -> str:
    return f"{datasheet.capacitance_pF(value):.6f} pF after the CAPDACs"


def _voltage(value: int) -> str:
    return f"{datasheet.temperature_C(value):.2f} C, or {datasheet.supply_V(value):.3f} V, by VTMD of that conversion"


def _cap_setup(value: int) -> str:
    return _listed(value, datasheet.CAPEN, [
        "capacitive channel on", "CIN2" if value & datasheet.CIN2 else "CIN1",
        "differential" if value & datasheet.CAPDIFF else "", "chopped" if value & datasheet.CAPCHOP else "",
    ])  # fmt: skip


def _vt_setup(value: int) -> str:
    modes = ("internal temperature", "external temperature", "supply", "external voltage")
    return _listed(value, datasheet.VTEN, [
        f"measures {modes[value >> 5 & 3]}", "chopped" if value & datasheet.VTCHOP else "",
    ])  # fmt: skip


def _listed(value: int, enable: int, parts: list[str]) -> str:
    return ", ".join(filter(None, parts)) if value & enable else "off"


def _exc_setup(value: int) -> str:
    driven = [name for name, bit in (("EXCA", datasheet.EXCA), ("EXCB", datasheet.EXCB)) if value & bit]
    return f"{' and '.join(driven) or 'none'} driven, +-{('VDD/8', 'VDD/4', 'VDD*3/8', 'VDD/2')[value & 3]}"


def _config(value: int) -> str:
    modes = ("idle", "continuous", "single", "power-down", "reserved", "offset calibration", "gain calibration")
    mode = modes[value & 7] if value & 7 < len(modes) else "reserved"
    cap, vt = datasheet.CONVERSION_S[value >> 3 & 7], datasheet.VT_CONVERSION_S[value >> 6]
    return f"{mode}; CAPF {value >> 3 & 7}: {1e3 * cap:.1f} ms, VTF {value >> 6}: {1e3 * vt:.1f} ms"


def _dac(value: int) -> str:
    steps = value & datasheet.DAC_STEPS
    return f"{steps} steps, about {steps * datasheet.DAC_STEP_PF:.2f} pF" if value & datasheet.DAC_ENABLE else "off"


def _offset(value: int) -> str:
    return f"{(value - datasheet.OFFSET_ZERO) * datasheet.OFFSET_STEP_PF:+.5f} pF"


def _factory(_: int) -> str:
    return "set in the factory"


_REGISTERS: dict[str, tuple[int, Callable[[int], str]]] = {
    "STATUS": (datasheet.STATUS, _status),
    "CAP_DATA": (datasheet.CAP_DATA, _capacitance),
    "VT_DATA": (datasheet.VT_DATA, _voltage),
    "CAP_SETUP": (datasheet.CAP_SETUP, _cap_setup),
    "VT_SETUP": (datasheet.VT_SETUP, _vt_setup),
    "EXC_SETUP": (datasheet.EXC_SETUP, _exc_setup),
    "CONFIG": (datasheet.CONFIG, _config),
    "CAPDAC_A": (datasheet.CAPDAC_A, _dac),
    "CAPDAC_B": (datasheet.CAPDAC_B, _dac),
    "CAP_OFFSET": (datasheet.CAP_OFFSET, _offset),
    "CAP_GAIN": (datasheet.CAP_GAIN, _factory),
    "VOLT_GAIN": (datasheet.VOLT_GAIN, _factory),
}
_BEGINS = [address for address, _ in _REGISTERS.values()]
