"""The drawing of the wiring: up to date, and readable as XML."""

import runpy
import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest
from palpate.figures.wiring import drawing
from project import ROOT


def test_the_drawing_on_the_page_is_what_the_command_makes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    target = tmp_path / "wiring.svg"
    monkeypatch.setattr(sys, "argv", ["wiring", str(target)])
    with pytest.warns(RuntimeWarning, match="found in sys.modules"):
        runpy.run_module("palpate.figures.wiring", run_name="__main__")
    kept = ROOT / "docs" / "images" / "wiring.svg"
    assert target.read_text(encoding="utf-8") == kept.read_text(encoding="utf-8") == drawing()


def test_it_names_the_pins_and_is_for_light_and_dark() -> None:
    tree = ElementTree.fromstring(drawing())
    texts = {element.text for element in tree.iter("{http://www.w3.org/2000/svg}text")}
    assert {"CIN1+", "CIN1-", "CIN2+", "CIN2-", "EXCA", "EXCB", "R1", "R2", "P5", "P6"} <= texts
    assert "prefers-color-scheme: dark" in drawing()
