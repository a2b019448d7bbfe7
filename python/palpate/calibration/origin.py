"""Whether readings come from the chip of a calibration, and from a probe as its touches do."""

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
from datetime import datetime, timedelta
from enum import StrEnum
from typing import Any, NamedTuple, Self

from palpate.calibration.provenance import (
    OF_THE_COMMAND,
    Provenance,
    field_names,
    present_time,
    recorded_at,
)
from palpate.errors import CalibrationRefused
from palpate.files import Json
from palpate.messages import shortened
from palpate.recording.sidecar import Sidecar, is_simulated

OLD = timedelta(days=365)
"""A calibration that is further from the readings is old: a choice. Rubber hardens within years."""
_DAY = timedelta(days=1)  # a clock in another zone is not in the future
_NO_INSTRUMENT = frozenset({"recording", "table of another program", "LSL stream"})
"""Names of descriptions that do not state the instrument."""


class AcceptedOrigin(StrEnum):
    """What a user can accept of a calibration.

    Examples
    --------
    >>> list(map(str, AcceptedOrigin))
    ['other-chip', 'simulated']
    """

    OTHER_CHIP = "other-chip"
    """It was made with another chip."""
    SIMULATED = "simulated"
    """Its touches are simulated, the readings are of a probe."""


@dataclass(frozen=True)
class ReadingsOrigin:
    """Where readings come from.

    Attributes
    ----------
    chip : str
        Fingerprint of the chip; "": unknown.
    simulated : bool or None
        Whether a simulator made them; None: unknown.
    measured : datetime.datetime or None
        When they were recorded, UTC; None: unknown, or now.

    Examples
    --------
    >>> ReadingsOrigin.of_device({"name": "AD7746", "fingerprint": "66 cc 5c 90"})
    ReadingsOrigin(chip='66 cc 5c 90', simulated=False, measured=None)
    >>> ReadingsOrigin.of_device({})
    ReadingsOrigin(chip='', simulated=None, measured=None)
    """

    chip: str = ""
    simulated: bool | None = None
    measured: datetime | None = None

    @classmethod
    def of_device(cls, device: Mapping[str, Any], measured: datetime | None = None) -> Self:
        """Return the origin by the description of an instrument, `Source.describe`."""
        chip = shortened(str(device.get("fingerprint", "")))
        simulated: bool | None = is_simulated(device)
        if not device or device.get("name") in _NO_INSTRUMENT:
            simulated = None
        return cls(chip, simulated, measured)

    @classmethod
    def of_sidecar(cls, sidecar: Sidecar) -> Self:
        """Return the origin by the sidecar of a recording; by an empty one it is unknown."""
        return cls.of_device(sidecar.device, recorded_at(sidecar))


class Mismatch(NamedTuple):
    """A difference between the origins of a calibration and of readings.

    Attributes
    ----------
    accepted_by : AcceptedOrigin
    text : str
    allowed : str
        What is allowed, and what to do.
    """

    accepted_by: AcceptedOrigin
    text: str
    allowed: str


def mismatches(provenance: Provenance, origin: ReadingsOrigin) -> list[Mismatch]:
    """Return what is known to differ so that moduli would be wrong; what is unknown never does.

    Examples
    --------
    >>> made = Provenance(chips=("66 cc 5c 90",), simulated=False)
    >>> [found] = mismatches(made, ReadingsOrigin("61 12 5c 34", simulated=False))
    >>> found.text
    'the calibration was made with the chip 66 cc 5c 90, but the readings are from 61 12 5c 34'
    """
    if provenance.simulated and origin.simulated is False:
        found = Mismatch(
            AcceptedOrigin.SIMULATED,
            "the calibration was made from simulated touches, but the readings are from a probe",
            "a calibration of this probe; make one with palpate calibrate",
        )
        return [found]
    if provenance.simulated is False and origin.simulated:
        return []
    if not origin.chip or not provenance.chips or origin.chip in provenance.chips:
        return []
    chips = " and ".join(provenance.chips)
    found = Mismatch(
        AcceptedOrigin.OTHER_CHIP,
        f"the calibration was made with the chip {chips}, but the readings are from {origin.chip}",
        "readings from the same chip; calibrate with this one",
    )
    return [found]


