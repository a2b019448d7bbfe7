"""Lines as instruments print them: each is read right, or refused with a reason."""

import math
import re
from typing import Any

import pytest
from palpate import Status
from palpate.sources.options import split
from palpate.sources.serial.cells import Refused
from palpate.sources.serial.formats import Given
from palpate.sources.serial.settling import Settling
from palpate.sources.serial.strange import Strange
from project import ROOT
from serial_lines import Sent

PAGE = (ROOT / "docs" / "serial.md").read_text(encoding="utf-8")


def documented() -> list[Any]:
    """Return line, option and result of each row of the table on the page."""
    table = PAGE[PAGE.index("## Which lines are read") : PAGE.index("A test sends each")]
    rows = [re.split(r"(?<!\\)\|", row)[1:-1] for row in table.splitlines() if row.startswith("| `")]
    plain = [[cell.replace("\\|", "|").strip() for cell in row] for row in rows]
    return [pytest.param(line[1:-1], option, result, id=line[:24]) for line, option, result in plain]


@pytest.mark.parametrize(("line", "option", "result"), documented())
def test_the_table_of_the_page(line: str, option: str, result: str) -> None:
    name, _, value = option.partition("=")
    sent = Sent([line] * 2, **({name: value} if option else {}))
    if result.startswith("refused: "):
        assert not sent.samples
        assert not sent.said
        assert f"refused: {sent.refused}" == result
    else:
        assert sent.said == [f"{line.strip()!r} -> {result}"]
        assert sent.samples


def test_the_table_is_read() -> None:
    assert len(documented()) >= 30


