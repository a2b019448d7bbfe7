"""The files of a release are judged: a good one passes, and each fault is said. The workflows do what they should."""

import io
import re
import tarfile
import zipfile
from pathlib import Path

import palpate
import pytest
from building import run
from project import ROOT, need

from release.distributions import SYSTEMS, expected, problems_of, relative_links, targets
from release.project import pyproject

VERSION = palpate.__version__
PAGE = "[a](https://code.invalid/palpate/blob/v1/docs/live.md) [b](#c)"
WORKFLOWS = ROOT / ".github" / "workflows"
TAGS = {system: re.sub("^(macosx)", r"\1_11_0", system) for system in SYSTEMS}
of_the_repository = pytest.mark.skipif(not WORKFLOWS.is_dir(), reason="a source distribution has no workflows")


def metadata(page: str = PAGE, version: str = VERSION, url: str = "Source, https://code.invalid/palpate") -> str:
    return f"Metadata-Version: 2.4\nName: palpate\nVersion: {version}\nProject-URL: {url}\n\n{page}\n"


def wheel(folder: Path, tag: str, text: str = metadata(), extra: tuple[str, ...] = (), without: str = " ") -> Path:
    path = folder / f"palpate-{VERSION}-{tag}.whl"
    info = f"palpate-{VERSION}.dist-info"
    names = [f"{info}/{name}" for name in ("WHEEL", "RECORD", "entry_points.txt", "licenses/LICENSE")]
    names += [
        "palpate/__init__.py",
        "palpate/_core.cpython-311-x86_64-linux-gnu.so",
        "palpate/include/palpate/palpate.hpp",
    ]
    with zipfile.ZipFile(path, "w") as file:
        for name in [n for n in [*names, *extra] if without not in n]:
            file.writestr(name, "")
        file.writestr(f"{info}/METADATA", text)
    return path


def source(folder: Path, text: str = metadata(), without: str = " ") -> Path:
    path = folder / f"palpate-{VERSION}.tar.gz"
    top = path.name.removesuffix(".tar.gz")
    names = [
        "LICENSE",
        "README.md",
        "CITATION.cff",
        "pyproject.toml",
        "tests/data/four-specimens.csv",
        "release/smoke.py",
    ]
    with tarfile.open(path, "w:gz") as file:
        for name in [n for n in names if without not in n]:
            file.addfile(tarfile.TarInfo(f"{top}/{name}"))
        entry = tarfile.TarInfo(f"{top}/PKG-INFO")
        entry.size = len(text.encode())
        file.addfile(entry, io.BytesIO(text.encode()))
    return path


def test_a_complete_release_is_good(tmp_path: Path) -> None:
    folders = ("palpate/", "palpate/include/")  # auditwheel writes them
    files = [wheel(tmp_path, f"{python}-{python}-{TAGS[system]}", extra=folders) for python, system in expected()]
    assert len(files) == 5 * len(SYSTEMS)
    assert problems_of([*files, source(tmp_path)]) == []
    found = problems_of(files[1:])
    assert len(found) == 2
    assert any(re.fullmatch(r"no wheel for cp3\d+ on \w+", line) for line in found)
    assert "0 source distributions, expected 1" in found


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"text": metadata(page="[a](docs/live.md)")}, "its page would have the relative link docs/live.md"),
        ({"text": metadata(page="![a](docs/images/x.png)")}, "the relative link docs/images/x.png"),
        ({"text": metadata(version="9.9.9")}, "version 9.9.9, expected"),
        ({"text": metadata(url="Home, https://code.invalid")}, "no address of the source"),
        ({"extra": ("palpate/tests/test_a.py",)}, "stray file palpate/tests/test_a.py"),
        ({"extra": ("palpate/__pycache__/a.pyc",)}, "stray file palpate/__pycache__/a.pyc"),
        ({"extra": ("release/smoke.py",)}, "stray file release/smoke.py"),
        ({"extra": ("palpate/_core.so",)}, "expected one extension"),
        ({"without": "_core"}, "expected one extension"),
        ({"without": "LICENSE"}, "no LICENSE"),
    ],
)
def test_each_fault_of_a_wheel_is_said(tmp_path: Path, changed: dict[str, str], said: str) -> None:
    path = wheel(tmp_path, "cp311-cp311-manylinux_2_28_x86_64", **changed)  # type: ignore[arg-type]
    found = problems_of([path], complete=False)
    assert any(said in line and path.name in line for line in found), found


