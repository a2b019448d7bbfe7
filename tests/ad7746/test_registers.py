"""The converter's numbers, and what is refused before it is written."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from palpate.ad7746 import registers
from palpate.ad7746.configuration import HARD, SOFT, Channel, Configuration, require_same
from palpate.errors import ProtocolError


@pytest.mark.parametrize(
    ("code", "capacitance_pF"),
    [
        (0x000000, -4.096),
        (0x800000, 0.0),
        (0xFFFFFF, 4.096 * (2**24 - 2) / 2**24),
        (0x80F720, 0.030890625),
    ],
)
def test_vectors(code: int, capacitance_pF: float) -> None:
    assert registers.capacitance_pF(code) == capacitance_pF
    assert registers.temperature_C(0x800000 - 2048 * 40) == -40.0


@given(st.integers(0, registers.LAST_CODE))
def test_every_code_comes_back(code: int) -> None:
    assert registers.capacitance_code(registers.capacitance_pF(code)) == code
    assert registers.is_saturated(code) == (code < 500 or code > registers.LAST_CODE - 500)


@pytest.mark.parametrize("code", [-1, 2**24])
def test_a_code_has_24_bits(code: int) -> None:
    for function in (registers.capacitance_pF, registers.is_saturated, registers.temperature_C):
        with pytest.raises(ValueError, match=rf"code: got {code}, allowed: 0 to 16777215"):
            function(code)


@pytest.mark.parametrize(
    ("register", "data", "text"),
    [
        (0x06, "07", "allowed: 0x07 to 0x0E"),
        (0x0E, "0000", "allowed: 0x07 to 0x0E"),  # CAP_GAIN is the factory's
        (0x07, "80000b0200", "one burst"),
    ],
)
def test_a_write_that_is_refused(register: int, data: str, text: str) -> None:
    with pytest.raises(ValueError, match=text):
        registers.check_write(register, bytes.fromhex(data))


@pytest.mark.parametrize(
    ("kind", "settings", "text"),
    [
        (Configuration, {"capf": 8}, "capf: got 8, allowed: 0 to 7"),
        (Configuration, {"hard_input": 3}, "hard_input: got 3, allowed: 1 to 2"),
        (Channel, {"capdac": 128}, "capdac: got 128, allowed: -127 to 127"),
        (Channel, {"excitation": "C"}, "excitation: got 'C', allowed: A, B, AB"),
    ],
)
def test_a_setting_that_is_refused(kind: type, settings: dict[str, object], text: str) -> None:
    with pytest.raises(ValueError, match=text):
        kind(**settings)


def test_the_two_channels_share_the_range_registers_and_nothing_is_left_over_from_the_other() -> (
    None
):
    both = Configuration(capf=3, hard=Channel(capdac=5, excitation="AB"), soft=Channel(capdac=-2))
    assert [part.hex() for part in both.registers(HARD)] == ["80002b1a", "85008000"]
    assert [part.hex() for part in both.registers(SOFT)] == ["c000231a", "00828000"]
    assert both.voltage_registers(registers.VT_TEMPERATURE).hex() == "0081031a"


@given(st.binary(min_size=8, max_size=8), st.integers(0, 7), st.integers(1, 255))
def test_a_changed_register_is_found(wanted: bytes, number: int, flipped: int) -> None:
    image = bytearray(registers.CAP_SETUP) + wanted
    image[registers.CAP_SETUP + number] ^= flipped
    if number == 3 and flipped < 8:  # a conversion that ended leaves the chip idle
        require_same(wanted, bytes(image))
        return
    with pytest.raises(
        ProtocolError, match=rf"register 0x{registers.CAP_SETUP + number:02X}: got 0x"
    ):
        require_same(wanted, bytes(image))
