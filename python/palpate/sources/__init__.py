"""Sources of samples: boards, the kernel's driver, serial ports, files, a simulated board."""

from palpate.recording.rows import Codes
from palpate.source_events import (
    Conditions,
    Gap,
    GapCause,
    SourceEvent,
    SourceItem,
    TroubleBegan,
    TroubleEnded,
    TroubleKind,
)
from palpate.sources.base import SampleSource, Source
from palpate.sources.devices import ListedDevice
from palpate.sources.registry import GROUP, open, schemes

__all__ = [
    "GROUP",
    "Codes",
    "Conditions",
    "Gap",
    "GapCause",
    "ListedDevice",
    "SampleSource",
    "Source",
    "SourceEvent",
    "SourceItem",
    "TroubleBegan",
    "TroubleEnded",
    "TroubleKind",
    "open",
    "schemes",
]