HARD_SOFT = (6.92, 4.69)
READ = [
    "hard=6.92;soft=4.69",
    "hard: 6.92 soft: 4.69",
    "Hard = 6.92 pF | Soft = 4.69 pF",
    "HARD:6.92,SOFT:4.69",
    "hard_pF=6.92\tsoft_pF=4.69",
    "hard_fF=6920\tsoft_pf=4.69",
    "C1 (pF): 6.92, C2 (pF): 4.69",
    "C1 [fF]: 6920, C2 [nF]: 0.00469",
    "C_hard:6.92e0 C_soft:+4.690E+00",
    "c2=4.69 c1=6.92",
    "hard=6.92pF,soft=4.69pF",
    "hard=6.92, soft=4.69, temp=25.3 degC",
    "hard=6.92, soft=4.69, temp=25.3 \u00b0C",
    "temperature:-3,hard:6.92,soft:4.69",
    "hard=0.00692 nF,soft=6.92E-12 F".replace("6.92E-12", "4.69E-12"),
    "hard=6920 fF,soft=4690000 aF",
    "hard=6,92;soft=4,690",
    "hard=6,92 pF soft=4,69 pF",
    '{"C1":6.92,"C2":4.69}',
    '{"hard_fF":6920,"soft_fF":4.69e3}',
    '{"millis":99,"hard":6.92,"soft":4.69}',
    '{"temp":21,"soft":4.69,"hard":6.92}',
    "6.92 pF 4.69 pF",
    "6.92pF\t4.69pF",
    "6920 fF;4.69 pF",
    "6,92 pF; 4,69 pF",
    "6.92\t4.69",
    "  6.92   4.69  ",
    "6.92;4.69",
    "6.92 | 4.69",
    "+6.92, +4.690",
    "6.92,4.69\r",
]
"""Lines with these two values, one format each."""
REFUSED = [
    "",
    "6.92",
    "hard:6.92",
    "6.92,",
    ",6.92,4.69",
    "6.92,,4.69",
    "6.92,4.69,",
    "6.92 4.69,1",
    "7,5",
    "7 5",
    "1 2 3",
    "12.5,6.92,4.69,25.1",
    "1,234.5,6,789.0",
    "1'234.5 4.69",
    "1_000.5 4.69",
    "1.234.567,4.69",
    "6.92.1 4.69",
    "6-92 4-69",
    "101.5,4.69",
    "OL,4.69",
    "nan,nan",
    "inf;inf",
    "1e31,1e31",
    "6.92 V,4.69 V",
    "6.92 fA,4.69 fA",
    "6.92 mm,4.69 mm",
    "6.92 %,4.69 %",
    "6.92 pF,4.69",
    "hard:6.92 pF,soft:4.69",
    "6.92 pF,25.3 C",
    "0x6.9,0x4.6",
    "0b11,0b10",
    "\u0666.\u0669,4.69",
    "6.92..4.69",
    "--6.92,4.69",
    "6.92e,4.69e",
    "hard:6.92,soft",
    "hard:6.92,soft:",
    "hard:6.92,soft:abc",
    "hard:6.92,hard:4.69",
    "hard:6.92,hard_raw:8388608",
    "hard:6.92,soft_raw:8388608",
    "hard_fF:6.92 pF,soft:4.69",
    "hard:6.92 K,soft:4.69 K",
    "hard:6.92,soft:4.69,scale:1000",
    "hard:6.92,soft:4.69,5",
    "hard:6.92,soft:4.69;",
    "hard:6,92,soft:4,69",
    "hard:6.92;soft:4,69",
    "t:5,hard:6.92,soft:4.69",
    "t_hard_us:5,hard:6.92,soft:4.69",
    "t_ms:5,t_hard_us:5,t_soft_us:6,hard:6.92,soft:4.69",
    "t_ms:-5,hard:6.92,soft:4.69",
    "seq:1.5,hard:6.92,soft:4.69",
    "seq:-1,hard:6.92,soft:4.69",
    "status:9,hard:6.92,soft:4.69",
    "hard_raw:16777216,soft_raw:0",
    "hard_raw:-2,soft_raw:0",
    "hard_raw:0x800000,soft_raw:0x800000",
    "hard_raw:8388608.5,soft_raw:1",
    "hard:6.92,soft:4.69*00",
    "hard:6.92,soft:4.69*3",
    "{}",
    "{hard:6.92,soft:4.69}",
    '{"hard":6.92,"soft":4.69',
    '{"hard":6.92,"soft":4.69}}',
    '{"hard":6.92,"hard":1,"soft":4.69}',
    '{"hard":"6.92","soft":"4.69"}',
    '{"hard":true,"soft":false}',
    '{"hard":[6.92],"soft":[4.69]}',
    '{"c":{"hard":6.92,"soft":4.69}}',
    '{"hard":6.92,"soft":4.69,"unit":"fF"}',
    "[6.92,4.69]",
    "12:21:46.123,6.92,4.69",
    "2026-11-22T12:21:46Z 6.92 4.69",
    "192.168.0.17 255.255.255.0",
    "rst:0x1 (POWERON_RESET),boot:0x13 (SPI_FAST_FLASH_BOOT)",
    "configsip: 0, SPIWP:0xee",
    "clk_drv:0x00,q_drv:0x00,d_drv:0x00",
    "mode:DIO, clock div:2",
    "load:0x3fff0030,len:1344",
    "ho 0 tail 12 room 4",
    "entry 0x400805f0",
    "I (29) boot: ESP-IDF v4.4.1 2nd stage bootloader",
    "I (31) boot: compile time 10:11:12",
    "Serial started at 115200, 8N1",
    "heap=23000 free=48000",
    "Free: 23.4 of 48.0 kB",
    "used 12.5%, free 87.5%",
    "Guru Meditation Error: Core  0 panic'ed",
    "Backtrace: 0x400d0f2a:0x3ffb1f80 0x400d1098:0x3ffb1fb0",
    "\x00\x00\x00",
    "\u00ff\u00fe6.92,4.69",
    "time,hard,soft",
    "x,y,z",
]


@pytest.mark.parametrize("line", READ)
def test_lines_that_are_read(line: str) -> None:
    sent = Sent([line, line])
    assert sent.pairs[:1] == [pytest.approx(HARD_SOFT, rel=1e-12)]
    assert len(sent.said) - len(sent.source.gaps) == 1
    assert sent.samples[0].status == Status.OK


@pytest.mark.parametrize("line", REFUSED)
def test_lines_that_are_refused(line: str) -> None:
    sent = Sent([line] * 25)
    assert (sent.samples, sent.said) == ([], [])
    assert bool(sent.refused) == bool(line) or line == "time,hard,soft"


def test_a_number_that_grows_with_every_line_is_no_capacitance() -> None:
    clock = Sent([f"{0.031 * k:.3f},{6.92 + 0.001 * (k % 3)}" for k in range(1, 60)])
    assert clock.samples == []
    assert clock.refused.startswith("a number grows with every line")
    values = [(6.92 + 0.01 * (k % 5), 4.69 + 0.01 * (k % 7)) for k in range(30)]
    noisy = Sent([f"{hard:.3f},{soft:.3f}" for hard, soft in values])
    assert noisy.pairs == [pytest.approx(pair) for pair in values]  # those that waited until this was known, too


