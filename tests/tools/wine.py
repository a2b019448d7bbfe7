"""Programs for Windows under Wine: a home of their own, without a display, and an end with words."""

import os
import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

LIMIT_S = 300
# Where distributions have Wine's libraries.
_PLACES = ("usr/lib/*/wine", "usr/lib*/wine", "opt/wine*/lib*/wine")


@dataclass(frozen=True)
class Wine:
    """One home of Wine, for programs one after another."""

    home: Path

    @property
    def environment(self) -> dict[str, str]:
        """Return what Wine is told, without DISPLAY: no window can wait for an answer."""
        # mscoree, mshtml: the parts for .NET and HTML, which Wine would ask to download.
        quiet = {"WINEDEBUG": "-all", "WINEDLLOVERRIDES": "mscoree=;mshtml="}
        return {"PATH": os.environ["PATH"], "HOME": str(self.home), "WINEPREFIX": str(self.home / "wine"), **quiet}

    def run(self, *words: str | Path, limit_s: float = LIMIT_S) -> str:
        """Run a program in the current folder `home` and return its output; RuntimeError if it fails or does not end."""
        command = ["wine", *map(str, words)]
        said = self.home / "said.txt"
        # Into a file: Wine's own processes inherit a pipe, and who reads it would wait for them, too.
        with said.open("w") as file:
            try:
                code = subprocess.run(
                    command, stdin=subprocess.DEVNULL, stdout=file, stderr=subprocess.STDOUT, check=False,
                    env=self.environment, cwd=self.home, timeout=limit_s,
                ).returncode  # fmt: skip
            except subprocess.TimeoutExpired:
                text = said.read_text(errors="replace")[-2000:]
                raise RuntimeError(f"{' '.join(command)}: no end within {limit_s:g} s\n{text}") from None
        text = said.read_text(errors="replace")
        if code:
            raise RuntimeError(f"{' '.join(command)}: exit {code}\n{text[-4000:]}")
        return text


def _libraries() -> Path | None:
    """Return the folder of Wine's libraries for programs of 64 bits."""
    found = (path for place in _PLACES for path in Path("/").glob(f"{place}/x86_64-windows"))
    return next((path for path in found if (path / "kernel32.dll").exists()), None)


def _furnish(home: Path) -> None:
    """Make Wine's home of links to its libraries: it would take 10 s and copy 700 MB.

    Where the libraries are not found, Wine does that itself.
    """
    libraries = _libraries()
    if libraries is None:
        return
    system = home / "wine" / "drive_c" / "windows" / "system32"
    drives = home / "wine" / "dosdevices"
    system.mkdir(parents=True)
    drives.mkdir()
    (drives / "c:").symlink_to("../drive_c")
    (drives / "z:").symlink_to("/")
    for file in libraries.iterdir():
        (system / file.name).symlink_to(file)
    (home / "wine" / ".update-timestamp").write_text("disable\n")


@contextmanager
def wine_home() -> Iterator[Wine]:
    """Give Wine with a new home. At the end its processes end, too."""
    with TemporaryDirectory(ignore_cleanup_errors=True) as name:
        wine = Wine(Path(name))
        _furnish(wine.home)
        try:
            yield wine
        finally:
            server = shutil.which("wineserver")
            if server:
                subprocess.run([server, "-k"], check=False, env=wine.environment, capture_output=True, timeout=60)
