"""A running measurement: a thread reads the source, the consumer estimates, a file keeps what was read."""

from palpate.stream.estimate import Batch, Estimate, StreamCounters
from palpate.stream.stream import Stream

__all__ = ["Batch", "Estimate", "Stream", "StreamCounters"]