def test_a_settled_format_is_fixed() -> None:
    lines = ["hard:6.92,soft:4.69", "hard:1,soft:2", "6.92,4.69", "soft:4.69,t:6.92", "hard:1;soft:2", "hard:1,soft:2 pF",
             "hard:1,soft:2,t_ms:3", "hard:OL,soft:2", "hard:7.5e-1 ,soft:.5", "hard:1,5,soft:2", "hard:3,soft:4*00"]  # fmt: skip
    sent = Sent(lines)
    assert [sample.status for sample in sent.samples] == [0, 0, Status.LOST, 0]
    assert sent.pairs[3] == (0.75, 0.5)
    assert sent.source.counters == {"errors": 7, "lost": 0, "reconnects": 0}


def test_names_may_come_in_any_order() -> None:
    rows = ["hard=6.92,soft=4.69,seq=0", "seq=1,soft=4.7,hard=6.93", "soft=4.71,hard=6.94,seq=2"]
    sent = Sent(rows)
    assert sent.pairs == [(6.92, 4.69), (6.93, 4.7), (6.94, 4.71)]
    assert [sample.seq for sample in sent.samples] == [0, 1, 2]
    assert Sent(['{"soft":4.69,"hard":6.92}', '{"hard":6.93,"soft":4.7}']).pairs == [(6.92, 4.69), (6.93, 4.7)]
    mixed = Sent(["hard=6.92 pF,soft=4.69 pF,temp=20", "temp=20,soft=4690 fF,hard=6.93 pF"])
    assert mixed.pairs[1] == pytest.approx((6.93, 4.69))
    own = Sent(["CIN1=1 CIN2=2"] * 2 + ["CIN2=3 CIN1=4"], columns="soft,hard")
    assert own.pairs[-1] == (3, 4)
    for other in ("soft=4.7,soft=6.93,seq=1", "soft=4.7,hard=6.93,n=1", "soft=4.7,hard=6.93", "soft=4.7,hard=6.93,1"):
        assert Sent([rows[0], other]).source.counters["errors"] == 1


def test_an_instrument_may_change_its_unit_but_not_leave_it_out() -> None:
    sent = Sent(
        ["hard=999.1 fF,soft=1 pF", "hard=1.002 pF,soft=1 pF", "hard=1.003,soft=1 pF", "hard=1.004 V,soft=1 pF"]
    )
    assert sent.pairs == [pytest.approx((0.9991, 1)), (1.002, 1)]
    assert sent.source.counters["errors"] == 2


def test_a_line_of_names_holds_for_the_lines_after_it() -> None:
    rows = ["12,6.92,4.69", "43,6.93,4.70"]
    for header in ("t_ms,hard,soft", "Time (ms), C1 (pF), C2 (pF)", "millis,hard,soft"):
        sent = Sent([header, *rows])
        assert sent.pairs == [(6.92, 4.69), (6.93, 4.70)]
        assert sent.samples[1].t_hard_ns - sent.samples[0].t_hard_ns == 31_000_000
    at_once = Sent(b"t_ms,hard,soft\n12,6.92,4.69\n")  # the first line may be the end of one, but not this one
    assert at_once.pairs == [(6.92, 4.69)]
    assert Sent(["hard,soft", *rows]).samples == []
    assert Sent(["hard\tsoft", "69\t46"]).pairs == [(69, 46)]  # named: no guess


@pytest.mark.parametrize(
    ("lines", "option"),
    [
        (["C1=6.7e-12 C2=4.4e-12"], "unit=F"),
        (["6.7e-12,4.4e-12"], "unit=F"),
        (["hard=6.7e-6,soft=4.4e-6"], "unit=uF"),
        (["hard=0.0067,soft=0.0044"], "unit=nF"),
        (["hard=6700.00,soft=4400.00"], "unit=fF"),
        (["hard=6700000,soft=4400000"], "unit=aF"),
        (["hard,soft", "6700,4400"], "unit=fF"),
        (['{"hard":6.7e-12,"soft":4.4e-12}'], "unit=F"),
        (["hard=6700,soft=OL"], "unit=fF"),
    ],
)
def test_what_cannot_be_pF_is_asked_about(lines: list[str], option: str) -> None:
    asked = Sent(lines * 25)
    assert (asked.samples, asked.said) == ([], [])
    assert asked.refused.endswith(option)
    assert "without a unit is read as pF from 0.01 to 100 only" in asked.refused
    name, unit = option.split("=")
    soft = math.nan if "OL" in lines[0] else 4.4
    assert Sent(lines * 2, **{name: unit}).pairs[-1] == pytest.approx((6.7, soft), nan_ok=True)


