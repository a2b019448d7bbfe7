"""Configuration of the AD7746: checked when it is created, before it is written to the chip."""

from dataclasses import dataclass, field, replace

from palpate.ad7746 import registers
from palpate.errors import ProtocolError
from palpate.samples import Status

HARD, SOFT = 0, 1  # Numbers of the two channels, in the order in which a pair is read.
NAMES = ("hard", "soft")
SATURATION = (Status.HARD_SATURATED, Status.SOFT_SATURATED)

# Bits that must read back as written: the mode returns to idle by itself when a conversion ends.
_MASK = bytes([0xFF, 0xFF, 0xFF, 0xF8, 0xFF, 0xFF, 0xFF, 0xFF])


@dataclass(frozen=True)
class Channel:
    """Settings of one channel.

    The chip has one set of these registers; the driver rewrites them for each channel if the settings differ.

    Attributes
    ----------
    capdac : int
        -127 to 127 steps of about 0.164 pF. They move the range of +-4.096 pF to the idle signal; see
        `Ad7746.auto_capdac`.
    excitation : str
        Driven excitation pins: "A", "B" or "AB". The guide of the evaluation kit puts a sensor on EXCB.

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
            raise ValueError(
                f"excitation: got {self.excitation!r}, allowed: {', '.join(registers.EXCITATION)}"
            )

    @property
    def range_registers(self) -> bytes:
        """Bytes of the registers CAPDAC_A, CAPDAC_B and CAP_OFFSET, whose range the CAPDACs exceed: it is at its zero."""
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
        for name, allowed in (("capf", range(8)), ("hard_input", range(1, 3)), ("level", range(4))):
            if getattr(self, name) not in allowed:
                raise ValueError(
                    f"{name}: got {getattr(self, name)!r}, allowed: {allowed[0]} to {allowed[-1]}"
                )

    def channel(self, number: int) -> Channel:
        """Return the hard (0) or the soft (1) channel."""
        return (self.hard, self.soft)[number]

    def input(self, number: int) -> int:
        """Return the input of a channel: 1 (CIN1) or 2 (CIN2)."""
        return self.hard_input if number == HARD else 3 - self.hard_input

    def with_capdac(self, number: int, steps: int) -> "Configuration":
        """Return a copy with other CAPDAC steps of one channel."""
        channel = replace(self.channel(number), capdac=steps)
        return replace(self, hard=channel) if number == HARD else replace(self, soft=channel)

    def registers(self, number: int) -> tuple[bytes, bytes]:
        """Return the bytes of registers 0x07 to 0x0A and 0x0B to 0x0E for one conversion of a channel."""
        channel = self.channel(number)
        setup = registers.CAPEN | (registers.CIN2 if self.input(number) == 2 else 0)
        setup |= (registers.CAPDIFF if self.differential else 0) | (
            registers.CAPCHOP if self.chop else 0
        )
        excitation = registers.EXCITATION[channel.excitation] | self.level
        return bytes([setup, 0, excitation, self._config]), channel.range_registers

    def voltage_registers(self, mode: int) -> bytes:
        """Return the bytes of registers 0x07 to 0x0A for one reading of the voltage channel: VT_TEMPERATURE, VT_SUPPLY."""
        return bytes([0, registers.VTEN | mode | registers.VTCHOP, self.level, self._config])

    @property
    def _config(self) -> int:
        return self.capf << 3 | registers.SINGLE

    @property
    def conversion_s(self) -> float:
        """Duration of a conversion, s."""
        return registers.CONVERSION_S[self.capf]


def require_same(wanted: bytes, image: bytes) -> None:
    """Raise ProtocolError if registers from 0x07 on are not as they were written; the mode bits are not compared."""
    for register, (wrote, mask) in enumerate(zip(wanted, _MASK, strict=False), registers.CAP_SETUP):
        if (wrote ^ image[register]) & mask:
            why = "another program uses the board, or the chip had no supply"
            raise ProtocolError(
                f"register 0x{register:02X}: got 0x{image[register]:02X}, wrote 0x{wrote:02X}: {why}"
            )
