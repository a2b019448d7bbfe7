"""Hostile files: each parser gets them in a child process with little time and memory.

`python tests/tools/hostile_files.py STEP [PARSER...]` prints one JSON object: how each file ended, of the special ones and every
STEP-th of the others. The parsers, and what they may raise, are those of `fuzz_parsers`.
"""

import json
import os
import resource
import sys
import tempfile
import traceback
import warnings
from collections.abc import Callable
from itertools import islice
from pathlib import Path
from typing import Any

import fuzz_parsers
import palpate
from click.testing import CliRunner
from fuzz_parsers import TARGETS
from hostile_contents import SPECIAL, anywhere
from palpate import ProtocolError
from palpate.ad7746.evalkit.udev import rule_files
from palpate.cli import main as palpate_command

SECONDS = 6
"""Of CPU time; the rule is 2 s on a machine that does nothing else."""
MEGABYTES = 200


def sysfs(data: bytes) -> None:
    """Read a device in sysfs whose files have these contents."""
    folder = Path(tempfile.mkdtemp(dir=fuzz_parsers.FOLDER))
    (folder / "name").write_bytes(b"ad7746\n")
    for name in ("in_capacitance0_raw", "in_capacitance1_raw", "in_capacitance_sampling_frequency"):
        (folder / name).write_bytes(data)
    try:
        with palpate.open(f"iio:{folder}") as source:
            next(iter(source))
    except ProtocolError:
        pass


def rules(data: bytes) -> None:
    """Search a file of udev rules."""
    folder = Path(tempfile.mkdtemp(dir=fuzz_parsers.FOLDER))
    (folder / "a.rules").write_bytes(data)
    assert rule_files([folder]) == []


def lines(data: bytes) -> None:
    """Read a serial port that sends as much at once as a system's buffer holds."""
    data = data.replace(b"\xff", b"\xfe")
    TARGETS["lines"](b"\xff".join(data[at : at + 4096] for at in range(0, len(data), 4096)))


def options(data: bytes) -> None:
    """Give an option of the command line 100,000 characters: one line, and no traceback."""
    text = data.decode("utf-8", "replace").replace("\0", " ")[:100_000]
    given = str(Path(__file__).parents[1] / "data" / "four-specimens.csv")
    for option in ("--map", "--set", "--unit", "--scene"):
        done = CliRunner().invoke(palpate_command, ["replay", given, option, text])
        assert done.exit_code in (0, 2), (option, done.exit_code, done.stderr[-200:])
        assert len(done.stderr) < 3000, (option, len(done.stderr))


PARSERS: dict[str, Callable[[bytes], None]] = {
    **TARGETS, "lines": lines, "sysfs": sysfs, "rules": rules, "options": options,
}  # fmt: skip


def cost(parse: Callable[[bytes], None], data: bytes) -> dict[str, Any]:
    """Run a parser in a child process; return its CPU time, s, its memory, MB, and an error that is not documented."""
    read, write = os.pipe()
    child = os.fork()
    if not child:
        _parse(parse, data, write)
    os.close(write)
    with os.fdopen(read) as said:
        text = said.read()
    _, status, used = os.wait4(child, 0)
    megabytes, _, error = text.partition(" ")
    ended = error if text else f"killed by signal {os.WTERMSIG(status)}"
    return {"seconds": used.ru_utime + used.ru_stime, "megabytes": float(megabytes or MEGABYTES), "error": ended}


def _parse(parse: Callable[[bytes], None], data: bytes, write: int) -> None:
    """In the child: parse with limits, say what it took, and end."""
    error = ""
    try:
        before = _memory("VmSize:")
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS + 1))
        resource.setrlimit(resource.RLIMIT_AS, (before + MEGABYTES * 1_000_000,) * 2)
        start = _memory("VmRSS:")
        Path("/proc/self/clear_refs").write_text("5")  # the peak begins anew
        parse(data)
    except BaseException as wrong:  # noqa: BLE001  also SystemExit: nothing may leave the child
        place = traceback.extract_tb(wrong.__traceback__)[-1]
        error = f"{type(wrong).__name__}: {str(wrong)[:200]} ({Path(place.filename).name}, line {place.lineno})"
    finally:
        os.write(write, f"{max(_memory('VmHWM:') - start, 0) / 1e6:.0f} {error}".encode(errors="replace"))
        os._exit(0)


def _memory(name: str) -> int:
    text = Path("/proc/self/status").read_text()
    return int(text.split(name)[1].split()[0]) * 1024


def run(parser: str, step: int) -> dict[str, dict[str, Any]]:
    """Return the cost of each content for a parser."""
    parse, found = PARSERS[parser], {}
    parse(b"")  # what it imports is not its cost
    special = list(SPECIAL[parser]()) if parser in SPECIAL else []
    kept = [content for content in special if step == 1 or "found" in content[0]]
    first = sorted(PARSERS).index(parser) % step  # others for each parser
    for name, data in [*kept, *islice([*special, *anywhere()], first, None, step)]:
        found[name] = cost(parse, data)
    return found


def main(step: str, *parsers: str) -> None:
    """Print the costs."""
    warnings.simplefilter("ignore")
    TARGETS["calibration"]((Path(__file__).parents[1] / "fuzz" / "corpus" / "calibration" / "probe.toml").read_bytes())
    print(json.dumps({parser: run(parser, int(step)) for parser in parsers or PARSERS}))


if __name__ == "__main__":
    main(*sys.argv[1:])
