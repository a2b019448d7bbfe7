"""What the quotients of `python -m bench.speed` should be at most."""

from typing import Any

Figures = dict[str, Any]

LIMITS: list[tuple[str, str, str, float]] = [
    ("HandoverRls block / AdaptiveRls block", "HandoverRls", "AdaptiveRls", 4.5),
    ("the same, clang", "clang: HandoverRls", "clang: AdaptiveRls", 5.5),
    ("handheld feed without fit / the paper literally", "handheld without fit", "the paper's form literally", 4.0),
    (
        "Tracker.process, standard error a row / literally",
        "Python Tracker.process, 2000",
        "the paper's form literally",
        6.0,
    ),
    ("block, AdaptiveRls / the paper's form literally", "AdaptiveRls", "the paper's form literally", 0.33),
    ("alarm flickering / calm", "AdaptiveRls, alarm flickering", "AdaptiveRls", 1.15),
    ("idle (regressor 0) / normal", "AdaptiveRls, idle", "AdaptiveRls", 1.1),
    ("adaptive / fixed forgetting", "AdaptiveRls", "Rls", 1.15),
    ("Python trace(out=) / process(out=)", "Python trace, 2000", "Python process, 2000", 1.3),
    ("Python process(out=), n = 2,000 / native block", "Python process, 2000", "AdaptiveRls", 1.05),
    ("Python process(out=), n = 250 / native block", "Python process, 250", "AdaptiveRls, 250 samples", 1.2),
    ("estimator.update(a, b) / math.hypot(a, b)", "Python update", "math.hypot", 0.65),
    ("bank of 64, AVX2: a stream / single block", "avx2: bank of 64", "AdaptiveRls", 0.17),
    (
        "bank of 65,536, 16 rows, AVX2 / triad",
        "avx2: bank of 65536, 16 rows",
        "avx2: triad over the arrays of the bank of 65536, 16 rows",
        2.2,
    ),
    (
        "bank of 65,536, 64 rows, AVX2 / triad",
        "avx2: bank of 65536, 64 rows",
        "avx2: triad over the arrays of the bank of 65536, 64 rows",
        2.2,
    ),
    ("HandoverRlsBank(64), AVX2: a stream / HandoverRls", "avx2: HandoverRlsBank(64)", "HandoverRls", 0.45),
    ("HandoverRlsBank(64), AVX-512: a stream / HandoverRls", "avx512: HandoverRlsBank(64)", "HandoverRls", 0.35),
    ("ring, round trip / two flags", "ring, round trip", "two flags, round trip", 1.3),
    (
        "ring, push and pop / mutex queue",
        "ring, push and pop on one thread",
        "mutex queue, push and pop on one thread",
        0.1,
    ),
    ("SampleRing, 250 from and to numpy: an item / deque", "Python ring, 250", "Python deque, 250", 0.02),
    ("AdaptiveRls.update / padasip", "Python update", "padasip", 0.01),
    ("AdaptiveRls.update / river", "Python update", "river", 0.01),
    ("AdaptiveRls.update / filterpy", "Python update", "filterpy", 0.01),
    ("AdaptiveRls.update / numba, a call", "Python update", "numba, a call", 0.2),
    ("Python AdaptiveRls.process / numba, block", "Python process, 2000", "numba, block", 1.0),
    ("Python Rls.process / scipy lfilter, block", "Python Rls process, 2000", "scipy lfilter", 1.0),
    (
        "AdaptiveRlsBank(64) / simdkalman, 64 streams",
        "Python AdaptiveRlsBank(64), 156 rows",
        "simdkalman, 64 streams",
        0.01,
    ),
]
"""Comparisons: a name, two figures, and the wanted upper limit of their quotient."""
ESTIMATORS = [
    f"{compiler}{name}"
    for compiler in ("", "clang: ")
    for name in ("the paper's form literally", "Rls", "AdaptiveRls", "HandoverRls", "HandoverRls, float", "handheld")
]
"""Whose first pass over new data is compared with later passes."""


def limits(figures: Figures) -> str:
    """Print the quotients of minima and of medians, and the wanted limits."""
    lines = [f"{'quotient':62} {'of minima':>9} {'medians':>9} {'at most':>8}"]
    again = [(f"first pass / later passes: {n}", n, f"{n}, again", 1.05) for n in ESTIMATORS if n in figures]
    for name, one, other, limit in [*LIMITS, *again]:
        if one in figures and other in figures:
            low, middle = (figures[one][key] / figures[other][key] for key in ("min", "median"))
            verdict = "ok" if low <= limit else "above"
            lines.append(f"{name:62} {low:9.3f} {middle:9.3f} {limit:8.2f}  {verdict}")
        else:
            lines.append(f"{name:62} {'not measured here':>19} {limit:8.2f}")
    return "\n".join(lines)
