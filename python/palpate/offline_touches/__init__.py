"""Estimation of touches afterwards, with the whole recording known."""

from palpate.offline_touches.touches import OfflineTouch, offline

__all__ = ["OfflineTouch", "offline"]
