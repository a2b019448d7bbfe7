"""What a release must know of the project; each is written in one place."""

import re
import tomllib
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
ADDRESS_MISSING = (
    'pyproject.toml, [project.urls]: the address of the repository is missing; fill in Source = "https://..."'
)


class NotReadyError(Exception):
    """The project cannot be released; the text says what is to be done."""


def pyproject(root: Path = ROOT) -> dict[str, Any]:
    """Return what pyproject.toml says."""
    return tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))


def version(root: Path = ROOT) -> str:
    """Return the version; version.hpp is the only place of it."""
    text = (root / "cpp" / "include" / "palpate" / "version.hpp").read_text(encoding="utf-8")
    found = re.search(r'PALPATE_VERSION "(.*)"', text)
    assert found
    return found[1]


def address(root: Path = ROOT) -> str:
    """Return the address of the repository, without a slash at its end.

    Raises
    ------
    NotReadyError
        There is none yet, or it is no address that a reader can open.
    """
    source = pyproject(root)["project"].get("urls", {}).get("Source")
    if source is None:
        raise NotReadyError(ADDRESS_MISSING)
    if not re.fullmatch(r"https://[^\s/]+/\S+", source) or "example." in source:
        raise NotReadyError(
            f"pyproject.toml, [project.urls]: Source is {source!r}, allowed: https://HOST/PATH of the repository"
        )
    return str(source).rstrip("/")
