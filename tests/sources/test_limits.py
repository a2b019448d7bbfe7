"""Each limit that a page of the documentation promises is the one in the code."""

from typing import Any

import pytest
from palpate import line_protocol
from palpate.acceptance import chip_steps, driver_steps
from palpate.ad7746 import converter, driver, registers, wiring, wiring_watch
from palpate.ad7746.evalkit import usb_bus
from palpate.importers import units
from palpate.sources import iio, lsl, serial
from project import ROOT

LIMITS: list[tuple[str, str, Any, Any]] = [
    (
        "serial",
        "from 0.01 to 100 pF",
        (line_protocol.SMALLEST_PF, line_protocol.LARGEST_PF),
        (0.01, 100),
    ),
    ("serial", "a number from 1e30 on", units.OVERLOAD, 1e30),
    ("serial", "has at most 1000 bytes", line_protocol.LONGEST, 1000),
    ("serial", "If lines come for 10 s, and not one is read", serial.PATIENCE_S, 10),
    ("serial", "If no line is read in the first 5 s", serial.SETTLE_S, 5),
    (
        "serial",
        "3 times as fast as the computer's over the first 10 s",
        (serial.PACE, serial.PACE_S),
        (3, 10),
    ),
    ("serial", "gets 2 s ahead", serial.AHEAD_NS, 2e9),
    ("serial", "in 20 pairs in a row", serial.RESTARTS, 20),
    ("serial", "If no pair with both values comes for 10 s", serial.SILENCE_S, 10),
    (
        "serial",
        "longest time to wait for an unplugged port, s | 30 |",
        serial.SerialOptions.replug,
        30,
    ),
    (
        "serial",
        "| `baud` | bits per second | 115200 |",
        serial.SerialOptions.baud,
        115200,
    ),
    ("serial", "of 0.488 aF", round(1e6 / registers.CODES_PER_PF, 3), 0.488),
    ("kit", "the same code 8 times in a row", iio.SAME, 8),
    ("kit", "An offset is a multiple of 338646", iio.CODES_PER_STEP, 338646),
    ("kit", "up to 126 steps", iio.LAST_STEP, 126),
    ("kit", "A pair that takes 12 ms longer than usual", iio.LATE_NS, 12e6),
    ("sources", "longest time until the stream answers, 5 s", lsl.WAIT_S, 5),
    ("sources", "no sample comes for 5 s", lsl._SILENT_S, 5),
    ("sources", "Stamps 10 minutes or more from LSL's clock", lsl._FOREIGN_S, 600),
    (
        "sources",
        "longest time to wait for a stream that was lost, 30 s",
        lsl.LslOptions.replug,
        30,
    ),
    ("kit", "the I2C clock is 55 to 450 kHz", chip_steps._BUS_KHZ, (55, 450)),
    ("kit", "within 6 % of the data sheet", chip_steps._PACE, 0.06),
    ("kit", "more than 0.05 pF where a bump should be", wiring.EMPTY_PF, 0.05),
    ("kit", "in the range of 17 pF", wiring.MOST_PF, 17),
    (
        "kit",
        "0.164 pF within 20 %",
        (registers.DAC_STEP_PF, chip_steps._STEP_PF),
        (0.164, (0.13, 0.2)),
    ),
    ("kit", "61 pairs, by the driver", driver_steps._PAIRS, 60),
    ("kit", "the rate as described within 5 %", driver_steps._RATE, 0.05),
    ("kit", "times to 2 ms", driver_steps._MOST_US, 2000),
]
# What no page says, and a change would make the driver wrong or deaf.
INNER = [(driver.STREAK, 3), (driver.LIMIT_NS, 2_000_000), (usb_bus.TIMEOUT_MS, 200), (usb_bus._READY_S, 3), (converter._SHORTEST, 0.9),
         (converter._DRIFT, 2e-5), (wiring_watch.CONFIRM_S, 1), (serial.APART_NS, 1e10), (iio.STREAK, 3)]  # fmt: skip


@pytest.mark.parametrize(
    ("page", "words", "value", "expected"), LIMITS, ids=[words[:40] for _, words, *_ in LIMITS]
)
def test_a_limit_of_a_page(page: str, words: str, value: Any, expected: Any) -> None:
    text = " ".join((ROOT / "docs" / f"{page}.md").read_text(encoding="utf-8").split())
    assert words in text
    assert value == expected


def test_inner_limits() -> None:
    assert [value for value, _ in INNER] == [expected for _, expected in INNER]
