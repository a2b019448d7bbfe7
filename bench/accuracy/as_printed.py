"""The extreme cases with the paper's form as printed, and with other libraries, each with the settings of the case."""

import math
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import palpate
from palpate import reference

from bench.accuracy.extremes import Case, exactly, settings_for, stepped


def _settings(kind: Any, case: Case) -> dict[str, float]:
    """Return the settings of a case, rounded to the type; no bound on P, which is palpate's."""
    return {**settings_for(kind, palpate.AdaptiveRls, case), "max_covariance": math.inf}


def exact_ratio(case: Case, *, detector: bool = True) -> float:
    """Return the last ratio without rounding errors; without the detector: with the forgetting factor `steady`."""
    settings = _settings(np.float64, case)
    if not detector:
        settings["alarmed"] = settings["steady"]
    digits = 700 if np.abs(case.regressor).max() > 1e100 else 60
    return float(exactly(case.output, case.regressor, digits, **settings).ratio[-1])


def printed(case: Case, kind: Any) -> float:
    """Return the last ratio of the paper's eq. (3) and steps 1-4 as printed, in numpy's float64 or float32."""
    with np.errstate(all="ignore"):
        samples = case.output.astype(kind), case.regressor.astype(kind)
        return float(reference.adaptive_rls(*samples, number=kind, **_settings(kind, case)).ratio[-1])


def as_set(peer: Callable[..., Any], case: Case) -> float:
    """Return the last ratio of another library, with the forgetting factor, initial ratio and covariance of a case."""
    settings = _settings(np.float64, case)
    covariance, forgetting, initial = (settings[name] for name in ("initial_covariance", "steady", "initial_ratio"))
    estimate = peer(case.output, case.regressor, covariance=covariance, forgetting=forgetting, initial=initial)
    return float(estimate[0][-1])


def distance(exact: float, find: Callable[..., float], *arguments: Any) -> str:
    """Return how far the ratio that `find` returns is from the exact one, per cent of it or of 1 if that is more, or how it failed."""
    with np.errstate(all="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            ratio = find(*arguments)
        except (ArithmeticError, ValueError, np.linalg.LinAlgError) as error:
            return type(error).__name__
    if not math.isfinite(ratio):
        return "nan" if math.isnan(ratio) else "inf"
    return f"{100 * abs(ratio - exact) / max(abs(exact), 1):.1g} %"


def after_a_step(covariance: float, kind: Any) -> tuple[float, float]:
    """Return the covariance after one sample, and the ratio 300 samples after a step from 2.5 to 3.

    Parameters
    ----------
    covariance : float
        P0, 1/pF^2.
    kind : type
        numpy.float64 or float32: the paper's form as printed; or an estimator of palpate.
    """
    steps = stepped()
    settings = {"initial_covariance": covariance, "max_covariance": max(covariance, 1e6)}
    if kind in (np.float64, np.float32):
        with np.errstate(all="ignore"):
            samples = (part.astype(kind) for part in steps)
            trace = reference.adaptive_rls(*samples, number=kind, **{**settings, "max_covariance": math.inf})
        return float(trace.covariance[0]), float(trace.ratio[-1])
    rows = kind(**settings).trace(*steps)
    return float(rows["covariance"][0]), float(rows["ratio"][-1])
