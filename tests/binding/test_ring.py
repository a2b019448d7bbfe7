"""The ring against a deque, what it refuses, and two threads."""

import pickle
import threading
from collections import deque
from typing import Any

import numpy as np
import pytest
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule
from palpate import Sample, SampleRing, Status
from palpate.recording.rows import LARGEST_CODE, LARGEST_STATUS

FIELDS: Any = Sample(0, 0, 0, 0, 0, 0.0, 0.0, 0)


def samples(first: int, count: int) -> Any:
    rows = np.zeros(count, SampleRing().dtype)
    rows["seq"] = np.arange(first, first + count)
    rows["hard"] = rows["seq"] / 7
    rows["soft_raw"] = rows["seq"] % 2**24
    rows["status"] = rows["seq"] % 9
    return rows


class RingAndDeque(RuleBasedStateMachine):
    """Whatever is pushed and popped: what a deque of the same capacity does that drops the newest."""

    @initialize(capacity=st.sampled_from([2, 3, 4, 8, 13, 64]))
    def make(self, capacity: int) -> None:
        self.ring = SampleRing(capacity)
        self.model: deque[int] = deque()
        self.offered = self.accepted = 0
        self.first_dropped: int | None = None

    @precondition(lambda self: not self.ring.closed)
    @rule(count=st.integers(0, 40), one=st.booleans())
    def push(self, count: int, one: bool) -> None:
        count = 1 if one else count
        room = min(count, self.ring.capacity - len(self.model))
        rows = samples(self.offered, count)
        taken = self.ring.push(Sample(*rows.tolist()[0])) if one else self.ring.push_many(rows)
        assert taken == room
        self.model.extend(range(self.offered, self.offered + room))
        if room < count and self.first_dropped is None:
            self.first_dropped = self.accepted + room
        self.offered += count
        self.accepted += room

    @rule(count=st.integers(0, 40))
    def pop_many(self, count: int) -> None:
        # the rest stays untouched
        out = samples(-1000, count)
        expected = samples(-1000, count)
        number = min(count, len(self.model))
        for i in range(number):
            expected[i] = samples(self.model.popleft(), 1)[0]
        assert self.ring.pop_many(out) == number
        assert out.tobytes() == expected.tobytes()

    @rule()
    def close(self) -> None:
        self.ring.close()
        with pytest.raises(ValueError, match="after close"):
            self.ring.push_many(samples(0, 1))
        with pytest.raises(ValueError, match="after close"):
            self.ring.push(Sample(0, 0, 0, 0, 0, 0, 0))

    @invariant()
    def counts(self) -> None:
        if hasattr(self, "ring"):
            assert len(self.ring) == len(self.model)
            assert (self.ring.dropped, self.ring.first_dropped) == (
                self.offered - self.accepted,
                self.first_dropped,
            )


TestRingAndDeque: Any = RingAndDeque.TestCase


def test_two_threads_lose_nothing_that_is_not_counted() -> None:
    ring = SampleRing(256)
    total = 100_000
    out = np.empty(100, ring.dtype)
    seen = []

    def produce() -> None:
        for first in range(0, total, 50):
            ring.push_many(samples(first, 50))
        ring.close()

    thread = threading.Thread(target=produce)
    thread.start()
    while True:
        closed = ring.closed
        number = ring.pop_many(out)
        seen.append(out["seq"][:number].copy())
        if closed and not number:
            break
    thread.join()
    seqs = np.concatenate(seen)
    assert (np.diff(seqs) > 0).all()
    assert len(seqs) + ring.dropped == total


@pytest.mark.parametrize(
    ("call", "kind", "message"),
    [
        (lambda r: SampleRing(1), ValueError, "capacity: got 1, allowed: 2 <= capacity"),
        (lambda r: SampleRing("2"), TypeError, "capacity: got '2', allowed: a whole number"),  # type: ignore[arg-type]
        (
            lambda r: r.push((1, 2, 3)),
            ValueError,
            "sample: got 3 fields, allowed: the 9 of palpate.Sample",
        ),
        (
            lambda r: r.push(FIELDS._replace(soft_raw=-2)),
            ValueError,
            "soft_raw: got -2, allowed: an integer, -1 to",
        ),
        (
            lambda r: r.push(FIELDS._replace(t_soft_ns=-(2**63) - 1)),
            ValueError,
            "t_soft_ns: got -92233720368547758",
        ),
        (
            lambda r: r.push(FIELDS._replace(seq=True)),
            TypeError,
            "seq: got True, allowed: an integer",
        ),
        (
            lambda r: r.push(FIELDS._replace(hard="1")),
            TypeError,
            "hard: got '1', allowed: a real number, pF",
        ),
        (lambda r: pickle.dumps(r), TypeError, "cannot pickle .*SampleRing"),
        (lambda r: r.push(7), TypeError, "sample: got 7, allowed: a palpate.Sample"),
        (
            lambda r: r.push_many(np.zeros(3)),
            TypeError,
            "samples: got float64, allowed: .*SampleRing.dtype",
        ),
        (lambda r: r.push_many(samples(0, 4)[::2]), ValueError, "samples: got a strided"),
        (
            lambda r: r.pop_many(np.frombuffer(bytes(112), r.dtype)),
            ValueError,
            "out: got .*read-only",
        ),
    ],
)
def test_what_it_refuses(call: Any, kind: type[Exception], message: str) -> None:
    ring = SampleRing(4)
    with pytest.raises(kind, match=message):
        call(ring)
    assert (len(ring), ring.dropped) == (0, 0)


def test_a_row_has_plain_numbers_and_the_ranges_of_a_recording() -> None:
    ring = SampleRing(2)
    times = (np.int64(7), np.uint64(1), np.int32(2))
    values: tuple[Any, ...] = (*times, np.int8(3), -1, np.float32(1.5), np.int16(2), Status.LOST)
    numpys = Sample(*values)
    assert ring.row(numpys) == (7, 1, 2, 3, -1, 1.5, 2.0, 8, -1)
    assert [type(field) for field in ring.row(numpys)] == [int] * 5 + [float] * 2 + [int] * 2
    edges = FIELDS._replace(
        seq=2**63 - 1, t_hard_ns=-(2**63), hard_raw=LARGEST_CODE, status=LARGEST_STATUS
    )
    assert ring.push(edges)
    for field, beyond in [
        ("hard_raw", LARGEST_CODE + 1),
        ("status", LARGEST_STATUS + 1),
        ("t_uncertainty_us", 2**31),
    ]:
        with pytest.raises(ValueError, match=field):
            ring.row(edges._replace(**{field: beyond}))
    assert len(ring) == 1
