"""Reference of the test of the model: the samples of a touch that it uses, which terms they can tell, and what they say.

The core sweeps sums of products; this solves the samples by their singular values.
"""

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def solved(columns: dict[str, Array], y: Array) -> tuple[dict[str, float], dict[str, float], float]:
    """Return coefficients of y = sum of coefficient times column by least squares, their variances, and the squared residuals."""
    # The variances are for noise of variance 1: the diagonal of (X' X)^-1.
    matrix = np.column_stack(list(columns.values()))
    # columns of size 1: so that no singular value is lost beside another's
    scale = np.sqrt((matrix**2).sum(axis=0))
    scale[scale == 0] = 1
    inverse = np.linalg.pinv(matrix / scale, rcond=1e-15) / scale[:, None]
    found = inverse @ y
    residuals = y - matrix @ found
    variances = (inverse**2).sum(axis=1)
    squares = float(residuals @ residuals)
    return (
        dict(zip(columns, found.tolist(), strict=True)),
        dict(zip(columns, variances.tolist(), strict=True)),
        squares,
    )


def rest(name: str, columns: dict[str, Array]) -> float:
    """Return the part of one column that the other columns do not explain: the sum of its squared residuals."""
    others = {other: values for other, values in columns.items() if other != name}
    return solved(others, columns[name])[2]


SIGNIFICANT = 8.0  # standard errors: from here on a term has a flag, and leaves all of it open
SUSPECT = 4.0  # standard errors: up to here it leaves nothing open
LEAST = 0.002  # share of the signal: smaller terms have no flag
LEAST_BENT = (
    0.005  # the same for an offset, a curve, a tilt and a change: gauges are bent, by .5 %/pF
)
LEAST_LAG = 0.08  # pairs
NOISE_GAIN = 0.42  # variance of an aligned pair for a reading's of 1
SLOPE_GAIN = 0.45  # the same of x' for a pair's
RELIABLE = 30.0  # variation of a term over the variation of its noise


@dataclass(frozen=True)
class Misfit:
    """What a touch says about the model.

    Attributes
    ----------
    offset, drift, curve : float
        Share of the mean output (offset: of the mean depth) that the term has.
    drift_error : float
        Standard error of the drift; 0: not known.
    lag : float, pairs
        Of the soft channel behind the hard one.
    open, open_drift : float
        Variance of the ratio that the terms leave open, without the drift and by the drift.
    offset_ratio, offset_error : float
        Of C1 = r C2 + c, where only the offset contradicts; otherwise nan.
    flags : frozenset of str

    Examples
    --------
    >>> Misfit().flags
    frozenset()
    """

    offset: float = 0.0
    drift: float = 0.0
    drift_error: float = 0.0
    lag: float = 0.0
    curve: float = 0.0
    open: float = 0.0
    open_drift: float = 0.0
    offset_ratio: float = np.nan
    offset_error: float = np.nan
    flags: frozenset[str] = frozenset()


def model(x: Array, time: Array, slope: Array, soft_noise: float) -> dict[str, Array]:
    """Return the columns of the largest model whose terms vary by more than noise could make them."""
    # Regressor, pF; number of the sample; half the difference of the neighbours of x. The models are
    # r x + d t; or r x + c + d t; or r x + c + d t + l x' + k (x / m - 1)^2.
    n = len(x)
    m = x.mean()
    columns = {"x": x, "one": np.ones(n), "time": time, "slope": slope, "square": x**2}
    line = {name: columns[name] for name in ("x", "one", "time")}
    noise = NOISE_GAIN * soft_noise**2
    floor = RELIABLE * n * noise
    spread = rest("x", line)
    # Of two pairs at least: one alone is a transient, which the filters do not match.
    if not (spread > floor and spread**2 > 2 * ((x - m) ** 4).sum()):
        return {name: columns[name] for name in ("x", "time")}
    # The variance of the noise of x^2, given x, is 4 (x - m)^2 noise + 2 noise^2. That of x is tested beside x^2, not
    # beside (x / m - 1)^2, so the depth has to vary by some per cent.
    least = {
        "x": floor,
        "slope": SLOPE_GAIN * floor,
        "square": (4 * spread / n + 2 * noise) * floor,
    }
    whole = all(rest(name, columns) > least[name] for name in least)
    return columns | {"square": (x / m - 1) ** 2} if whole else line


