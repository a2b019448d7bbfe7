"""What a calibration file contains, TOML: parameters, scatter, fitted data, origin, version.

`StoredCalibration` is read and written; its properties are what follows from the file alone: the
curve, the distances of the specimens from it, and the verdict on the fit.
"""

import os
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from math import exp, isfinite
from pathlib import Path
from typing import Any, Self

import numpy as np

from palpate.calibration.assessment import Assessment, Residual, assess, residuals
from palpate.calibration.assurance import CalibrationVerification
from palpate.calibration.evidence import EXPONENTS
from palpate.calibration.exponent_fits import ExponentFit
from palpate.calibration.fit import Array, CurveFit
from palpate.calibration.interval import check_level
from palpate.calibration.modulus import ParameterRow, parameter_row
from palpate.calibration.provenance import UNKNOWN, Provenance
from palpate.calibration.ranges import Range, Ranges
from palpate.elasticity import Elasticity
from palpate.errors import CalibrationError, need
from palpate.file_locks import exclusive_change
from palpate.files import parse_toml, read_toml, write_file
from palpate.messages import quoted, shortened

_SCHEMA = 2
_SCHEMAS = (1, _SCHEMA)  # 1: one curve for one exponent, without ranges
_UNITS = {
    "modulus": "MPa",
    "modulus_uncertainty": "relative to the modulus, k = 1",
    "ratio": "1",
    "standard_error": "1",
    "variance": "relative to the ratio squared",
}
_RANGE = 1e30  # limit of a number: its fourth power, needed for an interval, stays finite
_COUNT = 2**31
MOST_VERIFICATIONS = 100
"""Comparisons with specimens of known modulus that a file keeps."""

