"""What an editor knows of the compiled core: the stub describes the module, and marks what Python would refuse."""

import inspect
import subprocess
import sys
from math import inf, nan
from pathlib import Path
from typing import Any

import palpate
import pytest
from palpate import _core

CLASSES = [value for value in vars(_core).values() if inspect.isclass(value)]
PRIOR = {"initial_ratio": 1.0, "initial_covariance": 1e12, "max_covariance": 1e12}
PAPER = {"steady": 0.995, "alarmed": 0.9, "drift": 0.01, "threshold": 0.05, "clear_level": 0.0}
TWO_SIGNALS = {
    "false_alarm_interval": 1e7,
    "smallest_shift": 1.5,
    "clip": 3.0,
    "smoothing": 0.0625,
    "guard": 0,
    "initial_ratio": 1.0,
}
DEFAULTS = {
    "Rls": {"forgetting": 0.995} | PRIOR,
    "AdaptiveRls": PAPER | PRIOR,
    "HandoverRls": TWO_SIGNALS,
}
"""Of the public interface: DESIGN says them."""


def test_the_stub_is_that_of_the_module(tmp_path: Path) -> None:
    allowed = tmp_path / "allowed.txt"
    allowed.write_text("palpate\\._core\\.[A-Z]\\w*\n")  # the metaclass of pybind11
    command = [
        sys.executable,
        "-m",
        "mypy.stubtest",
        "palpate._core",
        "--concise",
        "--allowlist",
        str(allowed),
    ]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, check=False)
    final = "is read-only at runtime but not in the stub"  # it does not know that Final says so
    assert [line for line in done.stdout.splitlines() if not line.endswith(final)] == [], (
        done.stderr
    )


@pytest.mark.parametrize("cls", CLASSES)
def test_every_class_and_method_has_a_signature(cls: type) -> None:
    inspect.signature(cls)
    for name, member in vars(cls).items():
        if callable(member) and (name[0] != "_" or name == "__init__"):
            assert "self" in inspect.signature(member).parameters, name


@pytest.mark.parametrize("name", DEFAULTS)
def test_the_defaults_are_the_cores(name: str) -> None:
    for bits in ("", "32"):
        cls = getattr(palpate, name + bits)
        shown = {n: p.default for n, p in inspect.signature(cls).parameters.items()}
        assert shown == cls().settings == palpate.Bank(cls(), 1).settings == DEFAULTS[name]
        assert list(shown) == list(cls().settings)


@pytest.mark.parametrize(
    "cls", [cls for cls in CLASSES if "Rls" in cls.__name__ or cls is palpate.Tracker]
)
def test_a_wrong_keyword_names_the_allowed_ones(cls: type) -> None:
    with pytest.raises(
        TypeError, match=f"^{cls.__name__}: got an unexpected keyword 'smalest_shift'"
    ) as caught:
        cls(smalest_shift=3)
    if "Handover" in cls.__name__:
        names = ", ".join(DEFAULTS["HandoverRls"])
        assert str(caught.value).endswith(
            f"'smalest_shift', allowed: {names}; did you mean 'smallest_shift'?"
        )


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: palpate.Rls(0.9), "Rls: got too many values without a name, allowed: names only"),  # type: ignore[call-arg]
        (lambda: palpate.Rls(forgetting="x"), "forgetting: got 'x', allowed: a number"),  # type: ignore[arg-type]
        (lambda: palpate.Rls.__init__(palpate.Tracker()), "__init__.* called with invalid"),  # type: ignore[arg-type]
        (
            lambda: palpate.Tracker("paper", clip=3),  # type: ignore[call-overload]
            "keyword 'clip', allowed: samples, seconds, full",
        ),
        (lambda: palpate.Tracker(clip="x"), "clip: got 'x', allowed: a number"),  # type: ignore[call-overload]
    ],
)
def test_what_constructors_refuse(call: object, message: str) -> None:
    with pytest.raises(TypeError, match=message):
        call()  # type: ignore[operator]


