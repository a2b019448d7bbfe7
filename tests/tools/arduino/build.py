"""Build the sketch of cpp/examples/arduino for an Arduino Uno, and the simulated board that runs it.

Debian: arduino-core-avr gcc-avr avr-libc libsimavr-dev. The options are those of the Arduino IDE (platform.txt).
"""

import subprocess
from itertools import chain
from pathlib import Path

ROOT = Path(__file__).parents[3]
SKETCH = ROOT / "cpp" / "examples" / "arduino" / "palpate_ad7746" / "palpate_ad7746.ino"
AVR = Path("/usr/share/arduino/hardware/arduino/avr")
CORE, WIRE = AVR / "cores" / "arduino", AVR / "libraries" / "Wire" / "src"
SIMAVR = Path("/usr/include/simavr")
TOOLS = ("avr-g++", "avr-gcc", "avr-size", "c++")
FILES = (CORE, SIMAVR)

_PROCESSOR = ["-mmcu=atmega328p", "-DF_CPU=16000000L", "-DARDUINO=10819", "-DARDUINO_AVR_UNO", "-DARDUINO_ARCH_AVR"]
_INCLUDES = [f"-I{folder}" for folder in (CORE, AVR / "variants" / "standard", WIRE, WIRE / "utility")]
_COMMON = ["-c", "-Os", "-flto", "-ffunction-sections", "-fdata-sections", *_PROCESSOR]
_CPP = ["-std=gnu++11", "-fno-exceptions", "-fno-threadsafe-statics", "-Wno-error=narrowing"]
_STRICT = ["-Wall", "-Wextra", "-Werror", "-x", "c++", "-include", "Arduino.h"]
_COMPILERS = {
    ".c": ["avr-gcc", "-std=gnu11", "-fno-fat-lto-objects", "-w"],
    ".cpp": ["avr-g++", *_CPP, "-fpermissive", "-DDECIMAL_DIG=__DECIMAL_DIG__", "-w"],  # <float.h> of gcc 5
    ".S": ["avr-gcc", "-x", "assembler-with-cpp"],
}


def _compiled(source: Path, folder: Path) -> Path:
    made = folder / f"{source.name}.o"
    if source == SKETCH:  # its warnings are errors; those of Arduino's own files are not of this project
        command = ["avr-g++", *_CPP, *_COMMON, *_INCLUDES, *_STRICT]
    else:
        command = [*_COMPILERS[source.suffix], *_COMMON, *_INCLUDES]
    subprocess.run([*command, source, "-o", made], check=True)
    return made


def build_sketch(folder: Path) -> Path:
    """Compile the sketch with Arduino's core and its library Wire; return the ELF file."""
    library = chain(*(sorted(f.glob(f"*{end}")) for f in (CORE, WIRE, WIRE / "utility") for end in _COMPILERS))
    objects = [_compiled(source, folder) for source in (SKETCH, *library)]
    program = folder / "sketch.elf"
    link = ["avr-gcc", "-Os", "-flto", "-fuse-linker-plugin", "-Wl,--gc-sections", "-mmcu=atmega328p"]
    subprocess.run([*link, *objects, "-lm", "-o", program], check=True)
    return program


def build_board(folder: Path) -> Path:
    """Compile the simulated board for this machine."""
    program = folder / "board"
    options: list[str | Path] = ["-std=c++17", "-O2", "-Wall", "-Wextra", "-Wconversion", "-Werror", "-isystem", SIMAVR]
    source = Path(__file__).with_name("board.cpp")
    subprocess.run(["c++", *options, source, "-lsimavr", "-o", program], check=True)
    return program


def bytes_of(program: Path) -> tuple[int, int]:
    """Return the bytes of flash and of RAM that the sketch takes."""
    done = subprocess.run(["avr-size", program], capture_output=True, text=True, check=True)
    text, data, bss = (int(word) for word in done.stdout.splitlines()[1].split()[:3])
    return text + data, data + bss
