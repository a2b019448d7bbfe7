"""Sources of samples: boards, the driver of the Linux kernel, serial ports, files, a simulated board."""

from palpate.sources.base import Gap, Source
from palpate.sources.uri import GROUP, open, schemes

__all__ = ["GROUP", "Gap", "Source", "open", "schemes"]
