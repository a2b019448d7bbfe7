"""The device on the page: what it says, and that nothing changes a measurement without a mark in the recording."""

import re
from pathlib import Path

import palpate
import pytest
from live_bench import SOURCE, Bench, Fed, Played, begun, noisy
from palpate.live.device import Device
from palpate.live.page_commands import DeviceCommand
from palpate.live.protocol import DeviceMessage, RefusedCommand
from palpate.recording.sidecar import load
from recording_bench import soon

IDLE = f"{SOURCE}&idle=60"


def device(bench: Bench) -> DeviceMessage:
    bench.look()
    return bench.device.document()


def values(document: DeviceMessage) -> dict[str, str]:
    return {fact.name: fact.value for fact in document.facts}


def test_what_a_board_is_and_other_settings_begin_a_new_measurement(tmp_path: Path) -> None:
    bench = begun(f"{IDLE}&capf=1", tmp_path)
    bench.waited("Touch")
    document = device(bench)
    expected = {
        "Excitation": "±1/2 of the supply (EXCB)",
        "Conversion": "11.9 ms (CAPF 1)",
        "Supply": "3.30 V",
    }
    found = values(document)
    assert found["Board"] == "simulated AD7746 evaluation kit, USB 1/2"
    assert expected.items() <= found.items()
    assert found["Temperature"].startswith("25.0 °C")
    assert found["Hard, CIN1"].endswith("% of range")
    assert re.fullmatch(r"(-|\d+\.\d) of \d+\.\d", found["Pairs a second"])
    option = document.options["capf"]
    assert (option.value, option.allowed, document.can_centre) == (1, list(range(8)), True)
    with pytest.raises(ValueError, match="excitation: got 'C', allowed: A, B, AB"):
        bench.obey("device", excitation="C")
    message = bench.obey("device", capf=2)
    assert message == "A new measurement has started: capf 2, before 1."
    assert bench.measurement.number == 2
    bench.waited("Touch")
    assert values(device(bench))["Conversion"] == "20.0 ms (CAPF 2)"
    assert device(bench).options["capf"].value == 2
    bench.measurement.close()
    for name, capf in (("run.csv", 1), ("run-2.csv", 2)):
        assert palpate.check(tmp_path / name).clean
        told = load(tmp_path / name) or {}
        assert "the converter was set again: capf 2, before 1" in told["notes"]
        assert told["device"]["configuration"]["capf"] == capf
    with pytest.raises(RefusedCommand, match="the measurement has ended"):
        bench.obey("centre")


def test_a_source_without_settings(tmp_path: Path) -> None:
    bench = begun(lambda: Fed(noisy), tmp_path)
    soon(lambda: values(device(bench))["Soft"].endswith(" pF"))
    document = device(bench)
    assert (document.options, document.can_centre) == ({}, False)
    with pytest.raises(RuntimeError, match="centre: got a source that cannot set its range"):
        bench.obey("centre")
    with pytest.raises(RefusedCommand, match="device: this source has no settings"):
        bench.obey("device", capf=2)
    bench.measurement.close()


def test_nothing_is_set_in_contact_and_temperature_since_the_baseline() -> None:
    played = Played(f"{SOURCE}&capf=7&idle=10").play(until_s=32)
    told = values(Device(played, played.page_state, "sim:").document())
    assert told["Temperature"] == "25.0 °C, +0.0 since the baseline"
    played = Played(SOURCE).play(until_s=4)
    device = Device(played, played.page_state, "sim:")
    assert played.state in ("contact", "done")
    refused = pytest.raises(RefusedCommand, match="the probe is in contact; lift it first")
    with refused:
        device.set(DeviceCommand(capf=1))
    with refused:
        device.centre()


def test_settings_with_which_the_board_does_not_begin(tmp_path: Path) -> None:
    """Nothing answers on EXCA: the measurement has ended then, and begins again with the settings from before."""
    bench = begun(IDLE, tmp_path)
    soon(lambda: bench.measurement.last)
    with pytest.raises(palpate.errors.SourceError):
        bench.obey("device", excitation="A")
    assert bench.waited("ended").now.word == "Ended"
    bench.obey("again")
    assert device(bench).options["excitation"].value == "B"
    bench.measurement.close()
