"""Recordings: written, read, verified, converted; palpate's own files and other loggers' tables."""

from palpate.recording.foreign import recorded
from palpate.recording.recording import Recording, read
from palpate.recording.verification import check

__all__ = ["Recording", "check", "read", "recorded"]
