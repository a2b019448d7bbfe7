"""The device on the page: what it says, and that nothing changes a measurement without a mark in the recording."""

import json
import re
import time
from pathlib import Path
from typing import Any

import palpate
import pytest
from live_fed import begun, fed, noisy, waited
from live_played import Played
from palpate.live.desk.device import Device
from palpate.live.protocol import Command, Refused
from palpate.live.workbench import Workbench

SOURCE = "sim:four-specimens?seed=1&idle=60"


def device(bench: Workbench) -> dict[str, Any]:
    return bench.told["device"]()


def values(document: dict[str, Any]) -> dict[str, str]:
    return {fact["name"]: fact["value"] for fact in document["facts"]}


def sidecar(path: Path) -> dict[str, Any]:
    return dict(json.loads(path.with_suffix(".json").read_text()))


def test_what_a_board_is(tmp_path: Path) -> None:
    session, bench = begun(SOURCE, tmp_path)
    waited(bench, "Touch")
    time.sleep(2.5)
    document = device(bench)
    session.close()
    assert document["board"] == "AD7746 evaluation kit, USB 1/2"
    found = values(document)
    assert found["Excitation"] == "EXCB, ±VDD/2"
    assert found["Conversion"] == "CAPF 0, 11.0 ms"
    assert found["Temperature"].startswith("25.0 °C")
    assert found["Supply"] == "3.30 V"
    assert found["Hard, CIN1"].endswith("% of range")
    assert re.fullmatch(r"(-|\d+\.\d) of \d+\.\d", found["Pairs a second"])
    assert document["options"]["capf"]["value"] == 0
    assert document["options"]["capf"]["allowed"] == list(range(8))
    assert document["can_centre"] is True


def test_a_source_without_settings(tmp_path: Path) -> None:
    session, bench = begun(fed(noisy), tmp_path)
    waited(bench, "Touch")
    document = device(bench)
    assert (document["board"], document["options"], document["can_centre"]) == ("fed", {}, False)
    assert values(document)["Soft"].endswith(" pF")
    with pytest.raises(Refused, match="centre: this source has no range"):
        bench.do(Command("centre"))
    with pytest.raises(Refused, match="device: this source has no settings"):
        bench.do(Command("device", {"capf": 2}))
    session.close()


def test_other_settings_begin_a_new_measurement_with_notes(tmp_path: Path) -> None:
    session, bench = begun(SOURCE, tmp_path)
    waited(bench, "Touch")
    answer = bench.do(Command("device", {"capf": 2, "excitation": "B"}))["message"]
    assert answer == "A new measurement has started: capf 2, before 0."
    assert session.number == 2
    waited(bench, "Touch")
    document = device(bench)
    assert values(document)["Conversion"] == "CAPF 2, 20.0 ms"
    assert document["options"]["capf"]["value"] == 2
    session.close()
    for name, capf in (("run.csv", 0), ("run-2.csv", 2)):
        assert palpate.check(tmp_path / name).clean
        told = sidecar(tmp_path / name)
        assert "the converter was set again: capf 2, before 0" in told["notes"]
        assert told["device"]["configuration"]["capf"] == capf


def test_options_of_the_name_give_way(tmp_path: Path) -> None:
    session, bench = begun(f"{SOURCE}&capf=1&excitation=B", tmp_path)
    waited(bench, "Touch")
    assert device(bench)["options"]["capf"]["value"] == 1
    bench.do(Command("device", {"capf": 0}))
    assert device(bench)["options"]["capf"]["value"] == 0
    session.close()


def test_settings_that_are_refused(tmp_path: Path) -> None:
    session, bench = begun("sim:four-specimens?seed=1", tmp_path)
    with pytest.raises(Refused, match="these are the present settings"):
        bench.do(Command("device", {"capf": 0}))
    with pytest.raises(Refused, match="excitation: got 'C', allowed: A, B, AB"):
        bench.do(Command("device", {"excitation": "C"}))
    waited(bench, "Hold")
    for command in (Command("device", {"capf": 1}), Command("centre")):
        with pytest.raises(Refused, match="the probe is in contact; lift it first"):
            bench.do(command)
    assert session.number == 1
    session.close()
    with pytest.raises(Refused, match="the measurement has ended"):
        bench.do(Command("centre"))


def test_settings_with_which_the_board_does_not_begin(tmp_path: Path) -> None:
    """Nothing answers on EXCA: the measurement has ended then, and begins again with the settings from before."""
    session, bench = begun(SOURCE, tmp_path)
    waited(bench, "Touch")
    with pytest.raises(palpate.SourceError):
        bench.do(Command("device", {"excitation": "A"}))
    assert waited(bench, "ended")["now"]["word"] == "Stop"
    bench.do(Command("again"))
    assert device(bench)["options"]["excitation"]["value"] == "B"
    session.close()


def test_centring_has_a_mark_in_the_recording(tmp_path: Path) -> None:
    session, bench = begun(f"{SOURCE}&fault=overload:9@3", tmp_path)
    waited(bench, "range")
    assert bench.do(Command("centre"))["message"].startswith("The range is set again.")
    waited(bench, "gap")
    deadline = time.monotonic() + 60
    while not session.stream.recorder and time.monotonic() < deadline:
        time.sleep(0.02)
    waited(bench, "left out")  # what seemed to be a touch
    session.close()
    [mark] = sidecar(tmp_path / "run.csv")["marks"]
    assert mark["text"].startswith("the range was set again: CAPDAC")
    assert mark["gap"] is True


def test_temperature_since_the_baseline() -> None:
    played = Played("sim:four-specimens?seed=1&capf=7").play(until_s=25)
    document = Device(played, played.standing, "sim:").document()  # type: ignore[arg-type]
    assert values(document)["Temperature"] == "25.0 °C, +0.0 since the baseline"


def test_an_unplugged_board(tmp_path: Path) -> None:
    session, bench = begun(f"{SOURCE}&fault=unplug:60@1", tmp_path)
    waited(bench, "unplugged")
    warned = {fact["name"]: fact["value"] for fact in device(bench)["facts"] if fact["warn"]}
    session.close()
    assert warned["Board"] == "AD7746 evaluation kit, USB 1/2, gone"
    assert warned["Pairs a second"] == "0"
    assert warned["Hard, CIN1"] == "-"
