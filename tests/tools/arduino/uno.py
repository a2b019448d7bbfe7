"""Builds the sketch of cpp/examples/arduino for an Arduino Uno, and runs it on the simulated board.

What a recording has of it, what it prints, and what its chip converted. Debian: arduino-core-avr gcc-avr avr-libc
libsimavr-dev. The options are those of the Arduino IDE (platform.txt).
"""

import os
import subprocess
import tty
from collections.abc import Iterator
from contextlib import contextmanager
from functools import reduce
from itertools import chain
from operator import xor
from pathlib import Path
from typing import Any

import numpy as np
import palpate
from numpy.typing import NDArray
from project import ROOT, run

SKETCH = ROOT / "cpp" / "examples" / "arduino" / "palpate_ad7746" / "palpate_ad7746.ino"
AVR = Path("/usr/share/arduino/hardware/arduino/avr")
CORE = AVR / "cores" / "arduino"
WIRE = AVR / "libraries" / "Wire" / "src"
SIMAVR = Path("/usr/include/simavr")
NEEDED = ("avr-g++", "avr-gcc", "avr-size", "c++", str(CORE), str(SIMAVR))

_PROCESSOR = [
    "-mmcu=atmega328p",
    "-DF_CPU=16000000L",
    "-DARDUINO=10819",
    "-DARDUINO_AVR_UNO",
    "-DARDUINO_ARCH_AVR",
]
_INCLUDES = [
    f"-I{folder}" for folder in (CORE, AVR / "variants" / "standard", WIRE, WIRE / "utility")
]
_COMMON = ["-c", "-Os", "-flto", "-ffunction-sections", "-fdata-sections", *_PROCESSOR]
_CPP = ["-std=gnu++11", "-fno-exceptions", "-fno-threadsafe-statics", "-Wno-error=narrowing"]
_STRICT = ["-Wall", "-Wextra", "-Werror", "-x", "c++", "-include", "Arduino.h"]
_COMPILERS = {
    ".c": ["avr-gcc", "-std=gnu11", "-fno-fat-lto-objects", "-w"],
    ".cpp": [
        "avr-g++",
        *_CPP,
        "-fpermissive",
        "-DDECIMAL_DIG=__DECIMAL_DIG__",
        "-w",
    ],  # <float.h> of gcc 5
    ".S": ["avr-gcc", "-x", "assembler-with-cpp"],
}


def _compiled(source: Path, folder: Path) -> Path:
    made = folder / f"{source.name}.o"
    # its warnings are errors; those of Arduino's own files are not of this project
    if source == SKETCH:
        command = ["avr-g++", *_CPP, *_COMMON, *_INCLUDES, *_STRICT]
    else:
        command = [*_COMPILERS[source.suffix], *_COMMON, *_INCLUDES]
    run(*command, source, "-o", made)
    return made


def build(folder: Path) -> None:
    """Compile the sketch with Arduino's core and its library Wire, and the simulated board for this machine."""
    library = chain(
        *(sorted(f.glob(f"*{end}")) for f in (CORE, WIRE, WIRE / "utility") for end in _COMPILERS)
    )
    objects = [_compiled(source, folder) for source in (SKETCH, *library)]
    link = [
        "avr-gcc",
        "-Os",
        "-flto",
        "-fuse-linker-plugin",
        "-Wl,--gc-sections",
        "-mmcu=atmega328p",
    ]
    run(*link, *objects, "-lm", "-o", folder / "sketch.elf")
    options: list[str | Path] = [
        "-std=c++17",
        "-O2",
        "-Wall",
        "-Wextra",
        "-Wconversion",
        "-Werror",
        "-isystem",
        SIMAVR,
    ]
    run("c++", *options, Path(__file__).with_name("board.cpp"), "-lsimavr", "-o", folder / "board")


def bytes_of(program: Path) -> tuple[int, int]:
    """Return the bytes of flash and of RAM that the sketch takes."""
    text, data, bss = map(int, run("avr-size", program).splitlines()[1].split()[:3])
    return text + data, data + bss


@contextmanager
def board(built: Path, folder: Path, pairs: int, *events: str) -> Iterator[Path]:
    """Give the port of a board; at the end, check that it did with its chip only what the data sheet allows."""
    end, port = os.openpty()
    tty.setraw(port)
    name = Path(os.ttyname(port))
    os.close(port)  # from now on the board can see whether someone has it open
    command: list[str | Path] = [
        built / "board",
        built / "sketch.elf",
        str(end),
        folder / "log",
        str(pairs),
        *events,
    ]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, pass_fds=[end]) as process:
        os.close(end)
        try:
            yield name
            # the board itself ends if its sketch is too slow in simulated time
            assert process.wait(3600) == 0
        finally:
            process.kill()


def record(built: Path, folder: Path, pairs: int) -> NDArray[Any]:
    """Record pairs of a board; return the rows, as a structured array with the CSV's names."""
    path = folder / "run.csv"
    with (
        board(built, folder, pairs) as port,
        palpate.Stream(f"serial:{port}", record=path) as stream,
    ):
        for batch in stream.batches():
            if len(batch.samples) and batch.samples["seq"][-1] >= pairs - 1:
                break
        stream.close()  # the board ends when nobody has its port open
    rows: NDArray[Any] = np.genfromtxt(path, delimiter=",", names=True)
    return rows


def conversions(folder: Path) -> NDArray[Any]:
    """Return what the chip converted: `middle_us`, `input` (1, 2) and `code`, shape (n,)."""
    kinds = [("middle_us", "f8"), ("input", "i4"), ("code", "i8")]
    return np.loadtxt(folder / "log", dtype=kinds, delimiter=",")


def lines(port: Path, count: int, centre_at: int = 0) -> Iterator[str]:
    """Yield all lines until there were `count` pairs; send the letter c at one of them."""
    with os.fdopen(os.open(port, os.O_RDWR | os.O_NOCTTY), "r+b", buffering=0) as end:
        pairs = 0
        while pairs < count:
            line = end.readline().decode("ascii").rstrip()
            if line.startswith("seq="):
                pairs += 1
                end.write(b"c" * (pairs == centre_at))
            yield line


def fields(line: str) -> dict[str, int]:
    """Return the fields of a line, whose sum must be right."""
    text, told = line.split("*")
    assert int(told, 16) == reduce(xor, text.encode()), line
    return {name: int(value) for name, value in (field.split("=") for field in text.split(","))}
