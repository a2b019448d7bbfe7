"""Configuration of the AD7746: checked when it is created, before it is written to the chip."""

from dataclasses import dataclass, field, replace

from palpate.ad7746 import registers
from palpate.errors import ProtocolError
from palpate.samples import Status

# Numbers of the two channels, in the order in which a pair is read.
HARD = 0
SOFT = 1
NAMES = ("hard", "soft")
SATURATION = (Status.HARD_SATURATED, Status.SOFT_SATURATED)

# Bits that must read back as written: the mode returns to idle by itself when a conversion ends.
_MASK = bytes([0xFF, 0xFF, 0xFF, 0xF8, 0xFF, 0xFF, 0xFF, 0xFF])


@dataclass(frozen=True)
class Channel:
    """Settings of one channel.

    The chip has one set of these registers; the driver writes them again for each channel.

    Attributes
    ----------
    capdac : int
        -127 to 127 steps of about 0.164 pF. They move the range of +-4.096 pF to the idle signal;
        see `Ad7746.auto_capdac`.
    excitation : str
        Driven excitation pins: "A", "B" or "AB". The guide of the evaluation kit puts a sensor on
        EXCB.

    Raises
    ------
    ValueError
        A value is outside its range.

    Examples
    --------
    >>> Channel(capdac=5).range_registers.hex()
    '85008000'
    """

    capdac: int = 0
    excitation: str = "B"

    def __post_init__(self) -> None:
        """Check the ranges."""
        registers.dac_registers(self.capdac)
        if self.excitation not in registers.EXCITATION:
            allowed = ", ".join(registers.EXCITATION)
            raise ValueError(f"excitation: got {self.excitation!r}, allowed: {allowed}")

    @property
    def range_registers(self) -> bytes:
        """Bytes of the registers CAPDAC_A, CAPDAC_B and CAP_OFFSET; the offset is always 0."""
        return registers.dac_registers(self.capdac) + registers.OFFSET_ZERO.to_bytes(2, "big")


@dataclass(frozen=True)
class Configuration:
    """All settings of the converter.

    Attributes
    ----------
    capf : int
        Speed, 0 (11 ms for a conversion) to 7 (110 ms); 4 (62 ms) rejects mains frequency.
    hard, soft : Channel
        Settings of the two channels.
    hard_input : int
        Input of the hard bump: 1 (CIN1) or 2 (CIN2); the soft bump uses the other one.
    level : int
        Excitation voltage, 0 to 3: +-VDD/8, VDD/4, 3/8 VDD, VDD/2.
    chop : bool
        Bit CAPCHOP: chopping of the capacitive channel.
    differential : bool
        Bit CAPDIFF: measure CIN+ minus CIN-; False: CIN+ alone.

    Raises
    ------
    ValueError
        A value is outside its range.

    Examples
    --------
    >>> setup, in_range = Configuration(capf=4, soft=Channel(capdac=7)).registers(SOFT)
    >>> setup.hex(), in_range.hex()
    ('c0002322', '87008000')
    """

    capf: int = 0
    hard: Channel = field(default_factory=Channel)
    soft: Channel = field(default_factory=Channel)
    hard_input: int = 1
    level: int = 3
    chop: bool = False
    differential: bool = False

    def __post_init__(self) -> None:
        """Check the ranges."""
        _require_in("capf", self.capf, range(8))
        _require_in("hard_input", self.hard_input, range(1, 3))
        _require_in("level", self.level, range(4))

    def channel(self, number: int) -> Channel:
        """Return the hard (0) or the soft (1) channel."""
        return (self.hard, self.soft)[number]

    def input(self, number: int) -> int:
        """Return the input of a channel: 1 (CIN1) or 2 (CIN2)."""
        return self.hard_input if number == HARD else 3 - self.hard_input

    def with_capdac(self, number: int, steps: int) -> "Configuration":
        """Return a copy with other CAPDAC steps of one channel."""
        channel = replace(self.channel(number), capdac=steps)
        if number == HARD:
            return replace(self, hard=channel)
        return replace(self, soft=channel)

    def registers(self, number: int) -> tuple[bytes, bytes]:
        """Return the bytes of registers 07 to 0A and 0B to 0E for one conversion of a channel."""
        channel = self.channel(number)
        setup = registers.CAPEN
        if self.input(number) == 2:
            setup |= registers.CIN2
        if self.differential:
            setup |= registers.CAPDIFF
        if self.chop:
            setup |= registers.CAPCHOP
        excitation = registers.EXCITATION[channel.excitation] | self.level
        return bytes([setup, 0, excitation, self._config]), channel.range_registers

    def voltage_registers(self, mode: int) -> bytes:
        """Return the bytes of registers 07 to 0A to read VT_TEMPERATURE or VT_SUPPLY once."""
        return bytes([0, registers.VTEN | mode | registers.VTCHOP, self.level, self._config])

    @property
    def _config(self) -> int:
        return self.capf << 3 | registers.SINGLE

    @property
    def conversion_s(self) -> float:
        """Duration of a conversion, s."""
        return registers.CONVERSION_S[self.capf]


def require_same(wanted: bytes, image: bytes) -> None:
    """Raise ProtocolError if registers from 0x07 on, except the mode, are not as written."""
    for index, wrote in enumerate(wanted):
        register = registers.CAP_SETUP + index
        got = image[register]
        if (wrote ^ got) & _MASK[index]:
            raise ProtocolError(
                f"register 0x{register:02X}: got 0x{got:02X}, wrote 0x{wrote:02X}: "
                "another program uses the board, or the chip had no supply"
            )


def _require_in(name: str, value: int, allowed: range) -> None:
    if value not in allowed:
        limits = f"{allowed[0]} to {allowed[-1]}"
        raise ValueError(f"{name}: got {value!r}, allowed: {limits}")
