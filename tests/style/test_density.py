"""No room becomes denser than tests/style/limits.csv allows, but for a small headroom."""

import density

DENSE = '''"""A docstring does not count."""
from typing import Any
a, b = 1, 2  # one pair
c: dict[str, Any] = {name: 1 for name in "ab"}
if (d := a) and getattr(a, "real") and getattr(a, str(b)) and vars(c):
    e = f"{a} and {b}" if d else None
'''


def test_each_room_keeps_its_limits() -> None:
    limits = density.read_limits()
    rooms = density.rooms()
    too_dense = {}
    for room, counts in rooms.items():
        limit = limits.get(room, density.Density())
        texts = density.exceeded(density.density_of(counts), limit)
        if texts:
            too_dense[room] = texts
    assert too_dense == {}
    assert limits.keys() <= rooms.keys()


def test_the_counter_counts() -> None:
    counts = density.count(DENSE + f"long = '{'x' * 100}'\n")
    assert counts == density.Counts(
        files=1,
        tokens=4 + 7 + 19 + 28 + 7 + 3,
        lines=6,
        if_else=1,
        comprehensions=1,
        packed=1,
        walrus=1,
        wide=1,
        any_dicts=1,
        computed_names=2,
    )


def test_what_is_too_much_is_named() -> None:
    dense = density.density_of(density.count(DENSE))
    assert density.exceeded(dense, dense) == []
    assert "walrus: 200, at most 3" in density.exceeded(dense, density.Density())
