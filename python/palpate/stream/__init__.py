"""A running measurement: one thread reads the source and records, the caller's thread estimates.

In asynchronous code let a thread wait for each batch:

>>> import asyncio
>>> async def measure():
...     with Stream("sim:stiff-steady?seed=1") as stream:
...         batches = stream.batches()
...         while batch := await asyncio.to_thread(next, batches, None):
...             for touch in batch.touches:
...                 return touch.samples
>>> asyncio.run(measure())
208
"""

from palpate.stream.batches import Batch, Estimate
from palpate.stream.counters import StreamCounters
from palpate.stream.listeners import Listener
from palpate.stream.stream import Stream

__all__ = ["Batch", "Estimate", "Listener", "Stream", "StreamCounters"]
