"""A release: what it needs says the same everywhere, its files are judged, and the workflows do what they should."""

import io
import re
import shutil
import tarfile
import zipfile
from datetime import date
from pathlib import Path

import palpate
import pytest
from project import ROOT, need, run

from release import make, smoke
from release.package import (
    NEEDED,
    SYSTEMS,
    absolute,
    expected,
    problems,
    problems_of,
    pyproject,
    version,
)

SOURCE = "https://code.invalid/team/palpate"
TODAY = date(2030, 1, 2)
VERSION = palpate.__version__
WORKFLOWS = ROOT / ".github" / "workflows"
TAGS = {system: re.sub("^(macosx)", r"\1_11_0", system) for system in SYSTEMS}
of_the_repository = pytest.mark.skipif(
    not WORKFLOWS.is_dir(), reason="not in a source distribution"
)


def text(name: str) -> str:
    return (ROOT / name).read_text(encoding="utf-8")


def replace(path: Path, pattern: str, by: str) -> None:
    old = path.read_text(encoding="utf-8")
    new = re.sub(pattern, by, old, count=1, flags=re.MULTILINE)
    assert new != old
    path.write_text(new, encoding="utf-8")


@pytest.fixture
def source(tmp_path: Path) -> Path:
    """Return a copy of the files that a release depends on, with an address and a date in them."""
    for name in (
        "pyproject.toml",
        "CHANGELOG.md",
        "CITATION.cff",
        "cpp/include/palpate/version.hpp",
    ):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, tmp_path / name)
    replace(
        tmp_path / "CHANGELOG.md",
        r"^## \[Unreleased\]$|^## \[[\d.]+\].*$",
        f"## [{version()}] - {TODAY}",
    )
    replace(
        tmp_path / "pyproject.toml",
        r"^\[project.urls\]$(\nSource = .*)?",
        f'[project.urls]\nSource = "{SOURCE}"',
    )
    cited = tmp_path / "CITATION.cff"
    cited.write_text(
        re.sub(r"date-released: .*\n", "", cited.read_text()) + f'date-released: "{TODAY}"\n'
    )
    return tmp_path


def test_a_source_with_address_and_date_is_ready(source: Path) -> None:
    assert problems(f"v{version()}", source, TODAY) == []


@pytest.mark.parametrize(
    ("file", "pattern", "by", "said"),
    [
        ("pyproject.toml", r"^Source = .*$", "", "Source is '', allowed: https://HOST/PATH"),
        ("CHANGELOG.md", r" - 2030-01-02$", "", "there is no heading .* - 2030-01-02"),
        (
            "CITATION.cff",
            r"^version: .*$",
            "version: 9.9.9",
            "CITATION.cff: version is 9.9.9, in version.hpp it is",
        ),
        (
            "CITATION.cff",
            r"^date-released: .*$",
            'date-released: "2029-01-01"',
            "is 2029-01-01, in CHANGELOG",
        ),
        ("cpp/include/palpate/version.hpp", r'"\d+', '"7', "the tag is .*, the version is 7"),
    ],
)
def test_a_source_that_is_not_ready_says_what_to_do(
    source: Path, file: str, pattern: str, by: str, said: str
) -> None:
    replace(source / file, pattern, by)
    found = problems(f"v{version()}", source, TODAY)
    assert any(re.search(said, line) for line in found), found


@of_the_repository
def test_links_of_the_readme_lead_out_of_the_packages_page() -> None:
    page = absolute(text("README.md"), SOURCE, "v1.2.3", ROOT)
    linked = re.findall(
        r"\]\(([^()#\s][^()\s]*)\)",
        re.sub(r"^```.*?^```$", "", page, flags=re.DOTALL | re.MULTILINE),
    )
    assert len(linked) > 30
    assert {target.split("/v1.2.3/")[0] for target in linked} == {f"{SOURCE}/blob", f"{SOURCE}/raw"}
    assert f"({SOURCE}/raw/v1.2.3/docs/images/live-light.png)" in page
    assert f"({SOURCE}/blob/v1.2.3/docs/how.md#what-it-buys)" in page
    assert not re.search(r"\]\(https?:", text("README.md"))  # in the repository they stay relative
    block = "```python\nx[0](docs/live.md)\n```\n"
    assert absolute(block, SOURCE, "v1", ROOT) == block
    with pytest.raises(ValueError, match=r"README.md links to docs/gone.md, which is not there"):
        absolute("[a](docs/gone.md)", SOURCE, "v1", ROOT)


def metadata(
    page: str = f"[a]({SOURCE}/b) [b](#c)", version: str = VERSION, url: str = f"Source, {SOURCE}"
) -> str:
    return (
        f"Metadata-Version: 2.4\nName: palpate\nVersion: {version}\nProject-URL: {url}\n\n{page}\n"
    )


