"""Real-time estimation of a capacitance ratio, and from it of elasticity.

The estimators of the compiled core are imported at once; everything that needs numpy is imported at
its first use.
"""

from __future__ import annotations

from palpate._core import (
    AdaptiveRls,
    AdaptiveRls32,
    Bank,
    HandoverRls,
    HandoverRls32,
    Rls,
    Rls32,
    SampleRing,
    Tracker,
    VectorRls,
    __version__,
)
from palpate.errors import PalpateError

TYPE_CHECKING = (
    False  # True for a type checker; importing typing would take longer than all the rest
)
if TYPE_CHECKING:
    from typing import Any

    from palpate.batch import touches
    from palpate.calibration import Calibration
    from palpate.flags import advice
    from palpate.judgements import Judgement
    from palpate.offline_touches import offline
    from palpate.recording import Recording, check, read, recorded
    from palpate.repeatability import agreement, most_reliable
    from palpate.samples import Sample, Status
    from palpate.sources import Source, open
    from palpate.stream import Stream
    from palpate.touch import Touch
    from palpate.uncertainty import Uncertainty

__all__ = [
    "AdaptiveRls",
    "AdaptiveRls32",
    "Bank",
    "Calibration",
    "HandoverRls",
    "HandoverRls32",
    "Judgement",
    "PalpateError",
    "Recording",
    "Rls",
    "Rls32",
    "Sample",
    "SampleRing",
    "Source",
    "Status",
    "Stream",
    "Touch",
    "Tracker",
    "Uncertainty",
    "VectorRls",
    "__version__",
    "advice",
    "agreement",
    "check",
    "get_cmake_dir",
    "get_include",
    "most_reliable",
    "offline",
    "open",
    "read",
    "recorded",
    "touches",
]

_LAZY = {
    "offline_touches": ("offline",),
    "calibration": ("Calibration",),
    "batch": ("touches",),
    "recording": ("Recording", "check", "read", "recorded"),
    "samples": ("Sample", "Status"),
    "flags": ("advice",),
    "judgements": ("Judgement",),
    "repeatability": ("agreement", "most_reliable"),
    "sources": ("Source", "open"),
    "stream": ("Stream",),
    "touch": ("Touch",),
    "uncertainty": ("Uncertainty",),
}
"""The names that each module is imported for. No module may have the name of a function."""


def __getattr__(name: str) -> Any:
    from importlib import import_module
    from importlib.util import find_spec

    for module, names in _LAZY.items():
        if name in names:
            return getattr(import_module(f"palpate.{module}"), name)
    if not name.startswith("_") and find_spec(f"palpate.{name}"):
        return import_module(f"palpate.{name}")
    raise AttributeError(f"module 'palpate' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})


def get_include() -> str:
    """Return the folder to pass to a C++ compiler for ``#include <palpate/palpate.hpp>``.

    Returns
    -------
    str
        Absolute path, for the option ``-I``.

    Examples
    --------
    >>> from pathlib import Path
    >>> (Path(get_include()) / "palpate" / "palpate.hpp").exists()
    True
    """
    from pathlib import Path

    from palpate import _core

    return str(Path(_core.__file__).parent / "include")


def get_cmake_dir() -> str:
    """Return the folder for CMake's ``find_package(palpate)`` and ``add_subdirectory``.

    Returns
    -------
    str
        Absolute path.

    Examples
    --------
    >>> from pathlib import Path
    >>> Path(get_cmake_dir()).parts[-2:]
    ('cmake', 'palpate')
    """
    from pathlib import Path

    from palpate import _core

    return str(Path(_core.__file__).parent / "lib" / "cmake" / "palpate")
