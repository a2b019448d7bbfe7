"""What is installed, what an import costs, which way the imports point, and that every example runs."""

import ast
import doctest
import importlib.metadata
import inspect
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from graphlib import TopologicalSorter
from pathlib import Path
from typing import Any

import palpate
import pytest
from packaging.requirements import Requirement
from packaging.version import Version
from project import ROOT, of_a_wheel

SOURCES = ROOT / "python" / "palpate"
HEADERS = ROOT / "cpp" / "include" / "palpate"

# Rooms of headers, a folder or a lone file, low to high; each may use only what stands in lower rows, and a folder itself.
# Those of python/ stand in pyproject.toml.
HEADER_LAYERS = (
    "version",
    "contraction",
    "arithmetic",
    "design elasticity estimate ring settings square_root time",
    "judgement",
    "policy",
    "estimator stage",
    "judge",
    "tracker",
    "scenes",
    "embedded",
    "palpate",
)


def module_of(path: Path) -> str:
    """Return a source's name below palpate; a package's front has the name of the package."""
    parts = path.relative_to(SOURCES).with_suffix("").parts
    return ".".join(parts[:-1] if len(parts) > 1 and parts[-1] == "__init__" else parts)


MODULES = {module_of(path): path for path in sorted(SOURCES.rglob("*.py"))}
INCLUDE = re.compile(r"^#include <palpate/([\w/]+)\.hpp>", re.MULTILINE)
FOLDERS = sorted({module_of(path) for path in SOURCES.rglob("__init__.py")} - {"__init__"})


def test_includes_point_down() -> None:
    rank = {room: number for number, row in enumerate(HEADER_LAYERS) for room in row.split()}
    found = {
        path.relative_to(HEADERS).with_suffix("").as_posix(): INCLUDE.findall(
            path.read_text(encoding="utf-8")
        )
        for path in sorted(HEADERS.rglob("*.hpp"))
    }
    assert {header.split("/")[0] for header in found} == set(rank)
    upwards = [
        (header, target)
        for header, targets in found.items()
        for target in targets
        if (a := header.split("/")[0]) != (b := target.split("/")[0]) and rank[b] >= rank[a]
    ]
    assert upwards == []
    assert list(TopologicalSorter(found).static_order())  # no circle inside a room


