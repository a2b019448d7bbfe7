"""Estimation of touches afterwards, with the whole recording known."""

from palpate.offline_touches.fit import OfflineTouch
from palpate.offline_touches.touches import offline

__all__ = ["OfflineTouch", "offline"]
