"""What a report says of the results: in a sentence, by specimen, how repeatable, how uncertain, from which calibration."""

from collections.abc import Iterator, Mapping
from math import exp, isfinite, sqrt

from palpate import digits
from palpate.calibration.calibration import Calibration
from palpate.calibration.picture import Seen
from palpate.calibration.report import fitted
from palpate.display import page
from palpate.display.markup import NONE, Markup, element
from palpate.display.text import counted
from palpate.report.repeatability import Repeatability
from palpate.report.results import Result, Session, deviations
from palpate.several import TOUCH_SCATTER

_MOST_NAMED = 3  # specimens in the first sentence


def verdict(session: Session) -> Markup:
    """Return the result in a few sentences."""
    unknown = [result for result in session.results if result.known is None and result.modulus]
    named = [element("b", f"{one.name}: {_modulus(one)}. ") for one in unknown[:_MOST_NAMED]]
    more = [f"{counted(len(unknown) - _MOST_NAMED, 'more specimen')} below. "] if len(unknown) > _MOST_NAMED else []
    return element("p", *named, *more, " ".join(_sentences(session)), class_="verdict")


def _modulus(result: Result) -> str:
    modulus = result.modulus
    assert modulus is not None  # of those that have one
    value, bracket, interval = str(modulus).partition(" (")
    return f"{value} (95 %: {interval}" if bracket else value


def _sentences(session: Session) -> Iterator[str]:
    touches = session.touches
    kept = sum(one.kept for one in touches)
    if not touches:
        yield "No touch was found."
        return
    left = len(touches) - kept
    reasons = f"; {left} {'is' if left == 1 else 'are'} left out, with reasons" if left else ""
    yield f"{kept} of {counted(len(touches), 'touch')} {'is' if kept == 1 else 'are'} kept{reasons}."
    inside = [result.inside for result in session.results if result.inside is not None]
    if inside:
        yield f"{sum(inside)} of {len(inside)} known moduli {'is' if sum(inside) == 1 else 'are'} in the 95 % interval."
    if session.of_the_fit:
        yield (
            f"{session.of_the_fit} of these touches are data of the calibration itself: for them that is no independent test."
        )
    if session.calibration is None:
        yield "No calibration was given, so there are ratios, and no moduli."


def results(session: Session) -> Markup:
    """Return the table of the specimens."""
    columns = {"Specimen": "name", "Kept": "", "Left out": "", "Ratio": "", "±": "", "CV, %": ""}
    if session.calibration:
        columns |= {"MPa": "strong", "95 % interval": "n"}
    if any(result.known for result in session.results):
        columns |= {"Known": "", "Inside": "n"} if session.calibration else {"Known": ""}
    rows = [[_cells(result)[name] for name in columns] for result in session.results]
    differ = [f"{one.name}: {one.agreement}." for one in session.results if one.agreement and not one.agreement.agree]
    unnamed = sum(not one.specimen for one in session.touches)
    told = [f"{counted(unnamed, 'touch')} without a specimen: in the list of touches only."] if unnamed else []
    return page.section(
        "Results",
        page.table(columns, rows) if rows else element("p", "No touch is of a known specimen."),
        *(element("p", sentence, class_="bad") for sentence in [*differ, *told]),
        element("p", _MEAN, class_="quiet"),
    )


_MEAN = (
    "Ratio: the mean of the kept touches, weighted by their standard errors and the scatter from touch to touch, and not the "
    "touch with the smallest noise. ±: its standard error, with that scatter. CV: standard deviation of the logarithm of the "
    "ratio from touch to touch. Inside: whether the known modulus is in the interval; by chance one of 20 is not."
)


def _cells(result: Result) -> dict[str, object]:
    found, modulus = result.agreement, result.modulus
    error = found.standard_error if found else float("nan")
    value, _, interval = str(modulus).partition(" (") if modulus else (NONE, "", "")
    beyond = ", beyond the specimens" if modulus and modulus.extrapolated else ""
    return {
        "Specimen": element("b", result.name),
        "Kept": str(len(result.kept)),
        "Left out": str(len(result.touches) - len(result.kept) or NONE),
        "Ratio": digits.number(result.mean, error) if isfinite(result.mean) else NONE,
        "±": digits.error(error) if isfinite(result.mean) else NONE,
        "CV, %": digits.error(100 * result.variation) if isfinite(result.variation) else NONE,
        "MPa": value.removesuffix(" MPa") if interval else NONE,
        "95 % interval": (interval.rstrip(")") or (value if modulus else NONE)) + beyond,
        "Known": f"{result.known:g}" if result.known else NONE,
        "Inside": {True: "yes", False: "no", None: ""}[result.inside],
    }


def repeatability(session: Session) -> Markup:
    """Return the section on the scatter from touch to touch."""
    found = session.repeatability()
    if found is None or not found.within_freedom:
        return page.section("Repeatability", element("p", "No specimen has two kept touches: it is not known."))
    rows: list[tuple[str, str, str]] = [
        ("From touch to touch (CV)", f"{digits.error(100 * found.error)} %", _scatter(found)),
        ("Minimal detectable change", f"{digits.error(100 * found.detectable())} %", _detectable(found)),
        ("ICC(1,1)", *_correlation(found)),
        *_left_out(session),
    ]
    cells = [[element("b", name), element("b", value), told] for name, value, told in rows]
    return page.section("Repeatability", page.table({"": "n", " ": "n", "  ": "w"}, cells, kind="stack"))


