"""What somebody without a compiler waits for: `python -m release.newcomer WHEEL` installs it and opens the live page.

A new environment, a search path with nothing but its programs, nothing from pip's cache. Prints the time of each step since the
begin of the installation, and the processor's time, the environment's included, which knows no other load and no network.
"""

import os
import re
import subprocess
import sys
import tempfile
import urllib.request
from pathlib import Path
from time import perf_counter

_LIMIT_S = 300


def address_of(live: subprocess.Popen[str]) -> str:
    """Return the address that `palpate live` prints."""
    assert live.stdout
    said = ""
    for line in live.stdout:
        if found := re.search(r"http://\S+", line):
            return found[0]
        said += line
    sys.exit(f"error: palpate live ended with exit code {live.wait()} before it printed an address: {said}")


def served(programs: Path, environment: dict[str, str], begun: float) -> None:
    """Start the live page, read it, and print when address and page were there."""
    command = [str(programs / "palpate"), "live", "--port", "0"]
    live = subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    try:
        address = address_of(live)
        print(f"palpate live, address printed: {perf_counter() - begun:.1f} s")
        browser = urllib.request.build_opener(urllib.request.HTTPCookieProcessor())
        page = browser.open(address, timeout=_LIMIT_S).read().decode()
        print(f"the page answers: {perf_counter() - begun:.1f} s, {len(page)} bytes")
        if "<title>palpate</title>" not in page:
            sys.exit("error: the address is not the live page")
    finally:
        live.terminate()
        live.wait()


def main(wheel: str) -> None:
    """Install the wheel with the extra `live`, and look at the page."""
    with tempfile.TemporaryDirectory() as name:
        subprocess.run([sys.executable, "-m", "venv", name], check=True)
        programs = Path(name) / ("Scripts" if os.name == "nt" else "bin")
        environment = {**os.environ, "PATH": str(programs), "HOME": name, "BROWSER": "true", "PYTHONUNBUFFERED": "1"}
        compilers = [c for c in ("cc", "c++", "gcc", "g++", "clang", "cmake", "ninja") if (programs / c).exists()]
        assert compilers == []
        begun = perf_counter()
        requirement = f"palpate[live] @ {Path(wheel).resolve().as_uri()}"
        # only-binary: a dependency without a wheel is an error, not a try to compile it.
        install = [
            str(programs / "python"),
            "-m",
            "pip",
            "install",
            "--quiet",
            "--no-cache-dir",
            "--only-binary",
            ":all:",
        ]
        subprocess.run([*install, requirement], env=environment, check=True, timeout=_LIMIT_S)
        spent = os.times()
        processor_s = spent.children_user + spent.children_system
        print(
            f"pip install of the wheel with [live]: {perf_counter() - begun:.1f} s, {processor_s:.1f} s of a processor"
        )
        served(programs, environment, begun)


if __name__ == "__main__":
    main(*sys.argv[1:])