def test_each_fault_of_a_source_distribution_is_said(tmp_path: Path) -> None:
    assert problems_of([source(tmp_path)], complete=False) == []
    assert "LICENSE is missing" in problems_of([source(tmp_path, without="LICENSE")], complete=False)[0]
    assert "relative link" in problems_of([source(tmp_path, metadata(page="[a](b.md)"))], complete=False)[0]


def test_a_wheels_name_says_where_it_runs() -> None:
    both = f"palpate-{VERSION}-cp313-cp313-manylinux_2_27_x86_64.manylinux_2_28_x86_64.whl"
    assert targets(both) == {("cp313", "manylinux_2_28_x86_64")}
    assert targets(f"palpate-{VERSION}-cp313-cp313-macosx_11_0_arm64.whl") == {("cp313", "macosx_arm64")}
    assert targets(f"palpate-{VERSION}-cp313-cp313-linux_x86_64.whl") == set()


def test_links_in_every_form_are_found() -> None:
    page = "[a](b.md) ![c](d.png) [![e](f.png)](g.md) [h][i] <https://x.org>\n\n```\n[j](k.md)\n```\n\n[i]: l.md\n"
    assert sorted(relative_links(page)) == ["b.md", "d.png", "f.png", "g.md", "l.md"]


def test_the_extension_exports_its_entry_alone() -> None:
    """Two extensions of pybind11 in a process share no symbol of ours."""
    [extension] = Path(palpate.__file__).parent.glob("_core.*.so")
    symbols = run(need("nm"), "-D", "--defined-only", extension).split()[2::3]
    assert symbols == ["PyInit__core"]


@of_the_repository
def test_actions_are_pinned_by_commit_and_trusted_with_little() -> None:
    for path in WORKFLOWS.iterdir():
        text = path.read_text(encoding="utf-8")
        used = re.findall(r"uses: (.*)", text)
        assert used
        assert all(re.fullmatch(r"(actions|pypa)/[\w-]+@[0-9a-f]{40} # v\d+\.\d+\.\d+", action) for action in used)
        assert "\npermissions: {}\n" in text
        assert set(re.findall(r"\w+(?:-\w+)*: write", text)) <= {"id-token: write"}
        assert "secrets." not in text
        assert text.count("timeout-minutes:") == len(re.findall(r"^    runs-on:", text, re.MULTILINE))


@of_the_repository
def test_the_workflows_name_the_versions_and_programs_of_the_project() -> None:
    test, release = (WORKFLOWS / f"{name}.yml" for name in ("test", "release"))
    pythons = [c.rpartition(" ")[2] for c in pyproject()["project"]["classifiers"] if re.search(r":: 3\.\d+$", c)]
    [tried] = re.findall(r"python: \[(.*)\]", test.read_text(encoding="utf-8"))
    assert pythons
    assert {f'"{python}"' for python in pythons} <= set(tried.split(", "))
    pinned = (ROOT / ".ci" / "tools.txt").read_text(encoding="utf-8")
    for installed in re.findall(r"-c .ci/tools.txt (.*)", release.read_text(encoding="utf-8")):
        assert all(f"\n{name}==" in pinned for name in installed.split()), installed
    for module in re.findall(r"python -m (release\.\w+)", release.read_text(encoding="utf-8")):
        assert (ROOT / module.replace(".", "/")).with_suffix(".py").is_file()