def _scatter(found: Repeatability) -> str:
    return (
        "One touch differs from the mean of its specimen by this much: the standard deviation of the logarithm of the ratio "
        f"within specimens, with {found.within_freedom} degrees of freedom."
    )


def _detectable(found: Repeatability) -> str:
    """Return what the smallest change that is not by chance means."""
    usual = round(found.touches / found.specimens)
    means = f" Means of {usual} touches: {digits.error(100 * found.detectable(usual))} %." if usual > 1 else ""
    return (
        f"1.96 √2 CV: two single touches whose ratios differ by less than a factor of {exp(found.detectable()):.3f} may be of "
        f"one object.{means}"
    )


def _correlation(found: Repeatability) -> tuple[str, str]:
    """Return ICC(1,1), and what is said of it."""
    why = (
        "Share of the variance of the logarithm of the ratio that lies between specimens. One-way random effects: no touch of "
        "one specimen belongs to a touch of another."
    )
    if not isfinite(found.icc):
        return NONE, f"{why} It needs two specimens whose touches are not all the same."
    about = (
        "" if found.per_specimen == found.touches / found.specimens else " (about, as the numbers of touches differ)"
    )
    value, low, high = digits.between(found.icc, found.low, found.high)
    return value, f"95 % interval {low} to {high}{about}; {found.specimens} specimens. {why} {_RANGE}"


_RANGE = "It depends on how far apart the specimens are: compare it only between sessions on the same ones."


def _left_out(session: Session) -> Iterator[tuple[str, str, str]]:
    left, every = sum(not one.kept for one in session.touches), session.repeatability(all_touches=True)
    if left and every and every.within_freedom:
        told = f"With all touches that have a ratio the CV is {digits.error(100 * every.error)} %."
        yield "Left out", f"{left} of {len(session.touches)}", told


def uncertainty(session: Session) -> Markup:
    """Return what the uncertainty consists of, and what is not in it."""
    told = _with(session, session.calibration) if session.calibration else _without(session)
    return page.section("Uncertainty, in words", *told, element("p", _NOT_IN_IT))


_NOT_IN_IT = (
    "It does not contain: a baseline that drifts during a touch, unless the touch has a flag for it; objects that are thin, "
    "layered, or not much larger than the bumps; and the error of the moduli of the specimens of the calibration, for which no "
    "value is known."
)
_NAMES: Mapping[str, str] = {"touch": "Holding", "specimen": "Specimens", "curve": "Curve", "noise": "Noise"}


def _with(session: Session, calibration: Calibration) -> Iterator[Markup]:
    freedom = calibration.fitted.touch_freedom
    yield element(
        "p",
        "The interval of a modulus is where it lies in 95 of 100 such sessions. It is found from that of the ratio through the "
        "curve, so it is not symmetric. The parts below are standard deviations of the mean ratio, in % of it. Holding, how the "
        f"probe is held: {digits.error(100 * calibration.touch_spread)} % a touch, by the calibration "
        f"({counted(freedom, 'degree')} of freedom), divided by the square root of the number of touches; more touches reduce it. "
        "Specimens: their scatter around the curve beyond that. Curve: the error of the fit. Noise: that of the converter, the "
        "only part that longer touches reduce.",
    )  # fmt: skip
    rows = []
    for result in session.results:
        if result.parts and result.agreement:
            shares = deviations(result.parts, result.mean)
            whole = sqrt(sum(share**2 for share in shares.values()))
            rows.append([element("b", result.name), *(digits.error(100 * shares[name]) for name in _NAMES), digits.error(100 * whole)])  # fmt: skip
    if rows:
        yield page.table({"Specimen": "name", **dict.fromkeys(_NAMES.values(), ""), "Together": ""}, rows)


def _without(session: Session) -> Iterator[Markup]:
    yield element(
        "p",
        "The uncertainty of a mean ratio is a standard error. Its parts are the noise of the converter, and how the probe is held: "
        f"{digits.error(100 * TOUCH_SCATTER)} % a touch, which is assumed, as no calibration says it, divided by the square root "
        "of the number of touches. The CV under Repeatability is what this session itself shows.",
    )


def calibration(session: Session) -> Markup:
    """Return the section on the calibration; empty without one."""
    if session.calibration is None:
        return Markup("")
    seen = [
        Seen(one.name, one.modulus.value, one.modulus.low, one.modulus.high, one.mean)
        for one in session.results
        if one.modulus and isfinite(one.modulus.value) and one.known is None
    ]
    about = ", ".join(f"{key}: {value}" for key, value in session.calibration.about.items())
    return Markup(
        "\n".join(
            [
                fitted(session.calibration, seen),
                element(
                    "p", f"{session.calibration.verdict} Fitted by palpate {session.calibration.version}; {about}."
                ),
            ]
        )
    )
