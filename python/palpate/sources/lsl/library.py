"""The library of Lab Streaming Layer, and its clock beside that of the computer."""

import os
import time
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

from palpate.errors import MissingExtra
from palpate.extras import need

SAMPLES = ("hard_pF", "soft_pF", "soft_offset_s", "seq", "status", "gaps")
"""Labels of the channels of palpate's own stream of samples. gaps: number of gaps of the source so far."""

MANUFACTURER = "palpate"
"""In the description of palpate's own streams."""

_SILENT = "[log]\nlevel = -3\n"  # fatal errors only: palpate says itself what happens to a stream


@cache
def library() -> Any:
    """Import pylsl.

    liblsl prints to standard error. It is told not to, unless the user has a configuration file for it.

    Raises
    ------
    MissingExtra
        pylsl or liblsl is not installed.
    """
    try:
        found = need("pylsl", "lsl")
    except (RuntimeError, OSError) as error:  # from its search for liblsl
        said = str(error).strip().split("\n")[0]
        raise MissingExtra(
            f"pylsl finds no liblsl ({said:.100}); type: pip install --force-reinstall 'palpate[lsl]', "
            "or set PYLSL_LIB to the library"
        ) from error
    with suppress(RuntimeError):  # liblsl before 1.17.7 has no such call; or there is no home folder
        if not _configured():
            found.set_config_content(_SILENT)
    return found


def _configured() -> bool:
    """Return whether liblsl will find a configuration file: its own search."""
    files = [Path("lsl_api.cfg"), Path("~/lsl_api/lsl_api.cfg").expanduser(), Path("/etc/lsl_api/lsl_api.cfg")]
    return "LSLAPICFG" in os.environ or any(file.exists() for file in files)


def ahead_ns(pylsl: Any) -> int:
    """Return how far the clock of LSL is ahead of `time.monotonic_ns()`, ns; exactly 0 where they are the same clock.

    A moment of the one between two moments of the other, closest of some: on Linux they are the same clock.
    """
    read = [(time.monotonic_ns(), pylsl.local_clock(), time.monotonic_ns()) for _ in range(5)]
    before, lsl_s, after = min(read, key=lambda times: times[2] - times[0])
    lsl_ns = round(lsl_s * 1e9)
    return 0 if before <= lsl_ns <= after else lsl_ns - (before + after) // 2