def refusal(provenance: Provenance, origin: ReadingsOrigin, accept: Collection[str] = ()) -> str:
    """Return why a calibration is not used for readings; "": it is.

    Parameters
    ----------
    provenance : Provenance
        Of the calibration.
    origin : ReadingsOrigin
        Of the readings.
    accept : collection of str
        Of `AcceptedOrigin`.

    Examples
    --------
    >>> refusal(Provenance(simulated=True), ReadingsOrigin(simulated=False), [AcceptedOrigin.SIMULATED])
    ''
    """
    refused = []
    for found in mismatches(provenance, origin):
        if found.accepted_by not in accept:
            anyway = f"use it anyway with --accept {found.accepted_by}"
            refused.append(f"{found.text}, allowed: {found.allowed}, or {anyway}")
    return "; ".join(refused)


def require_origin(
    place: str, provenance: Provenance, origin: ReadingsOrigin, accept: Collection[str] = ()
) -> None:
    """Refuse readings for which a calibration was not made.

    Parameters
    ----------
    place : str
        The name of the readings, for the message.
    provenance, origin, accept
        As in `refusal`.

    Raises
    ------
    CalibrationRefused
        They are of another chip, or of a probe and the calibration is simulated.
    """
    reason = refusal(provenance, origin, accept)
    if reason:
        raise CalibrationRefused(f"{place}: {reason}")


def missing_remark(provenance: Provenance) -> str:
    """Return the remark that a calibration does not state where it comes from; "": it does.

    Examples
    --------
    >>> print(missing_remark(Provenance(simulated=True)) or "nothing")
    nothing
    """
    missing = provenance.missing()
    if not missing:
        return ""
    text = f"the calibration does not state: {field_names(missing)}"
    options = [f"--{name}" for name in OF_THE_COMMAND if name in missing]
    if options:
        text += f"; palpate calibrate has {' '.join(options)}"
    return text


def accepted_remarks(provenance: Provenance, origin: ReadingsOrigin) -> list[str]:
    """Return what differs between a calibration and readings, and was accepted."""
    remarks = []
    for found in mismatches(provenance, origin):
        remarks.append(f"{found.text}; used anyway because of --accept {found.accepted_by}")
    return remarks


def origin_remarks(
    provenance: Provenance,
    origin: ReadingsOrigin,
    now: datetime | None = None,
) -> list[str]:
    """Return remarks on a calibration and readings of an origin that was not refused.

    Parameters
    ----------
    provenance : Provenance
    origin : ReadingsOrigin
    now : datetime.datetime, optional
        The present time, UTC.

    Examples
    --------
    >>> origin_remarks(Provenance(simulated=False), ReadingsOrigin(simulated=True))
    ['the readings are simulated, but the calibration was made with a probe']
    """
    remarks = accepted_remarks(provenance, origin)
    if provenance.simulated is False and origin.simulated:
        remarks.append("the readings are simulated, but the calibration was made with a probe")
    remarks += _unknown_remarks(provenance, origin)
    if not provenance.simulated:
        remarks += _age_remarks(provenance, origin, now or present_time())
    return remarks


def provenance_document(provenance: Provenance, remarks: Iterable[str]) -> Json:
    """Return the part of a JSON document about the calibration that was used, without its files."""
    stated = provenance.as_dict()
    stated.pop("files", None)
    every = [missing_remark(provenance), *remarks]
    return {"provenance": stated, "remarks": list(dict.fromkeys(filter(None, every)))}


def _unknown_remarks(provenance: Provenance, origin: ReadingsOrigin) -> list[str]:
    """Return the remark on what the readings do not state, and the calibration does."""
    if origin.simulated:
        return []
    if origin.simulated is None and provenance.simulated:
        text = "the calibration was made from simulated touches, and the readings do not state"
        return [f"{text} whether a probe made them"]
    unknown = []
    if not origin.chip and provenance.chips:
        unknown.append("their chip")
    if origin.simulated is None and provenance.simulated is False:
        unknown.append("whether they are simulated")
    if not unknown:
        return []
    names = " and ".join(unknown)
    return [f"the readings do not state {names}: not compared with the calibration"]


def _age_remarks(provenance: Provenance, origin: ReadingsOrigin, now: datetime) -> list[str]:
    """Return the remark on an old calibration, or on a date that cannot be right."""
    made = provenance.made
    if made is None:
        return []
    date = f"{made:%Y-%m-%d}"
    if made > now + _DAY:
        text = f"the calibration is dated {date}, in the future: check the clock of the computer"
        return [text]
    at = origin.measured or now
    if abs(at - made) <= OLD:
        return []
    side = "before" if at > made else "after"
    text = f"the calibration is from {date}, more than a year {side} the readings"
    return [f"{text}: check it on a specimen of known modulus, or calibrate again"]
