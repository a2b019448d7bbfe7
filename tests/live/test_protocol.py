"""The messages to a page: what JSON cannot have, numbers of numpy, and the types for its JavaScript."""

import json
import math

import numpy as np
import page_types
import pytest
from palpate.differences import Cause
from palpate.live.protocol import (
    DeviceMessage,
    DoneMessage,
    RatioState,
    ReadLine,
    ShownFlag,
    encode,
)


def test_what_json_does_not_have_is_null() -> None:
    message = DeviceMessage([], {}, can_centre=True)
    for value in (math.nan, math.inf, -math.inf, np.float64("nan")):
        message.options = {"capf": value}  # type: ignore[dict-item]
        assert json.loads(encode(message))["options"] == {"capf": None}


def test_numbers_of_numpy_are_numbers() -> None:
    for value, expected in ((np.float64(0.1), 0.1), (np.int32(3), 3), (np.bool_(True), True)):
        message = DoneMessage("cut", "", id=value)  # type: ignore[arg-type]
        assert json.loads(encode(message))["id"] is expected or expected == 0.1
    assert json.loads(encode(DoneMessage("cut", Cause.TILT)))["message"] == "tilt"


def test_what_is_not_set_is_left_out() -> None:
    done = DoneMessage("read list", "", lines=[None, ReadLine(0.1, None), ReadLine(wrong="x")])
    assert json.loads(encode(done)) == {
        "type": "done",
        "do": "read list",
        "message": "",
        "lines": [None, {"modulus": 0.1, "uncertainty": None}, {"wrong": "x"}],
    }


def test_something_else_is_an_error() -> None:
    with pytest.raises(NotImplementedError, match="message: got object"):
        encode(DoneMessage("cut", object()))  # type: ignore[arg-type]


def test_the_types_of_the_page_are_those_of_the_messages() -> None:
    """If not: python tests/tools/page_types.py."""
    assert page_types.TYPES.read_text(encoding="utf-8") == page_types.types_text()


def test_a_number_that_may_be_missing_says_so() -> None:
    text = page_types.declaration(RatioState)
    assert "  ratio: number | null;" in text
    assert "  state: string;" in text
    assert "  t_s: number;" in page_types.declaration(ShownFlag)
