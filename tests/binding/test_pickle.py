"""Pickles and copies: the state too, of subclasses too; and objects that were never initialised."""

import copy
import math
import pickle
import sys
import types
from typing import Any

import palpate
import pytest
from estimators import every


@every
def test_a_pickle_names_the_public_class(kind: Any) -> None:
    estimator = pickle.loads(pickle.dumps(kind(initial_ratio=2)))
    assert type(estimator) is kind is getattr(palpate, kind.__name__)
    assert kind.__module__ == "palpate"


@every
def test_an_estimator_that_was_not_initialised_says_so(kind: Any) -> None:
    class Forgetful(kind):  # type: ignore[misc]
        def __init__(self) -> None:
            pass

    class Early(kind):  # type: ignore[misc]
        def __init__(self) -> None:
            self.update(1.0, 2.0)

    with pytest.raises(TypeError, match="__init__"):
        Forgetful()
    with pytest.raises(TypeError, match="__init__"):
        Early()
    for use in (repr, pickle.dumps, lambda e: e.update(1.0, 1.0), lambda e: e.ratio, lambda e: e.process([1.0], [1.0])):
        with pytest.raises(TypeError, match="__init__"):
            use(kind.__new__(kind))


class Named(palpate.AdaptiveRls):
    """A subclass with something of its own."""

    def __init__(self, name: list[str], **settings: float) -> None:
        super().__init__(**settings)
        self.name = name


@pytest.mark.parametrize("protocol", range(pickle.HIGHEST_PROTOCOL + 1))
def test_a_subclass_survives_pickle_and_copy(protocol: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(
        sys.modules, Named.__module__, sys.modules.get(Named.__module__) or types.SimpleNamespace(Named=Named)
    )
    named = Named(["left"], drift=0.02)
    named.update(0.5, 0.25)
    for twin in (pickle.loads(pickle.dumps(named, protocol)), copy.copy(named), copy.deepcopy(named), named.copy()):
        assert type(twin) is Named
        assert twin == named
        assert twin.name == ["left"]
    assert copy.copy(named).name is named.name
    assert copy.deepcopy(named).name is not named.name
    named.update(1.0, 1.0)
    assert named != twin


@every
def test_a_pickle_with_an_impossible_state_is_refused(kind: Any) -> None:
    settings, state, own = kind().__getstate__()
    numbers = len(state) - 3  # then the innovation and the two counts
    impossible = [(k, value) for k in range(numbers) for value in (math.nan, math.inf)]
    for position, value in [*impossible, (1, 0.0), (1, -1.0)]:
        broken = (*state[:position], value, *state[position + 1 :])
        with pytest.raises(ValueError, match="pickled state: got"):
            kind.__new__(kind).__setstate__((settings, broken, own))
    with pytest.raises(ValueError, match="initial_covariance"):
        kind.__new__(kind).__setstate__(({**settings, "initial_covariance": -1.0}, state, own))