def test_a_unit_is_believed_and_a_size_is_asked_about_once() -> None:
    assert Sent(["hard=6700 pF,soft=1e-9 pF"]).pairs == [(6700, 1e-9)]
    assert Sent(["hard_pF=6700,soft_pF=0"]).pairs == [(6700, 0)]
    assert Sent(["hard=6700,soft=0"], unit="pF").pairs == [(6700, 0)]
    assert Sent(["1,2", "6700,4400"], columns="hard_pF,soft_pF").pairs == [(1, 2), (6700, 4400)]
    assert Sent(["hard=-0.01,soft=100", "hard=0,soft=-101"]).pairs == [(-0.01, 100), (0, -101)]
    late = Sent(["hard=OL,soft=OL", "hard=OL,soft=1", "hard=6700,soft=1", "hard=6.7,soft=0"])
    assert late.pairs[-1] == (6.7, 0)
    assert (len(late.samples), late.source.counters["errors"]) == (3, 1)


def test_decimal_commas_and_points() -> None:
    assert Sent(["1,5 2,5"] * 2).pairs == [(1.5, 2.5)] * 2
    mixed = Sent(["hard=1,5;soft=2,5", "hard=1.5;soft=2.5", "hard=1;soft=1,234"])
    assert mixed.pairs == [(1.5, 2.5), (1, 1.234)]
    assert Sent(["hard=6.92;soft=4,690"], decimal="point").samples == []
    assert Sent(["6,920;4,690"] * 2, decimal="comma").pairs == [pytest.approx(HARD_SOFT)] * 2


def test_codes_become_capacitances() -> None:
    sent = Sent(["hard_raw=0,soft_raw=8388608", "hard_raw=8388609,soft_raw=16777215"])
    assert sent.pairs == [(-4.096, 0), (2**-21 * 1.024, pytest.approx(4.09599951, abs=1e-8))]
    assert [(sample.hard_raw, sample.soft_raw) for sample in sent.samples] == [(0, 8388608), (8388609, 16777215)]
    assert [sample.status for sample in sent.samples] == [Status.HARD_SATURATED, Status.SOFT_SATURATED]
    assert sent.source.describe()["full_scale_pF"] < 4.096
    other = Sent(["hard_raw=-200,soft_raw=9000000000"], code_pF=1e-3)
    assert other.pairs == [pytest.approx((-0.2, 9e6))]
    assert (other.samples[0].hard_raw, other.samples[0].soft_raw) == (-1, -1)
    assert "full_scale_pF" not in other.source.describe()
    for options in ({"code_pF": 1e-3}, {}):
        assert bool(Sent(["hard=1,soft=2"], **options).samples) != bool(options)
    assert "its numbers are codes" in Sent(["hard_raw=1,soft_raw=2"], unit="fF").refused


def test_a_status_and_a_missing_value_go_together() -> None:
    head = "hard_raw=8388608,soft_raw=8388608,status="
    sent = Sent([f"{head}0", f"{head}4", f"{head}8", f"{head}9", "hard_raw=-1,soft_raw=8388608,status=8",
                 "hard_raw=-1,soft_raw=8388608,status=0"])  # fmt: skip
    assert [sample.status for sample in sent.samples] == [0, Status.EXCITATION, Status.LOST]
    assert math.isnan(sent.samples[2].hard)
    assert sent.source.counters["errors"] == 3


def test_names_of_the_user_need_two_lines_that_agree() -> None:
    boot = ["heap=23000 free=48000", "CIN1=6.92 CIN2=4.69", "CIN1=6.93 CIN2=4.70", "heap=23000 free=48000"]
    sent = Sent(boot, columns="hard,soft")
    assert sent.pairs == [(6.92, 4.69), (6.93, 4.70)]
    assert sent.source.counters["errors"] == 1


