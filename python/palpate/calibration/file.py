"""Calibration files, TOML: parameters, scatter and the fitted data, with units and versions."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from palpate.calibration.curve_fit import Fit
from palpate.elasticity import Elasticity
from palpate.errors import CalibrationError, quoted, shortened
from palpate.extras import need
from palpate.files import parse_toml, read_toml, replacing

SCHEMA = 1
UNITS = {"modulus": "MPa", "ratio": "1", "standard_error": "1", "variance": "relative to the ratio squared"}
PARAMETERS = ["rigid_ratio", "log(half_modulus / MPa)", "soft_ratio"]
SCATTER = ["touch_variance", "touch_freedom", "specimen_variance", "specimen_freedom", "specimen_share", "misfit"]
DATA = {"moduli": "moduli_MPa", "ratios": "ratios", "standard_errors": "standard_errors", "touches": "touches"}
_RANGE = 1e30  # limit of a number: its fourth power, needed for an interval, stays finite


def save(path: Path, document: Mapping[str, Any]) -> None:
    """Write a document; the file is replaced atomically."""
    text = need("tomli_w", "science").dumps(document)
    parse_toml(text)
    with replacing(path) as file:
        file.write(text.encode())


def document(
    fit: Fit, probe: Elasticity, verdict: str, data: Mapping[str, Any], about: Mapping[str, str], version: str
) -> dict[str, Any]:
    """Return the contents of the file; `data`: the arrays ratios, moduli, standard_errors and touches."""
    return {
        "schema": SCHEMA,
        "palpate": version,
        "about": dict(about),
        "units": UNITS,
        "fit": {
            "rigid_ratio": probe.rigid_ratio,
            "half_modulus_MPa": probe.half_modulus,
            "soft_ratio": probe.soft_ratio,
            "calibrated_MPa": [float(data["moduli"].min()), float(data["moduli"].max())],
            "verdict": verdict,
            "parameters": fit.parameters.tolist(),
            "covariance": fit.covariance.tolist(),
            "covariance_of": PARAMETERS,
        },
        "scatter": {name: getattr(fit, name) for name in SCATTER},
        "data": {key: data[name].tolist() for name, key in DATA.items()},
    }


def load(path: Path) -> dict[str, Any]:
    """Return the arguments of `Calibration` from a file."""
    try:
        read = read_toml(path)
    except OSError as error:
        raise CalibrationError(f"{path}: cannot be read: {error.strerror}") from error
    except ValueError as error:
        raise CalibrationError(f"{path}: not a calibration: {error}") from error
    try:
        return _arguments(read)
    except (KeyError, TypeError, ValueError, OverflowError) as error:
        what = f"{error} is missing" if isinstance(error, KeyError) else shortened(str(error), 200)
        raise CalibrationError(f"{path}: not a calibration of palpate: {what}") from error


def _arguments(read: dict[str, Any]) -> dict[str, Any]:
    if read["schema"] != SCHEMA:
        raise ValueError(f"schema: got {quoted(read['schema'])}, allowed: {SCHEMA}")
    scatter, data = read["scatter"], read["data"]
    fit = Fit(
        parameters=_array(read["fit"], "parameters", (3,)),
        covariance=_array(read["fit"], "covariance", (3, 3)),
        touch_variance=_number(scatter, "touch_variance"),
        touch_freedom=_count(scatter, "touch_freedom", 0),
        specimen_variance=_number(scatter, "specimen_variance"),
        specimen_freedom=_count(scatter, "specimen_freedom", 1),
        specimen_share=_number(scatter, "specimen_share"),
        misfit=_number(scatter, "misfit"),
    )
    _check(fit)
    size = (len(data["ratios"]),)
    arrays = {name: _array(data, key, size) for name, key in DATA.items()}
    for name in ("moduli", "touches"):
        if not (arrays[name].size and (arrays[name] > 0).all()):
            raise ValueError(f"{DATA[name]}: got no value, or a value that is not positive, allowed: positive numbers")
    about = {str(key): str(value) for key, value in dict(read["about"]).items()}
    return {"fitted": fit, **arrays, "about": about, "version": str(read["palpate"])}


def _check(fit: Fit) -> None:
    rigid, log_half, soft = fit.parameters
    if not (rigid > soft and abs(log_half) < 100):
        raise ValueError(f"parameters: got {fit.parameters.tolist()}, allowed: soft_ratio < rigid_ratio")
    if fit.specimen_share > 1:
        raise ValueError(f"specimen_share: got {fit.specimen_share}, allowed: 0 to 1")
    covariance = fit.covariance
    smallest = (
        np.linalg.eigvalsh(covariance)[0] if np.allclose(covariance, covariance.T, rtol=1e-9, atol=0) else -np.inf
    )
    if smallest < -1e-9 * np.trace(covariance):
        raise ValueError("covariance: got an invalid matrix, allowed: symmetric and positive semidefinite")


def _array(table: dict[str, Any], name: str, shape: tuple[int, ...]) -> Any:
    values = np.array(table[name], dtype=float)
    if values.shape != shape or not (np.abs(values) < _RANGE).all():
        raise ValueError(
            f"{name}: got shape {values.shape} or a value out of range, allowed: {shape}, within {_RANGE:g}"
        )
    return values


def _number(table: dict[str, Any], name: str) -> float:
    value = float(table[name])
    if not 0 <= value < _RANGE:
        raise ValueError(f"{name}: got {value}, allowed: 0 to {_RANGE:g}")
    return value


def _count(table: dict[str, Any], name: str, least: int) -> int:
    value = table[name]
    if not isinstance(value, int) or not least <= value < 2**31:
        raise ValueError(f"{name}: got {quoted(value)}, allowed: a whole number, {least} or more")
    return value
