"""Makes the archive of the headers: `python -m release.headers FOLDER [ADDRESS]`.

It is a library of Arduino and of PlatformIO, a folder for a compiler, and has all headers as one file. The same commit
gives the same bytes. ADDRESS stands in for that of pyproject.toml in a rehearsal.
"""

import json
import sys
import zipfile
from pathlib import Path

from release.one_header import HEADERS, one_header
from release.project import ROOT, NotReadyError, address, pyproject, version

ARDUINO = ROOT / "release" / "arduino"
SKETCHES = ROOT / "cpp" / "examples" / "arduino"
INSTRUMENT = ROOT / "bench" / "embedded" / "ad7746"  # the program of the sketch palpate_instrument
# Folders of Arduino cores for ARM and ESP; the compiler for avr has no C++17.
ARCHITECTURES = [
    "esp32",
    "esp8266",
    "mbed_giga",
    "mbed_nano",
    "mbed_opta",
    "mbed_portenta",
    "mbed_rp2040",
    "nrf52",
    "renesas_portenta",
    "renesas_uno",
    "rp2040",
    "sam",
    "samd",
    "stm32",
    "zephyr",
]
PLATFORMS = [
    "espressif32",
    "espressif8266",
    "atmelsam",
    "native",
    "nordicnrf52",
    "raspberrypi",
    "renesas-ra",
    "ststm32",
    "teensy",
]  # of PlatformIO
SENTENCE = "Ratio of two capacitance changes of a tactile probe, in real time."
PARAGRAPH = (
    "Recursive least squares whose forgetting is switched by a CUSUM detector, with baseline, contact and standard error; "
    "float, no heap, no exceptions, the same bits as on a computer. Needs C++17."
)
NO_TIME = (1980, 1, 1, 0, 0, 0)  # the first that a ZIP file knows


def author() -> str:
    """Return the authors of pyproject.toml."""
    return ", ".join(person["name"] for person in pyproject()["project"]["authors"])


def properties(source: str) -> str:
    """Return Arduino's library.properties."""
    fields = {
        "name": "palpate",
        "version": version(),
        "author": author(),
        "maintainer": author(),
        "sentence": SENTENCE,
        "paragraph": PARAGRAPH,
        "category": "Sensors",
        "url": source,
        "architectures": ",".join(ARCHITECTURES),
        "includes": "palpate.h",
        "license": "MIT",
    }
    return "".join(f"{name}={value}\n" for name, value in fields.items())


def manifest(source: str) -> str:
    """Return PlatformIO's library.json."""
    fields = {
        "name": "palpate",
        "version": version(),
        "description": SENTENCE,
        "keywords": ["sensor", "tactile", "capacitance", "elasticity", "rls"],
        "authors": [{"name": author(), "maintainer": True}],
        "repository": {"type": "git", "url": source},
        "license": "MIT",
        "frameworks": "*",
        "platforms": PLATFORMS,
        "headers": ["palpate.h"],
    }
    return json.dumps(fields, indent=2) + "\n"


def files(source: str) -> dict[str, str]:
    """Return the text of each file of the archive."""
    found = {
        "library.properties": properties(source),
        "library.json": manifest(source),
        "palpate_one.hpp": one_header(),
    }
    copied = {
        "LICENSE": ROOT / "LICENSE",
        "README.md": ARDUINO / "README.md",
        "keywords.txt": ARDUINO / "keywords.txt",
        "src/palpate.h": ARDUINO / "palpate.h",
        **{f"src/{path.relative_to(HEADERS).as_posix()}": path for path in HEADERS.rglob("*.hpp")},
        **{f"examples/{path.parent.name}/{path.name}": path for path in SKETCHES.glob("*/*.ino")},
        **{f"examples/palpate_instrument/{name}": INSTRUMENT / name for name in ("hal.hpp", "loop.cpp")},
    }
    return found | {name: path.read_text(encoding="utf-8") for name, path in copied.items()}


def write(target: Path, source: str) -> None:
    """Write the archive; no time, owner or order of this machine is in it."""
    folder = f"palpate-{version()}"
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        for name, text in sorted(files(source).items()):
            info = zipfile.ZipInfo(f"{folder}/{name}", NO_TIME)
            info.compress_type, info.external_attr, info.create_system = zipfile.ZIP_DEFLATED, 0o100644 << 16, 3
            archive.writestr(info, text)


def main(folder: str, *rehearsal: str) -> None:
    """Make it in `folder`."""
    try:
        source = rehearsal[0] if rehearsal else address()
    except NotReadyError as error:
        sys.exit(f"error: {error}")
    target = Path(folder) / f"palpate-cpp-{version()}.zip"
    target.parent.mkdir(parents=True, exist_ok=True)
    write(target, source)
    print(target)


if __name__ == "__main__":
    main(*sys.argv[1:])