@pytest.mark.parametrize(
    ("kind", "settings", "message"),
    [
        ("Rls", {"forgetting": 0.0}, "forgetting: got 0.0, allowed: 0 < forgetting <= 1"),
        ("Rls", {"forgetting": nan}, "forgetting: got nan"),
        (
            "AdaptiveRls",
            {"alarmed": 0.999},
            r"alarmed: got 0.999, allowed: 0 < alarmed <= steady \(0.995\)",
        ),
        ("AdaptiveRls", {"drift": -0.1}, "drift: got -0.1, allowed: 0 <= drift, finite"),
        ("AdaptiveRls", {"threshold": nan}, "threshold: got nan, allowed: 0 <= threshold"),
        ("AdaptiveRls", {"clear_level": 0.06}, r"clear_level: got 0.06, .* threshold \(0.05\)"),
        ("Rls", {"initial_ratio": inf}, "initial_ratio: got inf, allowed: a finite number"),
        ("Rls", {"initial_covariance": 0}, "initial_covariance: got 0.0, allowed: 2.2"),
        ("Rls", {"max_covariance": inf}, "max_covariance: got inf, allowed: 2.2"),
        ("Rls32", {"max_covariance": 1e39}, "max_covariance: got 1e.39, allowed: 1.17"),
        (
            "Tracker",
            {"scene": "moon"},
            "scene: got 'moon', allowed: fixed, paper, handheld, sliding",
        ),
        ("Tracker", {"scene": "paper", "seconds": nan}, "seconds: got nan, allowed: 0 < seconds"),
        ("Tracker", {"seconds": 3.0, "samples": 20}, "seconds"),
        ("Tracker", {"samples": 2.5}, "samples: got 2.5, allowed: a whole number >= 1, or None"),
        ("Tracker", {"release": 1.0}, "release: got 1.0"),
        ("Tracker", {"smallest_shift": 5.0}, r"smallest_shift: got 5.0, .* 1.5 clip \(4.5\)"),
        (
            "Tracker",
            {"smallest_shift": 1e-3},
            "smallest_shift: got 0.001, allowed: a larger shift, or a shorter interval",
        ),
        ("VectorRls", {"size": 2, "clip": 0.5}, "clip: got 0.5, allowed: 1 to 100"),
        (
            "HandoverRls",
            {"false_alarm_interval": 1e13},
            "false_alarm_interval: got 10000000000000.0, allowed: 10 to 1e12 samples, or inf",
        ),
        ("Tracker", {"scene": "fixed", "forgetting": 2.0}, "forgetting: got 2.0"),
    ],
)
def test_settings_are_checked(kind: str, settings: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        getattr(palpate, kind)(**settings)


GOOD = """
import palpate
palpate.Tracker()
palpate.Tracker("handheld", smallest_shift=1.0, samples=None)
palpate.Tracker(scene="paper", alarmed=0.9)
palpate.HandoverRls(false_alarm_interval=1e5)
with palpate.Stream("sim:", scene="sliding", release=0.2) as stream:
    stream.stop()
palpate.touches(palpate.read("a.csv"), scene="fixed", forgetting=0.9)
palpate.touches([9.0, 9.1], [8.0, 8.1], rate_hz=40, soft_later_s=0.01, scene="paper")
palpate.touches(hard=[9.0, 9.1], soft=[8.0, 8.1], times_s=[0.0, 0.1], unit="N")
"""
GOOD += "".join(
    f"palpate.Tracker({scene!r}, {', '.join(f'{name}={value!r}' for name, value in settings.items())})\n"
    for scene in _core.scenes
    for settings in [palpate.Tracker(scene, full_scale=4.0).settings]  # type: ignore[call-overload]
)
CALLS = ("palpate.Tracker(", 'palpate.Stream("sim:", ', 'palpate.touches(palpate.read("a.csv"), ')
BAD = [f"{call}{wrong})" for call in CALLS for wrong in ('scene="handhel"', "threshhold=3")]
BAD += ['palpate.Tracker("paper", clip=3.0)', 'palpate.Tracker("handheld", clip="3")']
BAD += [
    'palpate.Tracker("handheld", threshold=3)',
    "palpate.HandoverRls(threshold=3)",
    "palpate.Bank(palpate.Tracker(), 3)",
    "palpate.touches([9.0, 9.1], [8.0, 8.1])",
    "palpate.touches([9.0, 9.1], [8.0, 8.1], rate_hz=40, times_s=[0.0, 0.1])",
    'palpate.touches("a.csv", rate_hz=40)',
]


def test_a_checker_marks_what_would_be_refused(tmp_path: Path) -> None:
    snippet = tmp_path / "snippet.py"
    snippet.write_text(GOOD + "\n".join(BAD) + "\n")
    command = [
        sys.executable,
        "-m",
        "mypy",
        "--strict",
        "--no-incremental",
        "--no-error-summary",
        str(snippet),
    ]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, check=False)
    first = len(GOOD.splitlines()) + 1
    marked = {int(line.split(":")[1]) for line in done.stdout.splitlines() if ": error:" in line}
    assert marked == set(range(first, first + len(BAD))), done.stdout + done.stderr