def test_imports_keep_their_contracts() -> None:
    """Those of pyproject.toml, lazy imports included."""
    command = [
        sys.executable,
        "-c",
        "from importlinter.cli import lint_imports_command as run; run()",
        "--no-cache",
    ]
    done = subprocess.run(command, capture_output=True, text=True, cwd=ROOT, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "3 kept, 0 broken" in done.stdout


def test_the_reference_shares_no_code() -> None:
    texts = [path.read_text(encoding="utf-8") for path in (SOURCES / "reference").glob("*.py")]
    nodes = [node for text in texts for node in ast.walk(ast.parse(text))]
    names = {node.module or "" for node in nodes if isinstance(node, ast.ImportFrom)}
    names |= {alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names}
    own = {name for name in names if name.startswith("palpate.reference.")}
    assert {name.split(".")[0] for name in names - own} - set(sys.stdlib_module_names) == {"numpy"}


def test_no_module_has_the_name_of_something_public() -> None:
    """As a submodule `touches` would: importing it puts it in the place of the function."""
    for folder in ["", *FOLDERS]:
        module = importlib.import_module(f"palpate.{folder}".rstrip("."))
        public = {
            n for n in getattr(module, "__all__", ()) if not inspect.ismodule(getattr(module, n))
        }
        prefix = f"{folder}." if folder else ""
        assert (
            public & {m.removeprefix(prefix) for m in MODULES if m.startswith(prefix)} == set()
        ), folder


def test_headers_use_freestanding_headers_only() -> None:
    allowed = {"cstddef", "cstdint", "limits", "type_traits", "utility", "atomic"}
    for path in set(HEADERS.rglob("*.hpp")) - {HEADERS / "design.hpp"}:  # only for computers
        assert set(re.findall(r"#include <([a-z_]+)>", path.read_text(encoding="utf-8"))) <= allowed


def test_import_loads_neither_numpy_nor_anything_optional() -> None:
    code = "import sys; before = set(sys.modules); import palpate; print(*{m.split('.')[0] for m in set(sys.modules) - before})"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded = {name for name in done.stdout.split() if name not in sys.stdlib_module_names}
    assert loaded - {"pybind11_builtins"} == {"palpate"}


def test_a_name_that_is_not_there() -> None:
    assert set(palpate.__all__) <= set(dir(palpate))
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = palpate.nothing


def test_the_version_is_written_once() -> None:
    version = re.search(
        r'PALPATE_VERSION "(.*)"', (HEADERS / "version.hpp").read_text(encoding="utf-8")
    )
    assert version
    assert palpate.__version__ == version[1] == importlib.metadata.version("palpate")
    space = f"#define PALPATE_NAMESPACE v{version[1].replace('.', '_')}\n"
    assert space in (HEADERS / "version.hpp").read_text(encoding="utf-8")
    for name in (
        "pyproject.toml",
        "CMakeLists.txt",
        "python/palpate/__init__.py",
        "cpp/bind/module.cpp",
    ):
        assert f'"{version[1]}"' not in (ROOT / name).read_text(encoding="utf-8")


def test_the_extension_is_compiled_from_every_source_in_two_batches() -> None:
    """Each batch reads pybind11 once, which takes longer than to compile most of the sources."""
    build = (ROOT / "cpp" / "bind" / "CMakeLists.txt").read_text(encoding="utf-8")
    sources = re.findall(r"\w+\.cpp", build)
    assert sorted(sources) == sorted(path.name for path in (ROOT / "cpp" / "bind").glob("*.cpp"))
    [batch] = re.findall(r"UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE (\d+)", build)
    assert len(sources) / 2 <= int(batch) < len(sources)


@of_a_wheel
def test_wheel_contents() -> None:
    """Of the wheel that was installed for these tests: to build another takes longer than any of them."""
    files = importlib.metadata.files("palpate")
    assert files
    names = {
        name
        for name in map(str, files)
        if not re.search(r"__pycache__/|(bin|Scripts)/palpate(\.exe)?$", name)
    }
    assert [n for n in names if re.fullmatch(r"palpate/_core\..*(so|pyd)", n)]
    assert {
        f"palpate/include/palpate/{p.relative_to(HEADERS).as_posix()}"
        for p in HEADERS.rglob("*.hpp")
    } <= names
    sources = [
        p for p in SOURCES.rglob("*") if p.suffix in (".py", ".pyi", ".typed", ".j2", ".css")
    ]
    assert {f"palpate/{p.relative_to(SOURCES).as_posix()}" for p in sources} <= names
    cmake = {f"palpate/lib/cmake/palpate/{n}" for n in ("palpate-config.cmake", "CMakeLists.txt")}
    assert {"palpate/py.typed"} | cmake <= names
    assert not [n for n in names if not re.match(r"palpate(-[\d.]+\.dist-info)?/", n)]


def documented() -> Iterator[tuple[str, str, dict[str, Any]]]:
    for name in sorted(MODULES.keys() - {"__main__"}):
        module = importlib.import_module("palpate" if name == "__init__" else f"palpate.{name}")
        tests = doctest.DocTestFinder().find(module)
        yield from (
            (test.name, test.docstring or "", module.__dict__) for test in tests if test.examples
        )
    for path in sorted(ROOT.glob("*.md")):
        for number, block in enumerate(
            re.findall(r"```pycon\n(.*?)```", path.read_text(encoding="utf-8"), re.DOTALL)
        ):
            yield f"{path.name}[{number}]", block, {}


@pytest.mark.parametrize(
    ("name", "text", "names"), [pytest.param(*d, id=d[0]) for d in documented()]
)
def test_examples(
    name: str, text: str, names: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(ROOT)
    test = doctest.DocTestParser().get_doctest(text, dict(names), name, None, 0)
    assert test.examples
    report: list[str] = []
    result = doctest.DocTestRunner().run(test, out=report.append)
    assert result.failed == 0, "".join(report)


SAFE = {
    "starlette": "1.3.1",  # CVE-2024-47874, 2025-54121, 2025-62727, 2026-48710, 2026-48817, 2026-48818, 2026-54282, 2026-54283
    "h11": "0.16",  # CVE-2025-43859; of uvicorn, which asks for less
    "uvicorn": "0.11.7",  # CVE-2020-7694, 2020-7695
    "websockets": "9.1",  # CVE-2021-33880
    "jinja2": "3.1.6",  # CVE-2024-22195, 2024-34064, 2024-56201, 2024-56326, 2025-27516
    "pyarrow": "23.0.1",  # CVE-2023-47248, 2026-25087
    "openpyxl": "2.4.2",  # CVE-2017-5992
}
"""First versions without a known advisory, November 2026, of what listens or parses."""


def test_what_listens_or_parses_begins_without_a_known_advisory() -> None:
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"][
        "optional-dependencies"
    ]
    asked = [
        Requirement(each)
        for extra in ("live", "report", "tables", "lsl", "serial")
        for each in extras[extra]
    ]
    assert SAFE.keys() <= {each.name for each in asked}
    for each in asked:
        [floor] = [one.version for one in each.specifier if one.operator == ">="]
        assert Version(floor) >= Version(SAFE.get(each.name, "0")), each


def test_the_programs_of_the_static_checks_are_in_the_group_dev() -> None:
    group = tomllib.loads((ROOT / "pyproject.toml").read_text())["dependency-groups"]["dev"]
    installed = {Requirement(each).name for each in group}
    checks = ROOT / ".ci" / "checks"
    if not checks.is_file():
        pytest.skip("not in a source distribution")
    used = set(re.findall(r'"\$bin/([\w-]+)"', checks.read_text()))
    assert len(used) == 6
    assert {name.replace("lint-imports", "import-linter") for name in used} <= installed
    pinned = (ROOT / ".ci" / "tools.txt").read_text()
    assert installed & set(re.findall(r"(?m)^([\w-]+)==", pinned)) == set()


def test_everything_public_is_documented() -> None:
    for name in palpate.__all__:
        value = getattr(palpate, name)
        if inspect.isclass(value):
            for member, attribute in vars(value).items():
                if callable(attribute) or inspect.isdatadescriptor(attribute):
                    assert member.startswith("_") or attribute.__doc__, f"{name}.{member}"
        if name != "__version__":
            assert value.__doc__, name
