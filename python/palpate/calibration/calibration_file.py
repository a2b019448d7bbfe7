"""Calibration files, TOML: parameters, scatter, fitted data, units, origin and version."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypedDict

import numpy as np

from palpate.calibration.fit import Array, CurveFit
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
_RANGE = 1e30  # limit of a number: its fourth power, needed for an interval, stays finite
_COUNT = 2**31

Table = dict[str, Any]
"""A table of a TOML document."""
_OF_HOLD: Table = {"ratio": "hold", "contact_exponent": 1.0, "age_s": 0.0, "error_share": 1.0}
"""The table `touch` of a file without one."""


@dataclass(frozen=True)
class About:
    """Origin of the data of a calibration; saved with it.

    Attributes
    ----------
    scene : str
        Scene of the tracker that measured the touches; "": unknown.
    accepted_flags : tuple of str
        Flags that did not exclude a touch.
    doubts : tuple of str
        What is wrong with the recordings; empty: nothing is known.
    ratio, contact_exponent, age : str
        The value of this field of the calibration, and why it was chosen; "": it was not chosen.
    fitted_on : str
        The values that were fitted, one of `palpate.calibration.specimen_fit.CHOICES`.
    notes : mapping of str
        Further entries of the file, by name.

    Examples
    --------
    >>> About(scene="handheld", accepted_flags=("offset", "tilt")).entries()
    {'scene': 'handheld', 'accepted flags': 'offset tilt'}
    """

    scene: str = ""
    accepted_flags: tuple[str, ...] = ()
    doubts: tuple[str, ...] = ()
    ratio: str = ""
    contact_exponent: str = ""
    age: str = ""
    fitted_on: str = ""
    notes: Mapping[str, str] = field(default_factory=dict)

    @classmethod
    def of_entries(cls, entries: Mapping[str, object]) -> "About":
        """Return the origin from the table `about` of a file."""
        texts = {str(name): str(entry) for name, entry in entries.items()}
        doubts = texts.pop("doubts", "")
        return cls(
            scene=texts.pop("scene", ""),
            accepted_flags=tuple(texts.pop("accepted flags", "").split()),
            doubts=(doubts,) if doubts else (),
            ratio=texts.pop("ratio", ""),
            contact_exponent=texts.pop("contact exponent", ""),
            age=texts.pop("age", ""),
            fitted_on=texts.pop("fitted on", ""),
            notes=texts,
        )

    def entries(self) -> dict[str, str]:
        """Return the entries of the file that are not empty, by name."""
        entries = {
            "scene": self.scene,
            "accepted flags": " ".join(self.accepted_flags),
            "doubts": "; ".join(self.doubts),
            "ratio": self.ratio,
            "contact exponent": self.contact_exponent,
            "age": self.age,
            "fitted on": self.fitted_on,
            **self.notes,
        }
        return {name: entry for name, entry in entries.items() if entry}


class StoredFields(TypedDict):
    """The fields of `Calibration` as a file has them."""

    fitted: CurveFit
    ratios: Array
    moduli: Array
    standard_errors: Array
    touches: Array
    about: About
    version: str
    ratio: str
    contact_exponent: float
    age_s: float
    error_share: float


def write_document(path: Path, document: Table) -> None:
    """Write a document; the file is replaced atomically."""
    text = need("tomli_w", "science").dumps(document)
    parse_toml(text)
    write_file(path, text.encode())


def read_fields(path: Path) -> StoredFields:
    """Return the fields of `Calibration` from a file; raise `CalibrationError` if it is none."""
    try:
        return _fields(read_toml(path))
    except OSError as error:
        raise CalibrationError(f"{path}: cannot be read: {error.strerror}") from error
    except KeyError as error:
        raise CalibrationError(
            f"{path}: not a calibration of palpate: {error} is missing"
        ) from error
    except (TypeError, ValueError, OverflowError) as error:
        reason = shortened(str(error), 200)
        raise CalibrationError(f"{path}: not a calibration of palpate: {reason}") from error


def _fields(document: Table) -> StoredFields:
    if document["schema"] != SCHEMA:
        raise ValueError(f"schema: got {quoted(document['schema'])}, allowed: {SCHEMA}")
    fitted = _fit(document["fit"], document["scatter"])
    data = document["data"]
    size = (len(data["ratios"]),)
    touch = _OF_HOLD | document.get("touch", {})
    ratio = touch["ratio"]
    if ratio not in ("hold", "level"):
        raise ValueError(f"ratio: got {quoted(ratio)}, allowed: hold or level")
    return {
        "fitted": fitted,
        "ratios": _array(data, "ratios", size),
        "moduli": _positive_array(data, "moduli_MPa", size),
        "standard_errors": _array(data, "standard_errors", size),
        "touches": _positive_array(data, "touches", size),
        "about": About.of_entries(dict(document["about"])),
        "version": str(document["palpate"]),
        "ratio": ratio,
        "contact_exponent": _number(touch, "contact_exponent", 1.0, 3.0),
        "age_s": _number(touch, "age_s", 0.0, _RANGE),
        "error_share": _number(touch, "error_share", 0.0, 1.0),
    }


def _fit(fit: Table, scatter: Table) -> CurveFit:
    parameters = _array(fit, "parameters", (3,))
    covariance = _array(fit, "covariance", (3, 3))
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
    return CurveFit(
        parameters,
        covariance,
        touch_variance=_number(scatter, "touch_variance", 0.0, _RANGE),
        touch_freedom=_count(scatter, "touch_freedom", 0),
        specimen_variance=_number(scatter, "specimen_variance", 0.0, _RANGE),
        specimen_freedom=_count(scatter, "specimen_freedom", 1),
        specimen_share=_number(scatter, "specimen_share", 0.0, 1.0),
        misfit=_number(scatter, "misfit", 0.0, _RANGE),
    )


def _array(table: Table, name: str, shape: tuple[int, ...]) -> Array:
    values: Array = np.array(table[name], dtype=float)
    if values.shape != shape or not (np.abs(values) < _RANGE).all():
        allowed = f"{shape}, within {_RANGE:g}"
        raise ValueError(
            f"{name}: got shape {values.shape} or a value out of range, allowed: {allowed}"
        )
    return values


def _positive_array(table: Table, name: str, shape: tuple[int, ...]) -> Array:
    values = _array(table, name, shape)
    if not (values.size and (values > 0).all()):
        raise ValueError(
            f"{name}: got no value, or a value that is not positive, allowed: positive numbers"
        )
    return values


def _number(table: Table, name: str, low: float, high: float) -> float:
    value = table[name]
    if not (isinstance(value, float) and low <= value <= high):
        raise ValueError(f"{name}: got {quoted(value)}, allowed: {low:g} to {high:g}")
    return value


def _count(table: Table, name: str, low: int) -> int:
    value = table[name]
    if not (isinstance(value, int) and low <= value <= _COUNT):
        allowed = f"a whole number, {low:g} to {_COUNT:g}"
        raise ValueError(f"{name}: got {quoted(value)}, allowed: {allowed}")
    return value
