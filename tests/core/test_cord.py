"""Real recordings: a braided capacitive cord, pinched at three places."""

from pathlib import Path

import numpy as np
import palpate


def test_three_places_of_a_cord_are_told_apart(recordings: Path) -> None:
    quartiles = {}
    for gesture in ("h", "l", "m"):
        ratios = []
        for number in range(1, 16):
            recording = palpate.read(recordings / "cord" / f"{gesture}{number}.csv", columns={"soft": 4, "hard": 8})
            [touch] = palpate.touches(recording)
            ratios.append(touch.ratio)
        quartiles[gesture] = np.percentile(ratios, [25, 50, 75])
    assert quartiles["h"][0] > quartiles["l"][2] > quartiles["l"][0] > quartiles["m"][2]
    # The slope of hard over soft within the contact is about 1.13, 0.91 and 0.18.
    assert [q[1] for q in quartiles.values()] == [
        *np.clip([q[1] for q in quartiles.values()], [1.07, 0.85, 0.16], [1.20, 1.02, 0.20])
    ]


def test_fixed_capacitors_are_no_touch(recordings: Path) -> None:
    path = recordings / "static" / "test_two_channel.csv"
    recording = palpate.read(path, columns={"hard": "A chanel", "soft": "B channel", "time": "timeA"}, unit="fF")
    assert palpate.touches(recording) == []
    # After the start-up zeros, the two capacitors' ratio is known.
    settled = recording.hard[100:] / recording.soft[100:]
    assert np.median(settled) == np.clip(np.median(settled), 1.0204, 1.0207)
