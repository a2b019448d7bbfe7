"""What a release needs is here, says the same everywhere, and what is missing is said."""

import re
import shutil
from datetime import date
from pathlib import Path

import pytest
from project import ROOT

from release.check import problems
from release.project import ADDRESS_MISSING, pyproject, version
from release.readme import absolute

ADDRESS = "https://code.invalid/team/palpate"
TODAY = date(2030, 1, 2)
SECTIONS = {"Added", "Changed", "Deprecated", "Removed", "Fixed", "Security"}
PROJECT = pyproject()["project"]
of_the_repository = pytest.mark.skipif(
    not (ROOT / ".github").is_dir(), reason="the README of a source distribution has full addresses"
)


def text(name: str) -> str:
    return (ROOT / name).read_text(encoding="utf-8")


@pytest.fixture
def source(tmp_path: Path) -> Path:
    """Return a copy of the files that a release depends on, with an address and a date in them."""
    for name in ("pyproject.toml", "CHANGELOG.md", "CITATION.cff", "cpp/include/palpate/version.hpp"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, tmp_path / name)
    heading = f"## [{version()}] - {TODAY}"
    replace(tmp_path / "CHANGELOG.md", r"^## \[Unreleased\]$|^## \[[\d.]+\].*$", heading)
    replace(tmp_path / "pyproject.toml", r"^\[project.urls\]$(\nSource = .*)?", f'[project.urls]\nSource = "{ADDRESS}"')
    cited = tmp_path / "CITATION.cff"
    cited.write_text(re.sub(r"date-released: .*\n", "", cited.read_text()) + f'date-released: "{TODAY}"\n')
    return tmp_path


def replace(path: Path, pattern: str, by: str) -> None:
    old = path.read_text(encoding="utf-8")
    new = re.sub(pattern, by, old, count=1, flags=re.MULTILINE)
    assert new != old
    path.write_text(new, encoding="utf-8")


def test_a_source_with_address_and_date_is_ready(source: Path) -> None:
    assert problems(f"v{version()}", source, TODAY) == []


def test_what_is_missing_now_is_said() -> None:
    """Of the project as it is: no address is invented, and no version is released by accident."""
    found = problems(f"v{version()}", ROOT, TODAY)
    assert (ADDRESS_MISSING in found) == ("Source" not in PROJECT.get("urls", {}))
    released = f"## [{version()}] - " in text("CHANGELOG.md")
    assert any(line.startswith("CHANGELOG.md: ") for line in found) != released


@pytest.mark.parametrize(
    ("file", "pattern", "by", "said"),
    [
        ("pyproject.toml", r"^Source = .*$", "", "pyproject.toml, .*the address of the repository is missing"),
        ("pyproject.toml", r"^Source = .*$", 'Source = "https://example.org/palpate"', "Source is 'https://example"),
        ("pyproject.toml", r"^Source = .*$", 'Source = "palpate"', "Source is 'palpate', allowed: https://HOST/PATH"),
        ("CHANGELOG.md", r" - 2030-01-02$", "", "there is no heading .* - 2030-01-02"),
        ("CITATION.cff", r"^version: .*$", "version: 9.9.9", "CITATION.cff: version is 9.9.9, in version.hpp it is"),
        (
            "CITATION.cff",
            r"^date-released: .*$",
            'date-released: "2029-01-01"',
            "date-released is 2029-01-01, in CHANGELOG",
        ),
        ("CITATION.cff", r"^date-released: .*$", "", "date-released is None"),
        ("cpp/include/palpate/version.hpp", r'"\d+', '"7', "the tag is .*, the version is 7"),
    ],
)
def test_a_source_that_is_not_ready_says_what_to_do(source: Path, file: str, pattern: str, by: str, said: str) -> None:
    replace(source / file, pattern, by)
    found = problems(f"v{version()}", source, TODAY)
    assert any(re.search(said, line) for line in found), found


def test_the_metadata_is_that_of_the_project() -> None:
    assert PROJECT["authors"] == [{"name": "palpate developers"}]
    assert "maintainers" not in PROJECT
    pythons = re.findall(r"Python :: (3\.\d+)\b", "\n".join(PROJECT["classifiers"]))
    assert pythons[0] == PROJECT["requires-python"].removeprefix(">=") == "3.11"
    built = pyproject()["tool"]["cibuildwheel"]["build"]
    wheels = [f"cp{python.replace('.', '')}-*" for python in pythons]
    assert built[: len(wheels)] == wheels, "a version that is claimed has a wheel"
    assert PROJECT["license-files"] == ["LICENSE"]
    assert "palpate developers" in text("LICENSE")


@of_the_repository
def test_every_python_with_a_wheel_is_tested() -> None:
    tried = re.findall(r"^ +python: \[(.*)\]$", text(".github/workflows/test.yml"), re.MULTILINE)
    pythons = re.findall(r"[\d.]+", *tried)
    assert pyproject()["tool"]["cibuildwheel"]["build"] == [f"cp{python.replace('.', '')}-*" for python in pythons]


