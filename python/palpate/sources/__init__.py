"""Sources of samples: boards, the driver of the Linux kernel, serial ports, files, a simulated board."""

from palpate.recording.rows import Codes
from palpate.sources.base import Gap, Source
from palpate.sources.devices import Found
from palpate.sources.registry import GROUP, open, schemes

__all__ = ["GROUP", "Codes", "Found", "Gap", "Source", "open", "schemes"]