def wheel(
    folder: Path, tag: str, text: str = metadata(), extra: tuple[str, ...] = (), without: str = " "
) -> Path:
    path, info = folder / f"palpate-{VERSION}-{tag}.whl", f"palpate-{VERSION}.dist-info"
    names = [
        f"{info}/{name}" for name in ("WHEEL", "RECORD", "entry_points.txt", "licenses/LICENSE")
    ]
    names += [
        f"palpate/{name}"
        for name in ("__init__.py", "_core.cpython-311.so", "include/palpate/palpate.hpp")
    ]
    with zipfile.ZipFile(path, "w") as file:
        for name in [n for n in [*names, *extra] if without not in n]:
            file.writestr(name, "")
        file.writestr(f"{info}/METADATA", text)
    return path


def distribution(folder: Path, text: str = metadata(), without: str = " ") -> Path:
    path = folder / f"palpate-{VERSION}.tar.gz"
    with tarfile.open(path, "w:gz") as file:
        for name in [n for n in NEEDED if without not in n]:
            file.addfile(tarfile.TarInfo(f"palpate-{VERSION}/{name}"))
        entry = tarfile.TarInfo(f"palpate-{VERSION}/PKG-INFO")
        entry.size = len(text.encode())
        file.addfile(entry, io.BytesIO(text.encode()))
    return path


def test_a_complete_release_is_good(tmp_path: Path) -> None:
    folders = ("palpate/", "palpate/include/")  # auditwheel writes them
    files = [
        wheel(tmp_path, f"{python}-{python}-{TAGS[system]}", extra=folders)
        for python, system in expected()
    ]
    assert len(files) == 5 * len(SYSTEMS)
    assert problems_of([*files, distribution(tmp_path)]) == []
    assert (
        "LICENSE is missing"
        in problems_of([distribution(tmp_path, without="LICENSE")], complete=False)[0]
    )
    found = problems_of(files[1:])
    assert len(found) == 2
    assert re.fullmatch(r"no wheel for cp3\d+ on \w+", found[0])
    assert found[1] == "0 source distributions, expected 1"


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        (
            {"text": metadata(page="[a](docs/live.md)")},
            "its page would have the relative link docs/live.md",
        ),
        ({"text": metadata(url="Home, https://code.invalid")}, "no address of the source"),
        ({"extra": ("palpate/tests/test_a.py",)}, "stray file palpate/tests/test_a.py"),
        ({"without": "_core"}, "expected one extension"),
    ],
)
def test_each_fault_of_a_wheel_is_said(tmp_path: Path, changed: dict[str, str], said: str) -> None:
    path = wheel(tmp_path, "cp311-cp311-manylinux_2_28_x86_64", **changed)  # type: ignore[arg-type]
    found = problems_of([path], complete=False)
    assert any(said in line and path.name in line for line in found), found


def test_each_fault_of_a_download_is_said(tmp_path: Path) -> None:
    archive = tmp_path / f"palpate-cpp-{VERSION}.zip"
    with zipfile.ZipFile(archive, "w") as file:
        file.writestr("other.hpp", "")
    page = tmp_path / "palpate-try.html"
    page.write_text("<title>palpate</title>", encoding="utf-8")
    assert problems_of([page], complete=False) == []
    page.write_text('<title>palpate</title><script src="try.js">', encoding="utf-8")
    stray = tmp_path / "notes.txt"
    found = problems_of([archive, page, stray], complete=False)
    assert [line.split(": ")[0] for line in found] == ["notes.txt", archive.name, page.name]


def test_a_release_is_made_in_a_new_folder_of_a_source_that_is_ready(tmp_path: Path) -> None:
    (tmp_path / "old.whl").write_text("")
    assert "allowed: a new one" in make.make_release(tmp_path)[0]
    if problems(f"v{version()}"):
        assert make.make_release(tmp_path / "new") == problems(f"v{version()}")
        assert not (tmp_path / "new").exists()


def test_the_bits_are_those_that_each_wheel_must_have() -> None:
    assert smoke.bits() == smoke.EXPECTED


def test_the_extension_exports_its_entry_alone() -> None:
    """Two extensions of pybind11 in a process share no symbol of ours."""
    extension = palpate._core.__file__
    assert run(need("nm"), "-D", "--defined-only", extension).split()[2::3] == ["PyInit__core"]


@of_the_repository
def test_workflows_are_pinned_trusted_with_little_and_name_what_is_there() -> None:
    for path in WORKFLOWS.iterdir():
        told = path.read_text(encoding="utf-8")
        used = re.findall(r"uses: (.*)", told)
        assert used
        assert all(
            re.fullmatch(r"(actions|pypa)/[\w-]+@[0-9a-f]{40} # v\d+\.\d+\.\d+", action)
            for action in used
        )
        assert "\npermissions: {}\n" in told
        assert set(re.findall(r"\w+(?:-\w+)*: write", told)) <= {"id-token: write"}
        assert "secrets." not in told
        for module in re.findall(r"python -m (release\.\w+)", told):
            assert (ROOT / module.replace(".", "/")).with_suffix(".py").is_file()
    [tried] = re.findall(r"^ +python: \[(.*)\]$", text(".github/workflows/test.yml"), re.MULTILINE)
    wheels = [f"cp{python.replace('.', '')}-*" for python in re.findall(r"[\d.]+", tried)]
    assert pyproject()["tool"]["cibuildwheel"]["build"] == wheels
