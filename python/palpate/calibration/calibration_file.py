"""Calibration files, TOML: parameters, scatter and the fitted data, with units and versions."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from palpate.calibration.fit import CurveFit
from palpate.errors import CalibrationError, need
from palpate.files import parse_toml, read_toml, write_file
from palpate.messages import quoted, shortened

SCHEMA = 1
UNITS = {
    "modulus": "MPa",
    "ratio": "1",
    "standard_error": "1",
    "variance": "relative to the ratio squared",
}
PARAMETERS = ["rigid_ratio", "log(half_modulus / MPa)", "soft_ratio"]
DATA = {
    "moduli": "moduli_MPa",
    "ratios": "ratios",
    "standard_errors": "standard_errors",
    "touches": "touches",
}
_RANGE = 1e30  # limit of a number: its fourth power, needed for an interval, stays finite
_COUNT = 2**31
# Fields of `CurveFit`, and the range of each.
SCATTER: dict[str, tuple[float, float]] = {
    "touch_variance": (0.0, _RANGE),
    "touch_freedom": (0, _COUNT),
    "specimen_variance": (0.0, _RANGE),
    "specimen_freedom": (1, _COUNT),
    "specimen_share": (0.0, 1.0),
    "misfit": (0.0, _RANGE),
}

# Fields of `Calibration`, and the range of each number; files without them are of the ratio of the hold.
NUMBERS = {"contact_exponent": (1.0, 3.0), "age_s": (0.0, _RANGE), "error_share": (0.0, 1.0)}
TOUCH = ["ratio", *NUMBERS]


def write_document(path: Path, document: Mapping[str, Any]) -> None:
    """Write a document; the file is replaced atomically."""
    text = need("tomli_w", "science").dumps(document)
    parse_toml(text)
    write_file(path, text.encode())


def read_document(path: Path) -> dict[str, Any]:
    """Return the arguments of `Calibration` from a file."""
    try:
        return _arguments(read_toml(path))
    except OSError as error:
        raise CalibrationError(f"{path}: cannot be read: {error.strerror}") from error
    except (KeyError, TypeError, ValueError, OverflowError) as error:
        what = f"{error} is missing" if isinstance(error, KeyError) else shortened(str(error), 200)
        raise CalibrationError(f"{path}: not a calibration of palpate: {what}") from error


def _arguments(read: dict[str, Any]) -> dict[str, Any]:
    if read["schema"] != SCHEMA:
        raise ValueError(f"schema: got {quoted(read['schema'])}, allowed: {SCHEMA}")
    parameters, covariance = (
        _array(read["fit"], "parameters", (3,)),
        _array(read["fit"], "covariance", (3, 3)),
    )
    rigid, log_half, soft = parameters
    if not (rigid > soft and abs(log_half) < 100):
        raise ValueError(
            f"parameters: got {parameters.tolist()}, allowed: soft_ratio < rigid_ratio"
        )
    symmetric = np.allclose(covariance, covariance.T, rtol=1e-9, atol=0)
    if not symmetric or np.linalg.eigvalsh(covariance)[0] < -1e-9 * np.trace(covariance):
        raise ValueError(
            "covariance: got an invalid matrix, allowed: symmetric and positive semidefinite"
        )
    fit = CurveFit(
        parameters,
        covariance,
        **{name: _number(read["scatter"], name, *range_) for name, range_ in SCATTER.items()},
    )
    data, size = read["data"], (len(read["data"]["ratios"]),)
    arrays = {name: _array(data, key, size) for name, key in DATA.items()}
    for name in ("moduli", "touches"):
        if not (arrays[name].size and (arrays[name] > 0).all()):
            raise ValueError(
                f"{DATA[name]}: got no value, or a value that is not positive, allowed: positive numbers"
            )
    about = {str(key): str(value) for key, value in dict(read["about"]).items()}
    touch = dict(read.get("touch", {}))
    if (ratio := touch.pop("ratio", "hold")) not in ("hold", "level"):
        raise ValueError(f"ratio: got {quoted(ratio)}, allowed: hold or level")
    made = {
        name: _number(touch, name, *range_) for name, range_ in NUMBERS.items() if name in touch
    }
    return {
        "fitted": fit,
        **arrays,
        "about": about,
        "version": str(read["palpate"]),
        "ratio": ratio,
        **made,
    }


def _array(table: dict[str, Any], name: str, shape: tuple[int, ...]) -> Any:
    values = np.array(table[name], dtype=float)
    if values.shape != shape or not (np.abs(values) < _RANGE).all():
        allowed = f"{shape}, within {_RANGE:g}"
        raise ValueError(
            f"{name}: got shape {values.shape} or a value out of range, allowed: {allowed}"
        )
    return values


def _number(table: dict[str, Any], name: str, low: float, high: float) -> Any:
    value = table[name]
    if not (isinstance(value, type(low)) and low <= value <= high):
        kind = "a whole number, " if isinstance(low, int) else ""
        raise ValueError(f"{name}: got {quoted(value)}, allowed: {kind}{low:g} to {high:g}")
    return value
