"""The pages of the Python API: each object, and each public member of it, is there."""

import importlib
import inspect
import re
from pathlib import Path
from typing import Any

import palpate
from project import ROOT

LISTED = re.findall(r"^   (palpate\.\S+)$", (ROOT / "docs" / "api.md").read_text(encoding="utf-8"), re.MULTILINE)
FILES = {"palpate.design.Cusum": "palpate.design.Cusum-class"}


def named(name: str) -> Any:
    """Return an object by its full name."""
    parts = name.split(".")
    for count in range(len(parts), 0, -1):
        try:
            found: Any = importlib.import_module(".".join(parts[:count]))
        except ImportError:
            continue
        for part in parts[count:]:
            found = getattr(found, part)
        return found
    raise AssertionError(name)


def members(kind: type) -> list[str]:
    """Return the public members of a class, without those of Python's own classes."""
    ours = [vars(each) for each in kind.__mro__ if each.__module__.split(".")[0] == "palpate"]
    return sorted({name for each in ours for name in each if not name.startswith("_")})


def shown(page: str, member: str) -> bool:
    """Return whether a page has a heading of a member, or a line of it under its class."""
    return re.search(rf'id="[\w.-]+\.{member}"|<strong>[^<]*\b{member}\b', page) is not None


def test_every_public_name_is_listed() -> None:
    public = {id(getattr(palpate, name)) for name in palpate.__all__ if name != "__version__"}
    assert public <= {id(named(name)) for name in LISTED}


def test_no_member_is_lost(site: Path) -> None:
    lost, counted = [], 0
    for name in LISTED:
        found = named(name)
        page = (site / "api" / f"{FILES.get(name, name)}.html").read_text(encoding="utf-8")
        assert f'id="{name}"' in page or f'id="{found.__module__}.{found.__qualname__}"' in page, name
        if inspect.isclass(found):
            counted += len(members(found))
            lost += [f"{name}.{member}" for member in members(found) if not shown(page, member)]
    assert lost == []
    assert counted > 400