@of_the_repository
def test_nobody_else_has_an_address_of_the_project() -> None:
    """Apart from pyproject.toml: nothing to correct in a second place when the repository moves."""
    known = re.compile(
        r"https?://(github\.com|gitlab\.com|[\w.-]*readthedocs\.(io|org)|pypi\.org)/[\w./-]*palpate", re.IGNORECASE
    )
    files = [
        path for folder in ("docs", "python", "cpp", "release") for path in (ROOT / folder).rglob("*") if path.is_file()
    ]
    files += [path for path in ROOT.iterdir() if path.suffix in (".md", ".cff", ".txt", ".yaml")]
    assert len(files) > 300
    assert [path for path in files if known.search(path.read_text(encoding="utf-8", errors="replace"))] == []


def test_the_version_is_cited() -> None:
    assert f"\nversion: {version()}\n" in text("CITATION.cff")
    released = re.search(rf"^## \[{re.escape(version())}\] - (\S+)$", text("CHANGELOG.md"), re.MULTILINE)
    assert released or "\n## [Unreleased]\n" in text("CHANGELOG.md")
    assert (
        (f'date-released: "{released[1]}"' in text("CITATION.cff"))
        if released
        else ("date-released" not in text("CITATION.cff"))
    )


def test_the_changelog_has_the_known_form() -> None:
    """Keep a Changelog 1.1.0: versions with ISO dates, newest first, their changes by kind."""
    lines = text("CHANGELOG.md").splitlines()
    assert lines[0] == "# Changelog"
    versions = [line for line in lines if line.startswith("## ")]
    assert versions
    assert all(re.fullmatch(r"## \[(Unreleased|\d+\.\d+\.\d+)\]( - \d{4}-\d\d-\d\d)?", line) for line in versions)
    assert all(line == "## [Unreleased]" or " - " in line for line in versions)
    assert versions == sorted(
        versions, key=lambda line: [int(n) for n in re.findall(r"\d+", line)] or [10**6], reverse=True
    )
    kinds = [line.removeprefix("### ") for line in lines if line.startswith("### ")]
    assert set(kinds) <= SECTIONS
    begun = [index for index, line in enumerate(lines) if line.startswith("## ")]
    for first, last in zip(begun, [*begun[1:], len(lines)], strict=True):
        part = [line for line in lines[first + 1 : last] if line]
        assert part[0].startswith("### "), "every change has a kind"
        names = [line for line in part if line.startswith("### ")]
        assert len(names) == len(set(names)), "each kind once"


@of_the_repository
def test_links_of_the_readme_lead_out_of_the_packages_page() -> None:
    page = absolute(text("README.md"), ADDRESS, "v1.2.3", ROOT)
    targets = re.findall(r"\]\(([^()\s]+)\)", re.sub(r"^```.*?^```$", "", page, flags=re.DOTALL | re.MULTILINE))
    assert len(targets) > 30
    assert {target.split("/v1.2.3/")[0] for target in targets if not target.startswith("#")} == {
        f"{ADDRESS}/blob",
        f"{ADDRESS}/raw",
    }
    assert "![The live page" in page
    assert f"({ADDRESS}/raw/v1.2.3/docs/images/live-light.png)" in page
    assert f"({ADDRESS}/blob/v1.2.3/docs/how.md#what-it-buys)" in page
    # In the repository they stay relative.
    assert not re.search(r"\]\(https?:", text("README.md"))


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("[a](docs) b", f"[a]({ADDRESS}/tree/v1/docs) b"),
        ("![a](docs/images/wiring.svg)", f"![a]({ADDRESS}/raw/v1/docs/images/wiring.svg)"),
        (
            "[![a](docs/images/live-light.png)](docs/live.md#x)",
            f"[![a]({ADDRESS}/raw/v1/docs/images/live-light.png)]({ADDRESS}/blob/v1/docs/live.md#x)",
        ),
        ("[a](https://x.org/y.png) [b](#the-paper) [c](mailto:a@b)", None),
        ("```python\nx[0](docs/live.md)\n```\n", None),
        (
            "```sh\na\n```\n[a](LICENSE)\n```sh\n[a](LICENSE)\n```\n",
            f"```sh\na\n```\n[a]({ADDRESS}/blob/v1/LICENSE)\n```sh\n[a](LICENSE)\n```\n",
        ),
    ],
)
def test_only_relative_links_change(line: str, expected: str | None) -> None:
    assert absolute(line, ADDRESS, "v1", ROOT) == (line if expected is None else expected)


def test_a_link_to_nothing_is_refused() -> None:
    with pytest.raises(ValueError, match=r"README.md links to docs/gone.md, which is not there"):
        absolute("[a](docs/gone.md)", ADDRESS, "v1", ROOT)