def tested(terms: dict[str, Array], hard_noise: float, soft_noise: float) -> Misfit:
    """Return what least squares say about samples with the terms of `Fit.terms`; noises of a reading in pF."""
    x = terms["x"]
    y = terms["y"]
    n = len(terms["x"])
    columns = model(x, terms["time"], terms["slope"], soft_noise)
    values, variances, squares = solved(columns, y)
    ratio = values["x"]
    mean = x.mean()

    def noise(squares: float, terms: int, ratio: float) -> tuple[float, float]:
        """Return the variance of a reading's noise, from the residuals, and from what the readings had in idle."""
        idle = hard_noise**2 + ratio**2 * soft_noise**2
        return max(squares / (n - terms) / NOISE_GAIN, idle), idle

    variance, _ = noise(squares, len(columns), ratio)
    scale = abs(ratio * mean)
    length = terms["time"][-1]
    sizes = {
        "lag": (values.get("slope", 0.0) / ratio, LEAST_LAG),
        "drift": (values["time"] * length / scale, LEAST),
        "offset": (-values.get("one", 0.0) / scale, LEAST_BENT),
        "curve": (values.get("square", 0.0) / scale, LEAST_BENT),
    }
    term = {"lag": "slope", "drift": "time", "offset": "one", "curve": "square"}
    errors = {
        name: abs(values[of]) / np.sqrt(variances[of] * variance) if of in columns else 0.0
        for name, of in term.items()
    }
    flags = {
        name
        for name, (size, least) in sizes.items()
        if errors[name] > SIGNIFICANT and abs(size) > least
    }

    def left_open(name: str) -> float:
        """Return the variance of the ratio: none up to 4 standard errors, all of the term from 8 on, at most the ratio."""
        part = np.clip((errors[name] ** 2 - SUSPECT**2) / (SIGNIFICANT**2 - SUSPECT**2), 0, 1)
        return float(part * (min(abs(sizes[name][0]), 1) * ratio) ** 2)

    # Where a channel lags, the transients of a press look like the other terms.
    opens = 0.0 if "lag" in flags else left_open("offset") + left_open("curve")
    offset_ratio = offset_error = np.nan
    if flags == {"offset"} and abs(sizes["offset"][0]) < 0.5:
        line, line_variances, alone_squares = solved({"x": x, "one": np.ones(n)}, y)
        alone, idle = noise(alone_squares, 2, line["x"])
        if alone < 2 * variance and alone < 16 * idle:
            offset_ratio = line["x"]
            offset_error = float(np.sqrt(line_variances["x"] * alone))
    return Misfit(
        **{name: float(size) for name, (size, _) in sizes.items()},
        drift_error=float(np.sqrt(variances["time"] * variance) * length / scale),
        open=opens,
        open_drift=left_open("drift") / 4,
        offset_ratio=offset_ratio,
        offset_error=offset_error,
        flags=frozenset(flags),
    )


FEWEST = 16  # samples with both neighbours
BEND = 0.1  # a regressor that bends by more than this share of itself is left out
LEAST_CURVED = 0.01  # share of the ratio: a smaller change together with the depth has no flag


@dataclass
class Fit:
    """The samples of a touch, tested at its end: reference of the fifth stage of the scene "handheld".

    Attributes
    ----------
    samples : list of (float, float, int)
        Output, regressor, and number of each sample since the last hand-over.
    before : (float, float, int) or None
        The last sample, also one before a hand-over.
    curved : float
        Largest change of the ratio together with the depth at a hand-over, share.

    Examples
    --------
    >>> fit, x = Fit(), 0.25 + 0.02 * np.sin(np.arange(60))
    >>> for number, regressor in enumerate(x):
    ...     fit.add(2.5 * (regressor - 0.005), regressor, number)
    >>> found = fit.result(4e-5, 4e-5, 2.5)
    >>> sorted(found.flags), round(found.offset, 2), round(found.offset_ratio, 2)
    (['offset'], 0.02, 2.5)
    """

    samples: list[tuple[float, float, int]] = field(default_factory=list)
    before: tuple[float, float, int] | None = None
    curved: float = 0.0

    def add(self, output: float, regressor: float, number: int) -> None:
        """Take a pair, pF, with its number."""
        self.before = (output, regressor, number)
        self.samples.append(self.before)

    def restart(self, change: float) -> None:
        """Forget the samples after a hand-over that changed the ratio by this share.

        If the depth has changed by a quarter or more, too, the cause may be a curve.
        """
        x = self.terms()["x"]
        if len(x) and self.before is not None:
            deeper = abs(self.before[1] - x.mean()) >= abs(x.mean()) / 4
            if deeper and abs(change) > abs(self.curved):
                self.curved = change
        self.samples = []

    def terms(self) -> dict[str, NDArray[np.float64]]:
        """Return x, y, time and slope of the samples with both neighbours, without those where x bends."""
        y, x, number = np.array(self.samples, float).reshape(-1, 3).T
        whole = (np.diff(number[:-1]) == 1) & (np.diff(number[1:]) == 1)
        whole &= np.abs(np.diff(x, 2)) < BEND * np.abs(x[1:-1])
        terms = {"x": x[1:-1], "y": y[1:-1], "time": number[1:-1], "slope": (x[2:] - x[:-2]) / 2}
        terms = {name: values[whole] for name, values in terms.items()}
        terms["time"] = terms["time"] - terms["time"][:1]
        return terms

    def length(self) -> float:
        """Return the readings from the first to the last sample of the test."""
        return float(self.terms()["time"][-1:].sum())

    def mean(self) -> tuple[float, float]:
        """Return the ratio of all samples alike and its standard error, if they scattered independently; nan: too few."""
        terms = self.terms()
        if len(terms["x"]) < FEWEST:
            return np.nan, np.nan
        values, variances, squares = solved({"x": terms["x"]}, terms["y"])
        return values["x"], float(np.sqrt(variances["x"] * squares / len(terms["x"])))

    def result(self, hard_noise: float, soft_noise: float, ratio: float) -> Misfit:
        """Test the model.

        Parameters
        ----------
        hard_noise, soft_noise : float, pF
            Standard deviations of a reading.
        ratio : float
            Of the estimator.

        Returns
        -------
        Misfit
        """
        terms = self.terms()
        found = Misfit()
        if len(terms["x"]) >= FEWEST and terms["x"].sum() > 0:
            found = tested(terms, hard_noise, soft_noise)
        if abs(self.curved) <= LEAST_CURVED:
            return found
        return replace(
            found,
            curve=self.curved,
            flags=found.flags | {"curve"},
            open=found.open + (self.curved * ratio) ** 2,
            offset_ratio=np.nan,
            offset_error=np.nan,
        )
