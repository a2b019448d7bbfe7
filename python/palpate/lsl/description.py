"""The three streams of a measurement, with their descriptions."""

import socket
from collections.abc import Mapping, Sequence
from typing import Any

from palpate import __version__
from palpate.sources.lsl.library import MANUFACTURER, SAMPLES

ESTIMATES = ("ratio", "standard_error", "contact", "touch", "alarm")
"""Labels of the channels of the stream of estimates."""
_UNITS = {"hard_pF": "pF", "soft_pF": "pF", "soft_offset_s": "s"}
_TYPES = {"hard_pF": "Capacitance", "soft_pF": "Capacitance", "soft_offset_s": "Time", "ratio": "Ratio",
          "standard_error": "Ratio"}  # fmt: skip
_ACQUISITION = ("period_s", "full_scale_pF")


def samples_info(pylsl: Any, name: str, device: Mapping[str, Any]) -> Any:
    """Return the stream of samples; `device` is the description of the source."""
    return _info(pylsl, name, "Capacitance", SAMPLES, device)


def estimates_info(pylsl: Any, name: str, device: Mapping[str, Any]) -> Any:
    """Return the stream of estimates."""
    return _info(pylsl, f"{name}-estimates", "Estimate", ESTIMATES, device)


def marks_info(pylsl: Any, name: str, device: Mapping[str, Any]) -> Any:
    """Return the stream of marks."""
    return _info(pylsl, f"{name}-marks", "Markers", ("mark",), device)


def _info(pylsl: Any, name: str, kind: str, labels: Sequence[str], device: Mapping[str, Any]) -> Any:
    """Return a stream without a rate: each sample has its own stamp, and a lost one is not smoothed over.

    Its source_id stays the same when palpate is started again, so that receivers continue.
    """
    form = pylsl.cf_string if kind == "Markers" else pylsl.cf_double64
    identity = f"{MANUFACTURER} {name} {socket.gethostname()}"
    info = pylsl.StreamInfo(name, kind, len(labels), pylsl.IRREGULAR_RATE, form, identity)
    about = info.desc()
    about.append_child_value("manufacturer", MANUFACTURER)
    channels = about.append_child("channels")
    for label in labels:
        channel = channels.append_child("channel")
        said = {"label": label, "unit": _UNITS.get(label, "none"), "type": _TYPES.get(label, "Misc")}
        for key, value in said.items():
            channel.append_child_value(key, value)
    acquisition = about.append_child("acquisition")
    acquisition.append_child_value("version", __version__)
    acquisition.append_child_value("instrument", str(device.get("name") or device.get("converter") or ""))
    acquisition.append_child_value("stamps", str(device.get("stamps", "converter")))
    for key in _ACQUISITION:
        if key in device:
            acquisition.append_child_value(key, str(device[key]))
    return info
