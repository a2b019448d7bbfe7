"""Where samples come from: boards, the kernel's driver, serial lines, files, a simulated board."""

from palpate.sources.base import Source
from palpate.sources.uri import GROUP, open, schemes

__all__ = ["GROUP", "Source", "open", "schemes"]
