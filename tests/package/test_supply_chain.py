"""No parts of others are in the tree; programs of .ci have one version each."""

import re
from pathlib import Path

import palpate
import pytest
from project import ROOT

PACKAGE = Path(palpate.__file__).parent
TOOLS = ROOT / ".ci" / "tools.txt"


def test_nothing_of_others_is_in_the_package() -> None:
    assert list(PACKAGE.rglob("*.min.*")) == []


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
