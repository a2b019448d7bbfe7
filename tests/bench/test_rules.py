"""The bench of rules: it finds a rule that is needed and a planted one that is not, and compares rows as it says."""

import math

import numpy as np
import pytest
from palpate.reference import adaptive

from bench.accuracy import rules
from bench.accuracy.rule_list import RULES, Replacement, Rule, follow, without
from bench.accuracy.rule_rows import WORLDS, Kind, World
from bench.accuracy.rules import Row, Verdict, loss, measured, number, verdict_of
from bench.accuracy.signal_worlds import steady

USELESS = Rule("EARLY", "as it is", (Replacement(adaptive, "EARLY", adaptive.EARLY),))


def world(name: str) -> World:
    [found] = [one for one in WORLDS if one.name == name]
    return found


def judged(rule: Rule, name: str) -> Verdict:
    """Judge a rule by one run of a world."""
    worlds = [world(name)]
    return verdict_of(rule, measured(rules.NONE, 1, worlds), measured(rule, 1, worlds))


def test_a_needed_rule_has_rows_and_a_useless_one_has_none() -> None:
    """Least squares: noise of .2 in a regressor of 1 is a bias of .04 / 1.04 of the ratio.

    The mean regressor has only the error of a mean of 100 to 200 of them, .2 / sqrt(150) of the ratio.
    """
    [instrument] = [rule for rule in RULES if rule.name == "instrument"]
    found = judged(instrument, "noise in x")
    texts = [change.text for change in found.worse]
    [factor] = [text.split(" x ")[1] for text in texts if text.startswith("noise in x: error")]
    assert float(factor) > (0.04 / 1.04) / (0.2 / math.sqrt(150))
    assert f"{instrument.name:18} {instrument.phrase:48} {'; '.join(texts)}" in str(found)
    assert str(judged(USELESS, "noise in x")).endswith(" nothing; no run changes")


def test_a_rule_is_left_out_only_for_a_while() -> None:
    usual = follow(steady(1, 60))
    for rule in RULES:
        with without(rule):
            follow(steady(1, 20), rule.limits)
    assert np.array_equal(follow(steady(1, 60)).ratio, usual.ratio)
    assert len({rule.name for rule in RULES}) == len(RULES)


def test_faster_sums_are_the_same() -> None:
    signals = world("slide").make(2)
    usual = follow(signals)
    with without(rules.NONE):
        found = follow(signals)
    assert np.array_equal(found.ratio, usual.ratio)
    assert np.array_equal(found.error, usual.error, equal_nan=True)


def test_a_name_that_the_reference_does_not_have_is_an_error() -> None:
    unknown = Rule("rule", "phrase", (Replacement(adaptive, "NO_SUCH_NAME", 1),))
    with pytest.raises(AttributeError, match="NO_SUCH_NAME"), without(unknown):
        pass


def test_the_settings_are_those_of_the_core(monkeypatch: pytest.MonkeyPatch) -> None:
    rules.check_reference()
    monkeypatch.setattr(adaptive, "NORMAL", 0.0)
    rules.check_reference()  # ratios do not have it
    monkeypatch.setattr(adaptive, "WARM_UP", 0)
    with pytest.raises(RuntimeError, match="the reference is"):
        rules.check_reference()


@pytest.mark.parametrize(
    ("kind", "before", "after", "expected"),
    [
        (Kind.RMS, 2.0, 2.5, 0.25),
        (Kind.RMS, 2.0, math.inf, math.inf),
        (Kind.MEDIAN, 0.0, 0.0, 0.0),
        (Kind.RATE, 0.0, 1.0, math.inf),
        (Kind.SHARE, 0.1, 0.4, 0.3),
        (Kind.COVERAGE, 0.99, 0.85, 0.1),
        (Kind.COVERAGE, 0.96, 1.0, 0.0),
    ],
)
def test_a_row_is_worse_by(kind: Kind, before: float, after: float, expected: float) -> None:
    assert loss(kind, before, after) == pytest.approx(expected)


def test_the_number_of_runs_is_that_of_its_kind() -> None:
    values = np.array([3.0, 4.0, 11.0])
    assert number(Kind.RMS, values) == pytest.approx(math.sqrt(146 / 3))
    assert number(Kind.MEDIAN, values) == 4
    assert number(Kind.RATE, values) == 6
    assert number(Kind.RMS, np.array([1.0, math.nan])) == math.inf


def test_what_one_run_of_many_changes_may_be_chance() -> None:
    usual = Row("row", Kind.MEDIAN, np.ones(20))
    one = Row("row", Kind.RATE, np.append(np.ones(19), 4.0))
    each = Row("row", Kind.RATE, np.full(20, 1.2))
    rate = Row("row", Kind.RATE, usual.values)
    # mean 1.15, but 36 % of the draws do not have the run
    assert verdict_of(USELESS, [rate], [one]).perhaps[0].text == "row 1 -> 1.1"
    found = verdict_of(USELESS, [rate], [each])
    assert [change.text for change in found.worse] == ["row 1 -> 1.2"]
    assert [change.text for change in verdict_of(USELESS, [each], [rate]).better]


def test_bad_seeds_are_refused(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.argv", ["rules", "--seeds", "0"])
    with pytest.raises(SystemExit, match="2"):
        rules.main()
    assert "--seeds is 0; give 1 or more" in capsys.readouterr().err
