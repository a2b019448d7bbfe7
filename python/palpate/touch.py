"""The result of one touch, as plain data."""

from dataclasses import asdict, dataclass, replace
from math import nan
from typing import Any

from palpate.flags import Flag
from palpate.number_format import plain


@dataclass(frozen=True, eq=False, repr=False)
class Touch:
    """The result of one touch; a Tracker, a Stream and `palpate.touches` make them.

    It is a plain dataclass: `dataclasses.asdict`, `dataclasses.replace`, pandas and polars take it.
    Two touches are equal if all of their values are, where nan equals nan.

    Attributes
    ----------
    start : int
        Number of the reading with which it began, counted from 0.
    start_s : float
        Time of that reading, s; nan without times.
    samples : int
        Number of samples used.
    ratio : float
        Capacitance ratio, hard / soft: the best that is known; see `revised`.
    covariance : float
        Unscaled covariance P of the ratio, 1/pF^2: a harder press gives a smaller one.
    standard_error : float
        Standard deviation of the ratio, including the error that a misfit leaves open; nan if it is
        not known.
    revised : bool
        Whether the baseline after the release is known, and `ratio` corrected for its drift (with
        the flag "creep" or "baseline": known, and not corrected).
    first_ratio : float
        The ratio that was known at the end of the touch.
    first_standard_error : float
        Standard deviation of `first_ratio`.
    level_ratio : float
        Ratio over the swept depth, the slope of a line with an intercept over rise, hold and (after
        the release) fall: a tilt of the probe does not change it; nan in other scenes, or if the
        press shows no sweep.
    level_standard_error : float
        Standard deviation of `level_ratio`.
    contact_exponent : float
        Exponent of force against depth with which `level_ratio` was computed; 0: there is none.
    depth_pF : float
        Change of the soft channel where the press had settled: how deep it was; nan in other
        scenes, or if the press has not settled.
    rise_s : float
        Seconds from the contact to the moment when the press had settled.
    age_s : float
        Seconds from the moment when the press had settled to the end of the touch, if it ends at an
        age; 0: it ends at its length.
    ratio_before : float
        With the flag "changed", if the change lasted: the ratio before it, and `ratio` is the one
        after it; else nan.
    before_standard_error : float
        Standard deviation of `ratio_before`.
    ratio_after : float
        With the flag "changed", if the change was shortly before the end: the ratio after it, from
        the last samples, and `ratio` is the one before it; else nan.
    after_standard_error : float
        Standard deviation of `ratio_after`.
    offset_ratio : float
        Ratio of hard = ratio * soft + offset, if the flag "offset" is the only misfit and explains
        it; else nan.
    offset_standard_error : float
        Standard deviation of `offset_ratio`.
    effects : dict of float
        Sizes of the effects that the model leaves out (empty in a scene without a fit): `offset`,
        the share of the mean depth by which the soft bump is reached first; `drift` during the
        touch, share of the mean output; `lag` of the soft channel, ms (nan without times); `curve`,
        share of the mean output; `tilt`, the ratio above the level ratio, share of it; `shift` of
        the ratio by the revision, share; with the flag "stiffens" only `stiffening`, the growth of
        the ratio from zero to full depth, share of that at zero depth.
    alarm_share : float
        Share of the samples with the alarm on.
    saturated : int
        Number of readings left out as saturated.
    refused : int
        Number of readings that gave no sample: without a value, or impossible to align.
    flags : tuple of Flag
        Warnings about the result, as `palpate.flags.Flag` lists them; `palpate.advice` explains
        them.
    held : bool
        Whether the probe was in contact for nearly the wanted length, even if few samples came in
        time (the flag "late").
    outliers : int
        Number of readings that were left out as outliers, of the channel with more of them; a
        missing reading leaves out the pairs beside it, too.

    Examples
    --------
    >>> import palpate
    >>> from palpate.simulation import scenarios
    >>> [touch] = palpate.touches(scenarios.run("not-level"))
    >>> touch.samples, round(touch.ratio, 2), "offset" in touch.flags
    (250, 2.79, True)
    >>> print(palpate.Uncertainty.of(touch))
    2.79 ± 0.10 (assumed)
    >>> [advice] = palpate.advice(touch)
    >>> print(advice)  # doctest: +ELLIPSIS
    offset: ... With this offset taken out, the ratio is 2.844 ± 0.085 (assumed)
    """

    start: int
    start_s: float
    samples: int
    ratio: float
    covariance: float
    standard_error: float
    revised: bool
    first_ratio: float
    first_standard_error: float
    level_ratio: float
    level_standard_error: float
    contact_exponent: float
    depth_pF: float
    rise_s: float
    age_s: float
    ratio_before: float
    before_standard_error: float
    ratio_after: float
    after_standard_error: float
    offset_ratio: float
    offset_standard_error: float
    effects: dict[str, float]
    alarm_share: float
    saturated: int
    refused: int
    flags: tuple[Flag, ...]
    held: bool
    outliers: int = 0

    def as_dict(self) -> dict[str, Any]:
        """Return the fields except `held` for JSON, with None in place of nan."""
        values = plain(asdict(self))
        values["effects"] = plain(self.effects)
        values["flags"] = tuple(flag.value for flag in self.flags)
        del values["held"]
        return values

    def without_times(self) -> "Touch":
        """Return the touch of a recording without times: its start and its lag are unknown."""
        effects = self.effects | {"lag": nan} if self.effects else {}
        return replace(self, start_s=nan, effects=effects)

    def __eq__(self, other: object) -> bool:
        """Return whether all values are equal, where nan equals nan."""
        if not isinstance(other, Touch):
            return NotImplemented
        return self.held == other.held and self.as_dict() == other.as_dict()

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        """Return its time, its ratio and its flags."""
        from palpate.display import text

        return text.touch_line(self)

    def _repr_html_(self) -> str:
        from palpate.display import cards

        return cards.touch_card(self)
