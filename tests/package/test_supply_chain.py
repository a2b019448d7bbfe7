"""Parts of others in the tree are those of a named release; programs of .ci have one version each."""

import hashlib
import re
import tomllib
from pathlib import Path

import palpate
import pytest
from project import ROOT

PACKAGE = Path(palpate.__file__).parent
TOOLS = ROOT / ".ci" / "tools.txt"
ORIGINS = sorted(PACKAGE.rglob("origin.toml"))


def test_every_folder_with_minified_files_says_where_they_are_from() -> None:
    folders = {path.parent for path in PACKAGE.rglob("*.min.*")}
    assert folders == {path.parent for path in ORIGINS}
    assert folders


@pytest.mark.parametrize("origin", ORIGINS, ids=lambda path: str(path.parent.name))
def test_vendored_files_are_those_of_the_release(origin: Path) -> None:
    told = tomllib.loads(origin.read_text(encoding="utf-8"))
    found = {path.name: path.read_bytes() for path in origin.parent.iterdir() if path != origin}
    assert {name: hashlib.sha256(data).hexdigest() for name, data in found.items()} == told["sha256"]
    assert told["license"] in found["LICENSE"].decode()
    assert told["version"] in told["url"]
    scripts = [data.decode() for name, data in found.items() if name.endswith(".js")]
    assert all(f"(v{told['version']})" in script[:200] for script in scripts)


@pytest.mark.skipif(not TOOLS.is_file(), reason="a source distribution has no .ci")
def test_each_program_of_ci_has_one_version_and_users_are_free() -> None:
    lines = TOOLS.read_text(encoding="utf-8").splitlines()
    pinned = [line for line in lines if not line.startswith("#")]
    assert all(re.fullmatch(r"[a-z0-9-]+==[0-9.]+", line) for line in pinned)
    names = [line.partition("==")[0] for line in pinned]
    assert names == sorted(set(names))
    for script in TOOLS.parent.iterdir():
        for install in re.findall(
            r"(?<!uv )pip\"? install --quiet (?!--no-deps)(.*)", script.read_text(encoding="utf-8")
        ):
            assert install.startswith("-c .ci/tools.txt "), script
    assert "==" not in (ROOT / "pyproject.toml").read_text(encoding="utf-8")
