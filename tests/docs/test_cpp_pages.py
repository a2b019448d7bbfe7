"""The pages for C++ programmers: each block compiles as it stands, programs print what follows, sizes are measured."""

import re
import shlex
import subprocess
from pathlib import Path

import pytest
from project import ROOT, asked, compiles, need, run

CPP = ROOT / "docs" / "cpp.md"
EMBEDDED = ROOT / "docs" / "embedded.md"


def blocks(page: Path, language: str) -> list[str]:
    """Return the blocks of a language, in order."""
    text = page.read_text(encoding="utf-8")
    return re.findall(rf"^```{language}\n(.*?)^```$", text, re.DOTALL | re.MULTILINE)


EACH = []
for page in (CPP, EMBEDDED):
    for number, block in enumerate(blocks(page, "cpp"), 1):
        EACH.append(pytest.param(block, id=f"{page.stem}-{number}"))


@pytest.mark.parametrize("block", EACH)
def test_a_block_compiles_as_it_stands(block: str, tmp_path: Path) -> None:
    """With its own includes, as a reader copies it."""
    compiles("c++", block, tmp_path)


def test_the_first_program_prints_what_the_page_shows(tmp_path: Path) -> None:
    source = tmp_path / "gain.cpp"
    source.write_text(blocks(CPP, "cpp")[0])
    program = tmp_path / "gain"
    run(need("c++"), "-std=c++17", asked("--includes"), source, "-o", program)
    assert run(program) == blocks(CPP, "text")[0]


def test_the_instrument_has_the_sizes_of_the_page(tmp_path: Path) -> None:
    """Text and data are in the flash, data and bss in the RAM."""
    need("arm-none-eabi-g++")
    if "12." not in run("arm-none-eabi-g++", "-dumpversion"):
        pytest.skip("the sizes are of g++ 12")
    [commands] = [text for text in blocks(EMBEDDED, "sh") if "arm-none-eabi-g++" in text]
    found = []
    for command in commands.splitlines():
        made = tmp_path / "loop.o"
        subprocess.run([*shlex.split(command), "-o", made], cwd=ROOT, check=True)
        sizes = run("arm-none-eabi-size", made).splitlines()[1].split()
        text, data, bss = map(int, sizes[:3])
        found.append((str(text + data), str(data + bss)))
    page_text = EMBEDDED.read_text(encoding="utf-8")
    assert re.findall(r"^\| Cortex-M.*\| (\d+) \| (\d+) \|$", page_text, re.MULTILINE) == found
