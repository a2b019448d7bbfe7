"""Write, read, check and convert recordings: palpate's own files, and tables of other loggers."""

from palpate.recording.reading import read, recorded
from palpate.recording.recording import Recording
from palpate.recording.verification import check

__all__ = ["Recording", "check", "read", "recorded"]
