"""The very bytes of a session: each request, in its order, and nothing more."""

import math
from collections import deque

from kit_bench import pair_of
from palpate.ad7746.bus import VirtualClock
from palpate.ad7746.configuration import Channel, Configuration
from palpate.ad7746.driver import Ad7746
from palpate.ad7746.evalkit.usb_bus import EvalKit
from palpate.ad7746.simulator.chip import SimulatedChip
from palpate.ad7746.simulator.evalboard import Reply, SimulatedBoard
from palpate.ad7746.simulator.usb_backend import SimulatedUsb

# Kind, request, value, index; to the board (40) the data, from it (C0) the count and the answer. The start, the hard, the soft.
COUNT = "C0 DF 0000 0000 1: 00"  # after each access to the bus
ACCESSES = """\
40 DC 0090 0000: BF
40 DD 0090 000B: 85 00 80 00
40 DD 0090 0007: 80 00 23 00
C0 DD 0090 0000 19: 07 00 00 00 00 00 00 80 00 23 00 85 00 80 00 66 CC 5C 90
40 DD 0090 000B: 85 00 80 00
40 DD 0090 0007: 80 00 23 02
C0 DB 0000 0000 1: 88
C0 DB 0000 0000 1: 80
C0 DD 0090 0000 15: 02 80 F7 20 00 00 00 80 00 23 00 85 00 80 00
40 DD 0090 000B: 00 81 80 00
40 DD 0090 0007: C0 00 23 02
C0 DB 0000 0000 1: 80
C0 DD 0090 0000 15: 02 80 00 00 00 00 00 C0 00 23 00 00 81 80 00
"""


class Script(SimulatedBoard):
    """Says what is written, to who asks as is written; anything else is an error, and so is silence."""

    def __init__(self, clock: VirtualClock) -> None:
        super().__init__(SimulatedChip(lambda pin, begin_s, end_s: math.nan), clock)
        self.left = deque([COUNT])  # is the firmware there?
        for access in ACCESSES.splitlines():
            self.left += [access] if " DB " in access else [access, COUNT]

    def control(
        self, kind: int, request: int, value: int, index: int, length: int, data: bytes = b""
    ) -> Reply:
        asked, said = self.left.popleft().split(": ")
        got = f"{kind:02X} {request:02X} {value:04X} {index:04X}"
        if kind & 0x80:
            assert f"{got} {length}" == asked
            return Reply(bytes.fromhex(said))
        assert (got, data.hex(" ").upper()) == (asked, said)
        return Reply(taken=len(data))


def test_a_pair() -> None:
    clock = VirtualClock()
    script = Script(clock)
    backend = SimulatedUsb(clock)
    backend.plug(script)
    driver = Ad7746(
        EvalKit(backend=backend, clock=clock),
        Configuration(hard=Channel(capdac=5), soft=Channel(capdac=-1)),
        clock,
    )
    driver.start()
    sample = pair_of(driver, 0)
    driver.close()
    assert not script.left
    assert sample is not None
    assert (sample.seq, sample.hard_raw, sample.soft_raw, sample.status) == (
        0,
        0x80F720,
        0x800000,
        0,
    )
    assert (sample.hard, sample.soft) == (0.030890625, 0.0)
