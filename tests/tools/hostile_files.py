"""Hostile files: each parser gets them in a child process with little time and memory.

`python tests/tools/hostile_files.py STEP [PARSER...]` prints one JSON object: how each file ended, of the special ones and every
STEP-th of the rest. The parsers, and what they may raise, come from `fuzz_parsers`.
"""

import json
import os
import resource
import sys
import traceback
import warnings
from collections.abc import Callable, Iterator
from itertools import islice
from pathlib import Path

from fuzz_parsers import TARGETS

SECONDS = 6  # of CPU time
MEGABYTES = 200
SIZE = 1_000_000  # bytes of a file
Contents = Iterator[tuple[str, bytes]]

_GOOD = Path(__file__).parents[1] / "fuzz" / "corpus" / "calibration" / "probe.toml"
_UNITS = (*'9,;"[\\\n\r\0\U0001f600', "a.", "a=1\n", "1,2\n", "12 ms\t", '{"a":', "1.0 2.0\n")


def filled(unit: str, before: str = "", after: str = "") -> bytes:
    """Return a unit, repeated to `SIZE` bytes, with what is before and after it."""
    return (before + unit * (SIZE // len(unit.encode())) + after).encode()


def counted(pattern: str) -> bytes:
    """Return a pattern repeated to about `SIZE` bytes with a running number in it."""
    return "".join(map(pattern.format, range(SIZE // len(pattern.format(999_999))))).encode()


def anywhere() -> Contents:
    """Yield contents for every parser."""
    yield from ((repr(unit), filled(unit)) for unit in _UNITS)
    yield "surrogates", b"\xed\xa0\x80" * (SIZE // 3)
    yield "not UTF-8", b"\xfe" * SIZE
    yield "every byte", bytes(range(256)) * (SIZE // 256)
    yield "UTF-16", b"\xff\xfe" + "1;2\n".encode("utf-16-le") * (SIZE // 8 - 1)


def toml() -> Contents:
    """Yield TOML for calibrations and palpate.toml."""
    yield "found: a dotted key of 100 kB", b"a." * 50_000 + b"a=1"
    yield "found: dotted keys", counted("a." * 1000 + "a{}=1\n")
    yield "dotted tables", counted("[" + "a." * 500 + "a{}]\n")
    yield "keys", counted("a{}=1\n")
    yield "arrays in arrays", filled("[", "a=")
    yield "digits", filled("9", "schema=")


def calibration() -> Contents:
    """Yield calibrations that are right but for one part."""
    yield from toml()
    longer = _GOOD.read_text()
    for key, value in (("ratios", "1.5"), ("moduli_MPa", "1.5"), ("standard_errors", "0.1"), ("touches", "1")):
        start = longer.index(f"{key} = [") + len(key) + 4
        longer = longer[:start] + f"{value},\n" * 12_000 + longer[longer.index("]", start) :]
    yield "48,000 numbers", longer.encode()


def sidecar() -> Contents:
    """Yield sidecars that are right but for one part."""
    tares = ",".join(f'{{"seq":{i},"tare":true}}' for i in range(10_000))
    right = {"schema": '"palpate-recording-2"', "device": "{}", "settings": "{}", "notes": "[]", "marks": "[]"}
    for name, part, value in (
        ("found: 100,000 marks", "marks", f"[{'0,' * 100_000}0]"),
        ("found: 10,000 tares", "marks", f"[{tares}]"),
        ("found: deep marks", "marks", "[" * 900 + "]" * 900),
        ("found: full scale of 4000 digits", "device", '{"full_scale_pF":' + "9" * 4000 + "}"),
        ("many settings", "settings", "{" + ",".join(f'"a{i}":1' for i in range(80_000)) + "}"),
        ("a long note", "notes", '["begun after ' + "a" * 900_000 + '"]'),
        ("rows of 4000 digits", "end", '{"rows":' + "9" * 4000 + "}"),
    ):
        yield name, ("{" + ",".join(f'"{key}":{text}' for key, text in (right | {part: value}).items()) + "}").encode()


def table() -> Contents:
    """Yield tables of other loggers; the first byte selects the options: positions, with times."""
    head, wide = "\2t,hard,soft\n", "1," * 100_000 + "\n"
    yield "found: 100,000 columns", f"\2t,hard,soft,{'a,' * 100_000}\n{wide}{wide}".encode()
    yield "1000 columns", f"\2t,hard,soft,{'a,' * 996}\n{('1,' * 999 + chr(10)) * 490}".encode()
    yield "header rows", filled("a,b,c\n", "\2", "1,2,3\n" * 3)
    yield "rows, quoted", filled('"1","2","3"\n', head)
    yield "digits in cells", filled("1,2," + "9" * 90_000 + "\n", head + "1,2,3\n" * 3)
    yield "open quote", filled("a\n", head + '1,2,"')


def own_file() -> Contents:
    """Yield rows of a recording by palpate."""
    yield "rows", counted("{},0.026,0.039,8388608,8400000,0.0,0.0,-1,0\n")
    yield "a long cell", filled("9", "1,0.026,0.039,8388608,8400000,", ",0.0,-1,0\n")


SPECIAL: dict[str, Callable[[], Contents]] = {
    "table": table, "sidecar": sidecar, "calibration": calibration, "config": toml, "own_file": own_file,
}  # fmt: skip


def lines(data: bytes) -> None:
    """Read a serial port that sends as much at once as a system's buffer holds."""
    data = data.replace(b"\xff", b"\xfe")
    TARGETS["lines"](b"\xff".join(data[at : at + 4096] for at in range(0, len(data), 4096)))


PARSERS: dict[str, Callable[[bytes], None]] = {**TARGETS, "lines": lines}


def ending(parse: Callable[[bytes], None], data: bytes) -> str:
    """Run a parser in a child process with limits; return an error that is not documented, or ""."""
    read, write = os.pipe()
    child = os.fork()
    if not child:
        _parse(parse, data, write)
    os.close(write)
    with os.fdopen(read) as said:
        error = said.read()
    signal = os.WTERMSIG(os.waitpid(child, 0)[1])
    return f"killed by signal {signal}" if signal else error


def _parse(parse: Callable[[bytes], None], data: bytes, write: int) -> None:
    """In the child: parse with limits, write the error, and end."""
    try:
        size = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS + 1))
        resource.setrlimit(resource.RLIMIT_AS, (size + MEGABYTES * 1_000_000,) * 2)
        parse(data)
    except BaseException:  # noqa: BLE001  also SystemExit: nothing may leave the child
        os.write(write, traceback.format_exc(-1).encode(errors="replace")[:1000])
    finally:
        os._exit(0)


def run(parser: str, step: int) -> dict[str, str]:
    """Return the ending of each content for a parser."""
    PARSERS[parser](b"")  # what it imports is not its cost
    special = list(SPECIAL[parser]()) if parser in SPECIAL else []
    kept = [content for content in special if step == 1 or "found" in content[0]]
    first = sorted(PARSERS).index(parser) % step  # different ones for each parser
    contents = [*kept, *islice([*special, *anywhere()], first, None, step)]
    return {name: ending(PARSERS[parser], data) for name, data in contents}


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    TARGETS["calibration"](_GOOD.read_bytes())
    print(json.dumps({parser: run(parser, int(sys.argv[1])) for parser in sys.argv[2:] or PARSERS}))