def test_a_pattern_matches_whole_lines() -> None:
    pattern = r"h=(?P<hard>\S+) s=(?P<soft>\S+)(?: seq=(?P<seq>\d+))?"
    lines = ["h=1 s=2", "h=1 s=2 ", "x h=1 s=2", "h=1 s=2 x", "h=1 s=two", "h=0x1 s=2", "h=1 s=2 seq=7"]
    sent = Sent(lines, pattern=pattern, unit="fF")
    assert sent.pairs == [(0.001, 0.002)] * 3
    assert sent.source.counters["errors"] == 4
    lines = ["10 A1", "22 B2", "41 A3", "53 B4"]
    timed = Sent(lines, pattern=r"(?P<t_ms>\d+) (?:A(?P<hard>\d)|B(?P<soft>\d))")
    assert timed.pairs == [(1, 2), (3, 4)]
    assert [sample.t_soft_ns - sample.t_hard_ns for sample in timed.samples] == [12_000_000] * 2
    assert timed.samples[1].t_hard_ns - timed.samples[0].t_hard_ns == 31_000_000


def test_lines_before_the_first_that_is_read_are_no_errors() -> None:
    sent = Sent([*REFUSED[:70], "hard:6.92,soft:4.69", "boot", "hard:6.92,soft:4.69"])
    assert len(sent.samples) == 2
    assert sent.source.counters["errors"] == 1


HELPED = [
    (["hard 6.7", "soft 4.4"], (6.7, 4.4)),
    (["hard:6.7", "soft:4.4"], (6.7, 4.4)),
    (["hard 6.7 soft 4.4"], (6.7, 4.4)),
    (["n 12 C1 6700 fF | C2 4400 fF"], (6.7, 4.4)),
    (["soft 4.4", "hard 6.7", "soft 4.4", "hard 6.7"], (6.7, 4.4)),
    (["hard 6.7e-12 F", "soft -4.4 pF"], (6.7, -4.4)),
    (["hard=6.7,hard=4.4"], (6.7, 4.4)),
    (["C=6.7 C=4.4"], (6.7, 4.4)),
    (["hard=6.7,soft=4.4,hard=1"], (6.7, 4.4)),
    (["t_ms=3,soft=4.4,t_ms=3,soft=6.7"], (6.7, 4.4)),
    (["time=4.08,CIN1=6.7,CIN2=4.4"], (6.7, 4.4)),
    (["12,6.7,4.4"], (6.7, 4.4)),
]
NOT_HELPED = [["hard 6.7"], ["hard 6,7 soft 4,4"], ["hard 6.7 V soft 4.4 V"], ["hard 6.7.1 soft 4.4"], ["hard 6.7", "hard 4.4"],
              ["free 23000 of 48000"], ["x=1"], ["hard=6.7,x=1"], ["hard 0x6 soft 0x4"], ["hard & 6.7 soft 4.4"]]  # fmt: skip


def suggested(lines: list[str]) -> str:
    """Return the option that the error about these lines names; empty: none."""
    strange = Strange("tty", 115200)
    settling = Settling(Given())
    for line in lines:
        with pytest.raises(Refused) as refused:
            settling.offer(line)
        strange.add(line, refused.value)
    message = strange._message(*(strange._best or ("", Refused(""))))
    return message.partition("'serial:tty?")[2].rstrip("'")


@pytest.mark.parametrize(("lines", "pair"), HELPED)
def test_the_option_of_the_error_reads_the_lines(lines: list[str], pair: tuple[float, float]) -> None:
    _, address, options = split(f"serial:tty?{suggested(lines)}")
    assert (address, len(options)) == ("tty", 1)
    assert pytest.approx(pair) in Sent(lines * 2, **options).pairs


@pytest.mark.parametrize("lines", NOT_HELPED)
def test_no_option_is_named_that_does_not_help(lines: list[str]) -> None:
    assert suggested(lines) == ""


def test_comments_are_said_once_and_not_counted() -> None:
    sent = Sent(["# no answer", "# no answer", "hard:6.92,soft:4.69", "# no answer", *(f"# {k}" for k in range(99))])
    assert sent.source.counters["errors"] == 0
    assert len(sent.said) == 21
    assert sent.said[0] == "tty: '# no answer'"


def test_many_lines_that_are_not_read_are_shown() -> None:
    sent = Sent(["hard:1,soft:2", *["hard:1"] * 250])
    assert [text[:30] for text in sent.said[1:]] == ["10 lines were not read; the la", "100 lines were not read; the l"]
    assert sent.said[1].endswith("'hard:1': it has another form than the first lines")
