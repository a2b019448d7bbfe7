"""Hostile files: each parser gets them in a child process with little time and memory.

`python tests/tools/hostile_files.py STEP [PARSER...]` prints one JSON object: how each file ended, of those that once took
too long, and every STEP-th of the rest. The parsers, and what they may raise, come from `fuzz_parsers`.
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

_UNITS = (*'9,;"[\\\n\r\0\U0001f600', "a.", "a=1\n", "1,2\n", "12 ms\t", '{"a":', "1.0 2.0\n")


def counted(pattern: str) -> bytes:
    """Return a pattern repeated to about `SIZE` bytes with a running number in it."""
    return "".join(map(pattern.format, range(SIZE // len(pattern.format(999_999))))).encode()


def anywhere() -> Iterator[tuple[str, bytes]]:
    """Yield contents for every parser."""
    yield from ((repr(unit), (unit * (SIZE // len(unit.encode()))).encode()) for unit in _UNITS)
    yield "surrogates", b"\xed\xa0\x80" * (SIZE // 3)
    yield "not UTF-8", b"\xfe" * SIZE
    yield "every byte", bytes(range(256)) * (SIZE // 256)
    yield "UTF-16", b"\xff\xfe" + "1;2\n".encode("utf-16-le") * (SIZE // 8 - 1)


def found() -> dict[str, list[tuple[str, bytes]]]:
    """Return contents that once took too long, by parser: sidecars that are right but for one part, and a table."""
    right = {
        "schema": '"palpate-recording-2"',
        "device": "{}",
        "settings": "{}",
        "notes": "[]",
        "marks": "[]",
    }
    parts = {
        "100,000 marks": {"marks": json.dumps([0] * 100_000)},
        "10,000 tares": {"marks": json.dumps([{"seq": i, "tare": True} for i in range(10_000)])},
        "deep marks": {"marks": "[" * 900 + "]" * 900},
        "full scale of 4000 digits": {"device": '{"full_scale_pF":' + "9" * 4000 + "}"},
    }
    sidecars = {
        name: ",".join(f'"{key}":{text}' for key, text in (right | part).items())
        for name, part in parts.items()
    }
    wide = "1," * 100_000 + "\n"
    return {
        "sidecar": [(name, f"{{{text}}}".encode()) for name, text in sidecars.items()],
        "table": [("100,000 columns", f"\2t,hard,soft,{'a,' * 100_000}\n{wide}{wide}".encode())],
        "own_file": [("rows", counted("{},0.026,0.039,8388608,8400000,0.0,0.0,-1,0\n"))],
    }


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
    first = sorted(PARSERS).index(parser) % step  # different ones for each parser
    contents = [*found().get(parser, []), *islice(anywhere(), first, None, step)]
    return {name: ending(PARSERS[parser], data) for name, data in contents}


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    print(json.dumps({parser: run(parser, int(sys.argv[1])) for parser in sys.argv[2:] or PARSERS}))
