"""The headers of a release: all of them as one file, and their archive.

    python -m release.headers > palpate_one.hpp         all headers as one
    python -m release.headers FOLDER [ADDRESS]          the archive, in FOLDER

The one file has each header once, after those that it includes, and the standard headers at its top. The archive is a library of
Arduino and of PlatformIO, a folder for a compiler, and has the one file. The same commit gives the same bytes. ADDRESS
replaces the address of pyproject.toml in a rehearsal.
"""

import json
import re
import sys
import zipfile
from pathlib import Path
from typing import Any

from release.package import ROOT, address, pyproject, version

HEADERS = ROOT / "cpp" / "include"
ALL = "palpate/palpate.hpp"
# Both in one file would define everything twice.
TWICE = """
#if defined(PALPATE_VERSION)
#error "palpate: include either palpate_one.hpp or the headers of the folder palpate, not both"
#endif
"""
_OWN = re.compile(r"^#include <(palpate/[\w/]+\.hpp)>\n", re.MULTILINE)
_STANDARD = re.compile(r"^#include <(\w+)>\n", re.MULTILINE)
_FIRST_LINES = re.compile(r"\A// SPDX-License-Identifier: MIT\n#pragma once\n+")


def in_order(header: str = ALL) -> list[str]:
    """Return the headers that this one includes, directly or not, and itself: each after those that it includes."""
    found: list[str] = []

    def visit(name: str) -> None:
        if name not in found:
            for inner in _OWN.findall((HEADERS / name).read_text(encoding="utf-8")):
                visit(inner)
            found.append(name)

    visit(header)
    return found


def one_header() -> str:
    """Return the text of the one header."""
    standard = set[str]()
    parts = []
    for name in in_order():
        text = (HEADERS / name).read_text(encoding="utf-8")
        standard.update(_STANDARD.findall(text))
        body = _STANDARD.sub("", _OWN.sub("", _FIRST_LINES.sub("", text)))
        body = re.sub("\n{3,}", "\n\n", body).strip()
        parts.append(f"// {name}\n\n{body}\n")
    includes = "".join(f"#include <{name}>\n" for name in sorted(standard))
    lines = (ROOT / "LICENSE").read_text("utf-8").splitlines()
    licence = "".join(f"// {line}".rstrip() + "\n" for line in lines)
    begin = f"// SPDX-License-Identifier: MIT\n// palpate {version()}: all headers in one file. Do not edit: it is made by a command.\n//\n"
    return f"{begin}{licence}\n#pragma once\n{TWICE}\n{includes}\n" + "\n".join(parts)


ARDUINO = ROOT / "release" / "arduino"
SKETCHES = ROOT / "cpp" / "examples" / "arduino"
INSTRUMENT = ROOT / "bench" / "embedded" / "ad7746"  # the program of the sketch palpate_instrument
# Folders of Arduino cores for ARM and ESP; the compiler for avr has no C++17.
ARCHITECTURES = "esp32 esp8266 mbed_giga mbed_nano mbed_opta mbed_portenta mbed_rp2040 nrf52 renesas_portenta renesas_uno rp2040 sam samd stm32 zephyr"
# Of PlatformIO.
PLATFORMS = (
    "espressif32 espressif8266 atmelsam native nordicnrf52 raspberrypi renesas-ra ststm32 teensy"
)
SENTENCE = "Ratio of two capacitance changes of a tactile probe, in real time."
PARAGRAPH = (
    "Recursive least squares whose forgetting is switched by a CUSUM detector, with baseline, contact and standard error; "
    "float, no heap, no exceptions, the same bits as on a computer. Needs C++17."
)
NO_TIME = (1980, 1, 1, 0, 0, 0)  # the first that a ZIP file knows


def about() -> dict[str, str]:
    """Return what both descriptions of the library say."""
    author = ", ".join(person["name"] for person in pyproject()["project"]["authors"])
    return {"name": "palpate", "version": version(), "license": "MIT", "author": author}


def properties(source: str) -> str:
    """Return Arduino's library.properties."""
    more = {
        "sentence": SENTENCE,
        "paragraph": PARAGRAPH,
        "category": "Sensors",
        "url": source,
        "includes": "palpate.h",
    }
    more |= {"maintainer": about()["author"], "architectures": ARCHITECTURES.replace(" ", ",")}
    return "".join(f"{name}={value}\n" for name, value in (about() | more).items())


def manifest(source: str) -> str:
    """Return PlatformIO's library.json."""
    fields: dict[str, Any] = dict(about())
    fields |= {
        "authors": [{"name": fields.pop("author"), "maintainer": True}],
        "description": SENTENCE,
    }
    fields |= {
        "keywords": ["sensor", "tactile", "capacitance", "elasticity", "rls"],
        "headers": ["palpate.h"],
    }
    fields |= {
        "repository": {"type": "git", "url": source},
        "frameworks": "*",
        "platforms": PLATFORMS.split(),
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
        **{
            f"src/{name}": HEADERS / name for name in in_order()
        },  # palpate/design.hpp is for computers
        **{f"examples/{path.parent.name}/{path.name}": path for path in SKETCHES.glob("*/*.ino")},
        **{
            f"examples/palpate_instrument/{name}": INSTRUMENT / name
            for name in ("hal.hpp", "loop.cpp")
        },
    }
    return found | {name: path.read_text(encoding="utf-8") for name, path in copied.items()}


def write(target: Path, source: str) -> None:
    """Write the archive; no time, owner or order of this machine is in it."""
    folder = f"palpate-{version()}"
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        for name, text in sorted(files(source).items()):
            info = zipfile.ZipInfo(f"{folder}/{name}", NO_TIME)
            info.compress_type = zipfile.ZIP_DEFLATED
            info.external_attr = 0o100644 << 16
            info.create_system = 3  # Unix
            archive.writestr(info, text)


def main(folder: str, rehearsal: str = "") -> None:
    """Make the archive in a folder."""
    try:
        source = rehearsal or address()
    except ValueError as error:
        sys.exit(f"error: {error}")
    target = Path(folder) / f"palpate-cpp-{version()}.zip"
    target.parent.mkdir(parents=True, exist_ok=True)
    write(target, source)
    print(target)


if __name__ == "__main__":
    if len(sys.argv) > 1:
        main(*sys.argv[1:])
    else:
        sys.stdout.write(one_header())
