"""Each judgement of the tracker reaches the listeners once, in order of time."""

from collections.abc import Callable
from pathlib import Path

import pytest
from faulty_tables import at_the_lower_end, falling, healthy, jumped, saturated
from palpate import Judgement, Stream
from palpate.stream import Listener


class Judgements(Listener):
    """Keeps what it gets."""

    def __init__(self) -> None:
        self.all: list[Judgement] = []

    def judgement(self, judgement: Judgement) -> None:
        self.all.append(judgement)


@pytest.mark.parametrize("one_by_one", [False, True])
@pytest.mark.parametrize("made", [jumped, saturated, falling, at_the_lower_end, healthy])
def test_each_judgement_comes_once(
    made: Callable[[Path], Path], one_by_one: bool, tmp_path: Path
) -> None:
    listener = Judgements()
    with Stream(str(made(tmp_path)), notify=lambda _: None) as stream:
        stream.listen(listener)
        for _ in stream if one_by_one else stream.batches():
            pass
    assert listener.all == stream.tracker.judgements
    assert bool(listener.all) == (made is not healthy)


def test_what_the_end_shows_comes_with_a_last_batch(tmp_path: Path) -> None:
    """The last two readings wait for those after them; a batch without samples has no estimates."""
    path = at_the_lower_end(tmp_path)
    lines = path.read_text().splitlines(keepends=True)
    for rows in range(5, 25):
        path.write_text("".join(lines[: rows + 1]))
        listener = Judgements()
        with Stream(str(path), notify=lambda _: None) as stream:
            stream.listen(listener)
            assert sum(len(list(batch.estimates())) for batch in stream.batches()) == rows
        assert listener.all == stream.tracker.judgements
