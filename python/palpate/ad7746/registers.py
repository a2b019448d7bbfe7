"""The AD7746 capacitance-to-digital converter: facts of its data sheet, rev. 0, as pure functions.

Nothing here accesses a chip; see `palpate.ad7746.driver`. Not tried on hardware.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

I2C_ADDRESS = 0x48

# Registers.
STATUS = 0x00
CAP_DATA = 0x01
VT_DATA = 0x04
CAP_SETUP = 0x07
VT_SETUP = 0x08
EXC_SETUP = 0x09
CONFIG = 0x0A
CAPDAC_A = 0x0B
CAPDAC_B = 0x0C
CAP_OFFSET = 0x0D
CAP_GAIN = 0x0F
VOLT_GAIN = 0x11
REGISTERS = 0x13  # Number of registers.
# Sent instead of a register address, this byte resets the chip, which then needs up to `RESET_S`.
RESET_POINTER = 0xBF
RESET_S = 200e-6
# STATUS to CAP_OFFSET after a reset; the registers after them are set in the factory.
RESET_VALUES = bytes([0x07, 0, 0, 0, 0, 0, 0, 0, 0, 0x03, 0xA0, 0, 0, 0x80, 0x00])

# STATUS: a RDY bit that is 0 means ready.
EXCERR = 0x08
RDY = 0x04
RDYVT = 0x02
RDYCAP = 0x01
# CAP_SETUP.
CAPEN = 0x80
CIN2 = 0x40
CAPDIFF = 0x20
CAPCHOP = 0x01
# VT_SETUP: VTMD, bits 6-5, selects the measured quantity; VTCHOP must be set.
VTEN = 0x80
VT_TEMPERATURE = 0x00
VT_SUPPLY = 0x40
VTCHOP = 0x01
# EXC_SETUP: the two excitation pins, and the level in the lowest two bits.
EXCB = 0x20
EXCA = 0x08
EXCITATION = {"A": EXCA, "B": EXCB, "AB": EXCA | EXCB}
# CONFIG: VTF in bits 7-6, CAPF in 5-3, the mode in 2-0.
IDLE, CONTINUOUS, SINGLE, POWER_DOWN = range(4)
DAC_ENABLE = 0x80
DAC_STEPS = 127
# Typical; differs by +-20 % between chips and is not calibrated: do not add it to a reading.
DAC_STEP_PF = 0.164
OFFSET_ZERO = 0x8000
OFFSET_STEP_PF = 31.25e-6

# Conversion time, s, for the setting CAPF, 0 to 7 (data sheet, rev. 0).
CONVERSION_S = (0.0110, 0.0119, 0.0200, 0.0380, 0.0620, 0.0770, 0.0920, 0.1096)
# Noise of a conversion, pF rms, for CAPF 0 to 7 (data sheet, rev. 0).
NOISE_PF = (40.0e-6, 27.3e-6, 12.2e-6, 7.3e-6, 5.4e-6, 4.9e-6, 4.4e-6, 4.2e-6)
# Conversion time of voltage and temperature, s, for VTF 0 to 3 (data sheet, rev. 0).
VT_CONVERSION_S = (0.0201, 0.0321, 0.0621, 0.1221)
REFERENCE_V = 1.17  # Internal reference of the voltage channel, typical.
SUPPLY_V = (2.7, 5.25)  # Supply that the chip is specified for, V.
MAINS_CAPF = 4  # The only CAPF that rejects 50 and 60 Hz; at faster settings they alias.
FULL_SCALE_PF = 4.096
CODES_PER_PF = 2**24 / (2 * FULL_SCALE_PF)
ZERO_CODE = 0x800000
LAST_CODE = 0xFFFFFF
SATURATED_CODES = 500  # A code nearer than this to either end of the range is saturated.
# Largest capacitance that is not saturated: the `full_scale` of a tracker.
SATURATED_PF = FULL_SCALE_PF - SATURATED_CODES / CODES_PER_PF
# Integral nonlinearity, typical, .01 % of the full scale.
LINEARITY_PF = 1e-4 * FULL_SCALE_PF


def linearity_pF(full_scale_pF: float) -> float:
    """Return the standard deviation of a reading by the linearity of the chip, pF.

    The limit of the data sheet is taken as the limit of a uniform distribution (JCGM 100:2008, 4.3.7).
    For another converter it is not known: 0.

    Parameters
    ----------
    full_scale_pF : float
        Full scale of the readings; `SATURATED_PF` for readings of the chip only.

    Returns
    -------
    float
        0.24 fF, or 0.

    Examples
    --------
    >>> round(1e3 * linearity_pF(SATURATED_PF), 2), linearity_pF(math.inf)
    (0.24, 0.0)
    """
    if full_scale_pF != SATURATED_PF:
        return 0.0
    return LINEARITY_PF / math.sqrt(3)


def capacitance_pF(code: int) -> float:
    """Convert a 24-bit code to pF.

    Parameters
    ----------
    code : int
        0 to 0xFFFFFF.

    Returns
    -------
    float
        Capacitance after the compensation by the CAPDACs, -4.096 to 4.096 pF.

    Raises
    ------
    ValueError
        The code is outside 0 to 0xFFFFFF.

    Examples
    --------
    >>> capacitance_pF(0x80F720)
    0.030890625
    """
    return (_code(code) - ZERO_CODE) / CODES_PER_PF


def capacitance_code(capacitance_pF: float) -> int:
    """Convert pF to the nearest code; outside the range, to the first or last one.

    Parameters
    ----------
    capacitance_pF : float
        Capacitance, pF; codes cover -4.096 to 4.096.

    Returns
    -------
    int
        0 to 0xFFFFFF.

    Examples
    --------
    >>> hex(capacitance_code(0.030890625)), hex(capacitance_code(9.0))
    ('0x80f720', '0xffffff')
    """
    return min(max(round(capacitance_pF * CODES_PER_PF) + ZERO_CODE, 0), LAST_CODE)


def is_saturated(code: int) -> bool:
    """Return whether a code is saturated: too near to an end of the range.

    Parameters
    ----------
    code : int
        0 to 0xFFFFFF.

    Returns
    -------
    bool

    Raises
    ------
    ValueError
        The code is outside 0 to 0xFFFFFF.

    Examples
    --------
    >>> is_saturated(LAST_CODE), is_saturated(ZERO_CODE)
    (True, False)
    """
    return not SATURATED_CODES <= _code(code) <= LAST_CODE - SATURATED_CODES


def temperature_C(code: int) -> float:
    """Convert a code of the internal temperature sensor to degrees Celsius.

    Parameters
    ----------
    code : int
        0 to 0xFFFFFF.

    Returns
    -------
    float
        -4096 to 4096; the sensor is specified for -40 to 85.

    Raises
    ------
    ValueError
        The code is outside 0 to 0xFFFFFF.

    Examples
    --------
    >>> temperature_C(0x80C800)
    25.0
    """
    return _code(code) / 2048 - 4096


def supply_V(code: int) -> float:
    """Convert a code of the supply monitor, which measures a sixth of the supply, to V."""
    return (_code(code) - ZERO_CODE) / 2**23 * 6 * REFERENCE_V


def _code(code: int) -> int:
    if not 0 <= code <= LAST_CODE:
        raise ValueError(f"code: got {code}, allowed: 0 to {LAST_CODE}")
    return code


def dac_registers(steps: int) -> bytes:
    """Return the bytes of CAPDAC_A and CAPDAC_B that move the range.

    Parameters
    ----------
    steps : int
        Steps of `DAC_STEP_PF`, -127 to 127. Above zero CAPDAC_A subtracts them from the input,
        below zero CAPDAC_B adds them; at zero both are off.

    Returns
    -------
    bytes
        CAPDAC_A and CAPDAC_B.

    Raises
    ------
    ValueError
        `steps` is outside -127 to 127.

    Examples
    --------
    >>> dac_registers(5).hex(), dac_registers(-1).hex(), dac_registers(0).hex()
    ('8500', '0081', '0000')
    """
    if not -DAC_STEPS <= steps <= DAC_STEPS:
        raise ValueError(f"capdac: got {steps}, allowed: {-DAC_STEPS} to {DAC_STEPS}")
    if steps == 0:
        return bytes([0, 0])
    code = abs(steps) | DAC_ENABLE
    return bytes([code, 0]) if steps > 0 else bytes([0, code])


def check_write(register: int, data: bytes) -> None:
    """Raise ValueError for a register write that the chip does not allow.

    Parameters
    ----------
    register : int
        Address of the first register.
    data : bytes
        Values of this register and the following ones.

    Raises
    ------
    ValueError
        A register is read-only or set in the factory; CONFIG and a CAPDAC are in one burst: the
        conversion would start before the CAPDACs are loaded.

    Examples
    --------
    >>> check_write(CAP_SETUP, bytes([CAPEN, 0, 0x0B, SINGLE]))
    >>> check_write(CAP_GAIN, b"ab")
    Traceback (most recent call last):
    ValueError: register: got 0x0F to 0x10, allowed: 0x07 to 0x0E
    """
    end = register + len(data)
    if not (data and register >= CAP_SETUP and end <= CAP_GAIN):
        raise ValueError(
            f"register: got 0x{register:02X} to 0x{end - 1:02X}, allowed: 0x07 to 0x0E"
        )
    if register <= CONFIG < end - 1:
        burst = f"0x{register:02X} to 0x{end - 1:02X} in one burst"
        raise ValueError(f"data: got {burst}, allowed: up to CONFIG, 0x0A")


class Register(NamedTuple):
    """A register, or two of one value: first address, name, content, and its bits in words."""

    address: int
    name: str
    content: bytes
    words: str


def describe_registers(dump: bytes) -> list[Register]:
    """Return the registers of a dump by name, with their bits in words."""
    if len(dump) != REGISTERS:
        raise ValueError(f"dump: got {len(dump)} bytes, allowed: {REGISTERS}")
    found = []
    ends = [address for address, _, _ in _REGISTER_MAP[1:]]
    for (address, name, describe), end in zip(_REGISTER_MAP, [*ends, REGISTERS], strict=True):
        content = dump[address:end]
        found.append(Register(address, name, content, describe(int.from_bytes(content, "big"))))
    return found


def _status(value: int) -> str:
    new = []
    if not value & RDYCAP:
        new.append("capacitance")
    if not value & RDYVT:
        new.append("voltage or temperature")
    fault = "shorted or overloaded" if value & EXCERR else "not faulty"
    return f"new data: {', '.join(new) or 'none'}; excitation {fault}"


def _cap_data(value: int) -> str:
    return f"{capacitance_pF(value):.6f} pF after the CAPDACs"


def _vt_data(value: int) -> str:
    temperature = f"{temperature_C(value):.2f} C"
    return f"{temperature}, or {supply_V(value):.3f} V, by VTMD of that conversion"


def _cap_setup(value: int) -> str:
    if not value & CAPEN:
        return "off"
    words = ["capacitive channel on", "CIN2" if value & CIN2 else "CIN1"]
    if value & CAPDIFF:
        words.append("differential")
    if value & CAPCHOP:
        words.append("chopped")
    return ", ".join(words)


_VT_MODES = ("internal temperature", "external temperature", "supply", "external voltage")


def _vt_setup(value: int) -> str:
    if not value & VTEN:
        return "off"
    words = f"measures {_VT_MODES[value >> 5 & 3]}"
    return f"{words}, chopped" if value & VTCHOP else words


_LEVELS = ("VDD/8", "VDD/4", "VDD*3/8", "VDD/2")


def _exc_setup(value: int) -> str:
    driven = [name for name, bit in (("EXCA", EXCA), ("EXCB", EXCB)) if value & bit]
    return f"{' and '.join(driven) or 'none'} driven, +-{_LEVELS[value & 3]}"


_MODES = (
    "idle",
    "continuous",
    "single",
    "power-down",
    "reserved",
    "offset calibration",
    "gain calibration",
    "reserved",
)


def _config(value: int) -> str:
    capf = value >> 3 & 7
    vtf = value >> 6
    capacitance = f"CAPF {capf}: {1e3 * CONVERSION_S[capf]:.1f} ms"
    voltage = f"VTF {vtf}: {1e3 * VT_CONVERSION_S[vtf]:.1f} ms"
    return f"{_MODES[value & 7]}; {capacitance}, {voltage}"


def _capdac(value: int) -> str:
    if not value & DAC_ENABLE:
        return "off"
    steps = value & DAC_STEPS
    return f"{steps} steps, about {steps * DAC_STEP_PF:.2f} pF"


def _cap_offset(value: int) -> str:
    return f"{(value - OFFSET_ZERO) * OFFSET_STEP_PF:+.5f} pF"


def _gain(_: int) -> str:
    return "set in the factory"


# First address, name, and a function that returns the bits in words.
_REGISTER_MAP: tuple[tuple[int, str, Callable[[int], str]], ...] = (
    (STATUS, "STATUS", _status),
    (CAP_DATA, "CAP_DATA", _cap_data),
    (VT_DATA, "VT_DATA", _vt_data),
    (CAP_SETUP, "CAP_SETUP", _cap_setup),
    (VT_SETUP, "VT_SETUP", _vt_setup),
    (EXC_SETUP, "EXC_SETUP", _exc_setup),
    (CONFIG, "CONFIG", _config),
    (CAPDAC_A, "CAPDAC_A", _capdac),
    (CAPDAC_B, "CAPDAC_B", _capdac),
    (CAP_OFFSET, "CAP_OFFSET", _cap_offset),
    (CAP_GAIN, "CAP_GAIN", _gain),
    (VOLT_GAIN, "VOLT_GAIN", _gain),
)
