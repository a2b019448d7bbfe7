"""The gate against its reference: the same decisions, at every value, also where one lies on a limit."""

from collections import Counter

import numpy as np
from driving import drive
from effort import examples
from hypothesis import given
from hypothesis import strategies as st
from palpate.reference import Contact
from tally import Tally

CONTACT, IDLE, AGE, FELL, SUSPECTS = range(5)
Row = tuple[float, float, float, bool]

heights = st.sampled_from(
    [0.0, 1.2, 1.5, 2.0, 2.5, 6.0, 7.5, 10.5, 20.5, 50.0, 100.0, 1e9, -1.5, -3.0, -1e9]
) | st.floats(-100, 100)
parts = st.tuples(st.integers(1, 40), heights, st.sampled_from([0.0, 0.0, 1.0]), st.booleans())


@st.composite
def courses(draw: st.DrawFn) -> list[Row]:
    """Draw (change, noise, seconds waited, wish to be between baselines): plateaus on limits, noise, long waits."""
    random = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    noise = draw(st.sampled_from([1.0, 1.0, 1.0, 4e-5, 1e-9, 1e9, 0.0]))
    rows: list[Row] = []
    for count, height, spread, between in draw(st.lists(parts, min_size=1, max_size=12)):
        waited = draw(st.sampled_from([0.0, 0.0, 29.9, 30.0, 1e3]))
        changes = (noise or 1.0) * (height + spread * random.standard_normal(count))
        rows += [(change, noise, waited, between) for change in changes.tolist()]
    return rows


def decided(course: list[Row]) -> tuple[list[list[float]], list[list[float]], Counter[str]]:
    """Return the rows for the driver, what the reference makes of them, and how often it was in each state."""
    gate, given_, right, seen = Contact(), [], [], Counter[str]()
    for change, noise, waited, wished in course:
        between = wished and gate.state == "idle"
        given_.append([change, noise, waited, between])
        gate.update_between(change, noise) if between else gate.update(change, noise, waited)
        row = [gate.state == "contact", gate.state == "idle", gate.age, gate.fell, gate.suspects]
        right.append([float(value) for value in row])
        seen[gate.state] += 1
        seen["fell"] += gate.fell
        seen["between"] += between and gate.state == "contact"
    return given_, right, seen


@examples(200, 4000)
@given(courses())
def test_the_core_is_the_reference(tally: Tally, course: list[Row]) -> None:
    """Every operation is the same single rounding in both, so no decision may differ."""
    tally.count("courses against the reference of the gate")
    given_, right, _ = decided(course)
    found = drive("contact", given_, 5)
    assert found[:, [CONTACT, IDLE, FELL, SUSPECTS]].tolist() == np.delete(np.array(right, float), AGE, 1).tolist()
    dated = found[:, CONTACT] == 1  # in other states the age is not the start of a touch
    assert found[dated, AGE].tolist() == np.array(right, float)[dated, AGE].tolist()


def test_the_examples_reach_every_state() -> None:
    press = [(0.0, 1.0, 0.0, False)] * 5 + [(100.0, 1.0, 0.0, False)] * 9 + [(30.0, 1.0, 0.0, False)] * 5
    released = decided(press)[2]
    assert released["contact"] == 5 + 1 + 2
    assert released["released"] == 3
    over = [*press, *[(0.0, 1.0, 0.0, False)] * 5]
    assert decided([*over, *[(25.0, 1.0, 0.0, True)] * 5])[2]["between"] == 1
    assert decided([*over, *[(-9.0, 1.0, 0.0, False)] * 12])[2]["fell"] > 0
    assert decided([*press, (30.0, 1.0, 30.0, False)])[2]["idle"] == 5 + 3 + 1