Table = dict[str, Any]
"""A table of a TOML document."""
_OF_HOLD: Table = {
    "ratio": "hold",
    "contact_exponent": 1.0,
    "age_s": 0.0,
    "error_share": 1.0,
    "stiffening_share": 0.0,
}
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
    provenance : palpate.calibration.provenance.Provenance
        When, by whom, and from which probe, chip and files; a table of its own in the file.

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
    provenance: Provenance = UNKNOWN

    @classmethod
    def of_entries(cls, entries: Mapping[str, object], provenance: Provenance = UNKNOWN) -> Self:
        """Return the origin from the table `about` of a file, and its provenance."""
        notes = {str(name): str(entry) for name, entry in entries.items()}
        doubts = notes.pop("doubts", "")
        return cls(
            scene=notes.pop("scene", ""),
            accepted_flags=tuple(notes.pop("accepted flags", "").split()),
            doubts=(doubts,) if doubts else (),
            ratio=notes.pop("ratio", ""),
            contact_exponent=notes.pop("contact exponent", ""),
            age=notes.pop("age", ""),
            fitted_on=notes.pop("fitted on", ""),
            notes=notes,
            provenance=provenance,
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


@dataclass(frozen=True, eq=False, repr=False)
class StoredCalibration:
    """The content of a calibration file: parameters, scatter, fitted data, and their assessment.

    The attributes are those of `palpate.Calibration`.
    """

    fitted: CurveFit
    ratios: Array
    moduli: Array
    standard_errors: Array
    touches: Array
    modulus_uncertainties: Array
    common_uncertainties: Array
    about: About = field(default_factory=About)
    version: str = ""
    ratio: str = "hold"
    contact_exponent: float = 1.0
    age_s: float = 0.0
    error_share: float = 1.0
    exponent_fits: tuple[ExponentFit, ...] = ()
    ranges: Ranges = field(default_factory=Ranges)
    verifications: tuple[CalibrationVerification, ...] = ()
    stiffening_share: float = 0.0

    @property
    def newest_verification(self) -> CalibrationVerification | None:
        """The newest comparison with a specimen of known modulus, by date; None: there is none."""
        in_order = sorted(self.verifications, key=lambda one: one.date)
        return in_order[-1] if in_order else None

    @property
    def is_reliable(self) -> bool:
        """Whether the fit has no objection, and the newest verification agrees."""
        newest = self.newest_verification
        return self.sound and (newest is None or newest.agrees)

    @property
    def probe(self) -> Elasticity:
        """Equation (2) with the fitted parameters."""
        rigid, log_half, soft = self.fitted.parameters.tolist()
        return Elasticity(rigid, exp(log_half), soft)

    @property
    def range(self) -> tuple[float, float]:
        """Smallest and largest calibrated modulus, MPa."""
        softest = float(self.moduli.min())
        stiffest = float(self.moduli.max())
        return softest, stiffest

    @property
    def residuals(self) -> list[Residual]:
        """Distance of each specimen from the curve, in order of modulus."""
        return residuals(
            self.fitted,
            self.ratios,
            self.moduli,
            self.standard_errors,
            self.touches,
            self.modulus_uncertainties,
        )

    @property
    def assessment(self) -> Assessment:
        """What speaks against the fit; prints as the verdict."""
        return assess(
            self.fitted, self.residuals, len(self.ratios), self.ratio, self.stiffening_share
        )

    @property
    def verdict(self) -> str:
        """Assessment of the fit, as text."""
        return str(self.assessment)

    @property
    def sound(self) -> bool:
        """Whether the fit has no objection."""
        return not self.assessment.objections

    def parameter_intervals(self, level: float = 0.95) -> dict[str, tuple[float, float]]:
        """Return the interval of each parameter: rigid_ratio, half_modulus (MPa), soft_ratio."""
        check_level(level)
        quantile = need("scipy.special", "science").stdtrit
        t = float(quantile(self.fitted.curve_freedom, 0.5 + level / 2))
        reach = t * np.sqrt(np.diag(self.fitted.covariance))
        low = (self.fitted.parameters - reach).tolist()
        high = (self.fitted.parameters + reach).tolist()
        return {
            "rigid_ratio": (low[0], high[0]),
            "half_modulus": (exp(low[1]), exp(high[1])),
            "soft_ratio": (low[2], high[2]),
        }

    def parameter_rows(self) -> list[ParameterRow]:
        """Return name, value and 95 % interval of each parameter as text."""
        ends = self.parameter_intervals()
        rows = []
        for name, value in asdict(self.probe).items():
            unit = " MPa" if name == "half_modulus" else ""
            rows.append(parameter_row(name, unit, value, ends[name]))
        return rows

    def as_dict(self) -> Table:
        """Return the contents of the file that `save` writes, as plain numbers and text."""
        scatter = asdict(self.fitted)
        del scatter["parameters"]
        del scatter["covariance"]
        return {
            "schema": _SCHEMA,
            "palpate": self.version,
            "about": self.about.entries(),
            "units": _UNITS,
            "fit": {
                "rigid_ratio": self.probe.rigid_ratio,
                "half_modulus_MPa": self.probe.half_modulus,
                "soft_ratio": self.probe.soft_ratio,
                "calibrated_MPa": list(self.range),
                "verdict": self.verdict,
                **_curve_table(self.fitted),
                "covariance_of": ["rigid_ratio", "log(half_modulus / MPa)", "soft_ratio"],
            },
            "touch": {
                "ratio": self.ratio,
                "contact_exponent": self.contact_exponent,
                "age_s": self.age_s,
                "error_share": self.error_share,
                "stiffening_share": self.stiffening_share,
            },
            "scatter": scatter,
            "exponents": list(map(_exponent_table, self.exponent_fits)),
            "ranges": _ranges_table(self.ranges),
            **_verification_table(self.verifications),
            "data": {
                "moduli_MPa": self.moduli.tolist(),
                "modulus_uncertainties": self.modulus_uncertainties.tolist(),
                "common_uncertainties": self.common_uncertainties.tolist(),
                "ratios": self.ratios.tolist(),
                "standard_errors": self.standard_errors.tolist(),
                "touches": self.touches.tolist(),
            },
            "provenance": self.about.provenance.as_dict(),
        }

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the calibration as TOML, with units, versions and the fitted data."""
        _write(Path(path), self.as_dict())

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Self:
        """Return the calibration from a file that `save` wrote.

        Raises
        ------
        CalibrationError
            The file is not a calibration.
        """
        try:
            return cls._of_document(read_toml(Path(path)))
        except OSError as error:
            raise CalibrationError(f"{path}: cannot be read: {error.strerror}") from error
        except KeyError as error:
            raise CalibrationError(
                f"{path}: not a calibration of palpate: {error} is missing"
            ) from error
        except (TypeError, ValueError, OverflowError) as error:
            reason = shortened(str(error), 200)
            raise CalibrationError(f"{path}: not a calibration of palpate: {reason}") from error

    @classmethod
    def _of_document(cls, document: Table) -> Self:
        if document["schema"] not in _SCHEMAS:
            allowed = " or ".join(map(str, _SCHEMAS))
            raise ValueError(f"schema: got {quoted(document['schema'])}, allowed: {allowed}")
        fitted = _fit(document["fit"], document["scatter"])
        data = document["data"]
        size = (len(data["ratios"]),)
        touch = _OF_HOLD | document.get("touch", {})
        ratio = touch["ratio"]
        if ratio not in ("hold", "level"):
            raise ValueError(f"ratio: got {quoted(ratio)}, allowed: hold or level")
        fits = _exponent_fits(document.get("exponents", ())) or _fits_of_one(fitted, ratio)
        exponent = _number(touch, "contact_exponent", 1.0, 3.0)
        if ratio == "level" and exponent not in [fit.contact_exponent for fit in fits]:
            raise ValueError(f"contact_exponent: got {exponent}, allowed: one of [[exponents]]")
        provenance = Provenance.of_table(document.get("provenance", {}))
        return cls(
            fitted,
            ratios=_array(data, "ratios", size),
            moduli=_array(data, "moduli_MPa", size, positive=True),
            standard_errors=_array(data, "standard_errors", size),
            touches=_array(data, "touches", size, positive=True),
            modulus_uncertainties=_uncertainties(data, "modulus_uncertainties", size),
            common_uncertainties=_uncertainties(data, "common_uncertainties", size),
            about=About.of_entries(document["about"], provenance),
            version=str(document["palpate"]),
            ratio=ratio,
            contact_exponent=exponent,
            age_s=_number(touch, "age_s", 0.0, _RANGE),
            error_share=_number(touch, "error_share", 0.0, 1.0),
            stiffening_share=_number(touch, "stiffening_share", 0.0, 1.0),
            exponent_fits=fits,
            ranges=_ranges(document.get("ranges", {})),
            verifications=tuple(
                map(CalibrationVerification.of_dict, document.get("verifications", ()))
            ),
        )


def add_verification(path: Path, verification: CalibrationVerification) -> None:
    """Add a comparison to a calibration file; of many the newest ones are kept.

    The file is replaced as a whole. All other entries stay as they are. Several programs may add
    at the same time: one waits for the other.

    Parameters
    ----------
    path : pathlib.Path
    verification : CalibrationVerification

    Raises
    ------
    CalibrationError
        The file is not a calibration.
    OSError
        It cannot be written; BlockingIOError: another program has been changing it for too long.
    """
    StoredCalibration.load(path)
    with exclusive_change(path):
        document = read_toml(path)
        tables = [*document.get("verifications", ()), verification.as_dict()]
        tables.sort(key=lambda table: str(table["date"]))
        document["verifications"] = tables[-MOST_VERIFICATIONS:]
        _write(path, document)


def _write(path: Path, document: Table) -> None:
    text = need("tomli_w", "science").dumps(document)
    parse_toml(text)
    write_file(path, text.encode())


def _verification_table(verifications: Sequence[CalibrationVerification]) -> Table:
    """Return the table of the comparisons; an empty one is left out."""
    if not verifications:
        return {}
    return {"verifications": [one.as_dict() for one in verifications]}


def _curve_table(fitted: CurveFit) -> Table:
    return {"parameters": fitted.parameters.tolist(), "covariance": fitted.covariance.tolist()}


def _exponent_table(fit: ExponentFit) -> Table:
    table = {**asdict(fit), **asdict(fit.fitted), **_curve_table(fit.fitted)}
    del table["fitted"]
    return table


def _exponent_fits(tables: Sequence[Table]) -> tuple[ExponentFit, ...]:
    """Return the fits of a file, in which one exponent is the likeliest; empty: it has no fits."""
    fits = tuple(map(_exponent_fit, tables))
    largest = max((fit.log_weight for fit in fits), default=0.0)
    if largest != 0:
        raise ValueError(f"log_weight: got at most {largest:g}, allowed: 0 for the likeliest")
    return fits


def _exponent_fit(table: Table) -> ExponentFit:
    return ExponentFit(
        _number(table, "contact_exponent", 1.0, 3.0),
        _fit(table, table),
        depth_slope=_number(table, "depth_slope", -_RANGE, _RANGE),
        depth_slope_error=_number(table, "depth_slope_error", 0.0, _RANGE),
        log_weight=_number(table, "log_weight", -_RANGE, 0.0),
    )


def _fits_of_one(fitted: CurveFit, ratio: str) -> tuple[ExponentFit, ...]:
    """Return the fits of a file with one curve: it does not say which exponents are possible."""
    if ratio == "hold":
        return (ExponentFit(1.0, fitted),)
    return tuple(ExponentFit(float(exponent), fitted) for exponent in EXPONENTS)


def _ranges_table(ranges: Ranges) -> Table:
    """Return the ranges that are known."""
    table: Table = {}
    if isfinite(ranges.tilt):
        table["tilt"] = ranges.tilt
    if ranges.depth_pF.is_known:
        table["depth_pF"] = list(ranges.depth_pF)
        table["middle_pF"] = ranges.middle_pF
    if ranges.rise_s.is_known:
        table["rise_s"] = list(ranges.rise_s)
    return table


def _ranges(table: Table) -> Ranges:
    ranges = Ranges()
    if "tilt" in table:
        ranges = replace(ranges, tilt=_number(table, "tilt", 0.0, _RANGE))
    if "depth_pF" in table:
        depth = _range(table, "depth_pF")
        middle = _number(table, "middle_pF", depth.low, depth.high)
        ranges = replace(ranges, depth_pF=depth, middle_pF=middle)
    if "rise_s" in table:
        ranges = replace(ranges, rise_s=_range(table, "rise_s"))
    return ranges


def _range(table: Table, name: str) -> Range:
    low, high = _array(table, name, (2,), positive=True).tolist()
    if low > high:
        raise ValueError(f"{name}: got {low:g} before {high:g}, allowed: the smaller one first")
    return Range(low, high)


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
        modulus_share=_number({"modulus_share": 0.0} | scatter, "modulus_share", 0.0, 1.0),
    )


def _array(table: Table, name: str, shape: tuple[int, ...], *, positive: bool = False) -> Array:
    values: Array = np.array(table[name], dtype=float)
    if values.shape != shape or not (np.abs(values) < _RANGE).all():
        allowed = f"{shape}, within {_RANGE:g}"
        raise ValueError(
            f"{name}: got shape {values.shape} or a value out of range, allowed: {allowed}"
        )
    if positive and not (values.size and (values > 0).all()):
        raise ValueError(
            f"{name}: got no value, or a value that is not positive, allowed: positive numbers"
        )
    return values


def _uncertainties(data: Table, name: str, size: tuple[int, ...]) -> Array:
    """Return relative uncertainties of the moduli; zeros for a file of an earlier version."""
    if name not in data:
        return np.zeros(size)
    values = _array(data, name, size)
    if not ((values >= 0) & (values < 1)).all():
        raise ValueError(f"{name}: got a value out of range, allowed: 0 or more and below 1")
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
