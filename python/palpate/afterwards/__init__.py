"""Estimation of touches afterwards, with the whole recording known."""

from palpate.afterwards.touches import OfflineTouch, offline

__all__ = ["OfflineTouch", "offline"]
