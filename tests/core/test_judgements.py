"""The sentences of judgements, and what is left out of them."""

import math

import palpate
import pytest
from palpate import Judgement
from palpate.judgements import MOST_ALIKE, judgement_notes, without_repeats


@pytest.mark.parametrize(
    ("judgement", "timed", "untimed"),
    [
        (
            Judgement(9.94, "hard", "jumped", 3.12),
            "the hard channel jumped by +3.1 pF at 9.9 s",
            "the hard channel jumped by +3.1 pF",
        ),
        (
            Judgement(2.0, "both", "jumped", 0.5, -0.25),
            "both channels jumped, by +0.5 and -0.25 pF, at 2.0 s",
            "both channels jumped, by +0.5 and -0.25 pF",
        ),
        (
            Judgement(2.0, "soft", "step", 0.25),
            "the soft channel stepped by +0.25 pF at 2.00 s, within a press",
            "the soft channel stepped by +0.25 pF, within a press",
        ),
        (
            Judgement(0.6, "soft", "saturated", 4.096),
            (
                "the soft channel is at the end of its range, 4.096 pF, from 0.6 s on: no CAPDAC, "
                "or one that is too small"
            ),
            (
                "the soft channel is at the end of its range, 4.096 pF: no CAPDAC, "
                "or one that is too small"
            ),
        ),
        (
            Judgement(0.4, "hard", "frozen", 0.0),
            (
                "the hard channel is exactly 0 from 0.4 s on: nothing is connected, no excitation, "
                "or a CAPDAC that is too large"
            ),
            (
                "the hard channel is exactly 0: nothing is connected, no excitation, "
                "or a CAPDAC that is too large"
            ),
        ),
    ],
)
def test_a_recording_without_times_has_none_in_its_sentences(
    judgement: Judgement, timed: str, untimed: str
) -> None:
    assert judgement.text == timed
    assert judgement.without_time().text == untimed
    assert judgement.without_time().as_dict()["time_s"] is None
    assert judgement.as_dict() == {**judgement._asdict(), "text": timed}


def test_what_falls_with_the_option_rises() -> None:
    assert "both channels fall when pressed" in Judgement(1.0, "both", "falling", -0.5, -0.2).text
    assert "leave it out" in Judgement(1.0, "both", "falling", 0.5, 0.2).text


def test_an_end_of_the_range_is_said_once() -> None:
    """Not again while the channel trembles there, nor that it is frozen; but in the next press."""
    first = Judgement(3.4, "hard", "saturated", 4.096)
    again = first._replace(time_s=3.5)
    frozen = Judgement(3.6, "hard", "frozen", 4.096)
    other = frozen._replace(channel="soft")
    later = first._replace(time_s=12.4)
    assert list(without_repeats([first, again, frozen, other, later])) == [first, other, later]


@pytest.mark.parametrize(("more", "text"), [(1, "once more"), (4, "4 times more")])
def test_many_alike_are_counted(more: int, text: str) -> None:
    jumps = [Judgement(10.0 * at, "hard", "jumped", 1.0) for at in range(MOST_ALIKE + more)]
    notes = list(judgement_notes(jumps))
    assert notes[:-1] == [jump.text for jump in jumps[:MOST_ALIKE]]
    assert notes[-1] == f"the hard channel: jumped {text}"


def test_touches_have_them_in_their_notes() -> None:
    """Without times in a recording that has none."""
    jump = [2.0] * 200 + [5.0] * 200
    still = [1.0] * 400
    hard = [value + 1e-5 * ((at * 7919) % 13) for at, value in enumerate(jump)]
    soft = [value + 1e-5 * ((at * 104729) % 11) for at, value in enumerate(still)]
    notes = palpate.touches(hard, soft, rate_hz=40).notes
    [judged] = [note for note in notes if "jumped by" in note]
    assert judged == "the hard channel jumped by +3 pF at 5.0 s"
    assert math.isnan(Judgement(5.0, "hard", "jumped", 3.0).without_time().time_s)
