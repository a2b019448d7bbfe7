"""Schemes of other packages that are broken: an error with the name of the package, and only where its scheme is used."""

import sys
from pathlib import Path

import palpate
import pytest
from palpate import sources
from palpate.cli import doctor
from palpate.errors import SourceError
from palpate.sources import ListedDevice
from palpate.sources.devices import devices
from recording_bench import SampleReader

BROKEN = {
    "import": ("raise RuntimeError('no licence')", "RuntimeError: no licence"),
    "name": ("", "AttributeError: module .* has no attribute 'open_it'"),
}


@pytest.fixture
def package(
    request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Install a package with the scheme other:, its module has the given text."""
    folder = tmp_path / "other_probe-1.0.dist-info"
    folder.mkdir()
    (folder / "METADATA").write_text(
        "Metadata-Version: 2.1\nName: other-probe\nVersion: 1.0\n", encoding="utf-8"
    )
    groups = "[palpate.sources]\nother = other_probe:open_it\nsim = nothing:at_all\n[palpate.devices]\nother = other_probe:search\n"
    (folder / "entry_points.txt").write_text(groups, encoding="utf-8")
    (tmp_path / "other_probe.py").write_text(request.param, encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "other_probe", raising=False)


@pytest.mark.parametrize(("package", "message"), BROKEN.values(), ids=BROKEN, indirect=["package"])
def test_a_broken_package(package: None, message: str) -> None:
    assert "other" in sources.schemes()
    with palpate.open("sim:soft-steady") as source:
        assert next(SampleReader(source)).seq == 0
    assert "other_probe" not in sys.modules
    for use in (palpate.open, palpate.Stream):
        with pytest.raises(
            SourceError, match=f"other: of package other-probe cannot be loaded from .*: {message}"
        ):
            use("other:")


SEARCH = "def open_it(address, options): pass\ndef search(): "


@pytest.mark.parametrize("package", [f"{SEARCH}raise OSError('bus 3')"], indirect=True)
def test_a_search_that_fails_is_a_note(package: None) -> None:
    message = "the search of package other-probe failed: OSError: bus 3"
    found, notes = devices()
    assert not any(device.uri.startswith("other:") for device in found)
    assert sum(message in note for note in notes) == 1
    findings = {finding.subject: finding for finding in doctor.check_packages()}
    assert findings["source other"].state == "ok"
    assert message in findings["search of another package"].text


@pytest.mark.parametrize(
    "package", [f"{SEARCH}return [('other:7', 'a probe'), ('other:8', 'a probe')]"], indirect=True
)
def test_the_devices_of_a_package_are_listed(package: None) -> None:
    found = [device for device in devices()[0] if device.uri.startswith("other:")]
    assert found == [ListedDevice("other:7", "a probe"), ListedDevice("other:8", "a probe")]
