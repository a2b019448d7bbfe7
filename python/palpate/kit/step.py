"""One step of the acceptance: what was measured, what is expected, and what to do."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from palpate.errors import shortened

OK, WRONG, NOT_DONE = "ok", "wrong", "not done"
LONGEST = 2000
"""Characters of a text in a step, at most."""
VERDICTS = (OK, WRONG, NOT_DONE)
_MARKS = {OK: "ok", WRONG: "!!", NOT_DONE: "--"}

Value = bool | int | float | str | None


@dataclass(frozen=True)
class Step:
    """One step.

    Attributes
    ----------
    name : str
        What is measured.
    verdict : str
        One of `VERDICTS`.
    measured, expected : str
        For a person, with units.
    do : tuple of str
        What to do if it is wrong.
    values : mapping
        The numbers behind `measured`, with the unit in the name.
    """

    name: str
    verdict: str
    measured: str
    expected: str = ""
    do: tuple[str, ...] = ()
    values: Mapping[str, Value] = field(default_factory=dict)

    def lines(self) -> list[str]:
        r"""Return the step as lines of text.

        Examples
        --------
        >>> print("\n".join(Step("supply", "wrong", "2.1 V", "2.7 to 5.25 V", ("check the cable",)).lines()))
        !!  supply: 2.1 V (expected: 2.7 to 5.25 V)
              check the cable
        """
        expected = f" (expected: {self.expected})" if self.expected and self.verdict != NOT_DONE else ""
        return [f"{_MARKS[self.verdict]}  {self.name}: {self.measured}{expected}", *(f"      {do}" for do in self.do)]


def judged(
    name: str,
    measured: str,
    expected: str,
    *,
    right: bool,
    do: Iterable[str] = (),
    values: Mapping[str, Value] | None = None,
) -> Step:
    """Return a step that was done; `do` is kept only if it is not right."""
    return Step(name, OK if right else WRONG, measured, expected, () if right else tuple(do), values or {})


def one_line(error: Exception) -> str:
    r"""Return the message of an error as a step shows it.

    Examples
    --------
    >>> one_line(OSError("no permission:\n  type this"))
    'no permission: type this'
    """
    return shortened(" ".join(str(error).split()), LONGEST // 2)


def left_out(name: str, why: str) -> Step:
    """Return a step that was not done."""
    return Step(name, NOT_DONE, why)


def summary(steps: Iterable[Step]) -> str:
    """Return how many steps have each verdict.

    Examples
    --------
    >>> summary([Step("supply", OK, "3.3 V"), left_out("press", "skipped")])
    '1 ok, 0 wrong, 1 not done'
    """
    found = [step.verdict for step in steps]
    return ", ".join(f"{found.count(verdict)} {verdict}" for verdict in VERDICTS)
