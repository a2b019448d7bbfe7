"""Says what is missing for a release: `python -m release.check TAG [FILE...]`; with FILEs, the distributions are judged, too.

Exit code 1 and a line for each problem; nothing is uploaded with a problem (.github/workflows/release.yml).
"""

import re
import sys
from datetime import date
from pathlib import Path

from release.distributions import problems_of
from release.project import ROOT, NotReadyError, address, version

_RELEASED = r"^## \[{}\] - (\d{{4}}-\d\d-\d\d)$"


def _cited(root: Path, key: str) -> str | None:
    text = (root / "CITATION.cff").read_text(encoding="utf-8")
    found = re.search(rf"^{key}: \"?([^\"\n]*)", text, re.MULTILINE)
    return found[1] if found else None


def _dates(root: Path, today: date) -> list[str]:
    now = version(root)
    changes = (root / "CHANGELOG.md").read_text(encoding="utf-8")
    released = re.search(_RELEASED.format(re.escape(now)), changes, re.MULTILINE)
    if not released:
        return [f'CHANGELOG.md: there is no heading "## [{now}] - {today}"; rename "## [Unreleased]"']
    cited = _cited(root, "date-released")
    if cited != released[1]:
        return [f"CITATION.cff: date-released is {cited}, in CHANGELOG.md it is {released[1]}; write the same"]
    return []


def problems(tag: str, root: Path = ROOT, today: date | None = None) -> list[str]:
    """Return what is to be done in the source before `tag` can be released, in sentences."""
    found = []
    try:
        address(root)
    except NotReadyError as error:
        found.append(str(error))
    now = version(root)
    if tag != f"v{now}":
        found.append(f"the tag is {tag!r}, the version is {now} (cpp/include/palpate/version.hpp); allowed: v{now}")
    if (cited := _cited(root, "version")) != now:
        found.append(f"CITATION.cff: version is {cited}, in version.hpp it is {now}; write the same")
    return found + _dates(root, today or date.today())


def main(tag: str, *files: str) -> None:
    """Print the problems."""
    found = problems(tag)
    if files:
        found += problems_of([Path(file) for file in files])
    for line in found:
        print(line, file=sys.stderr)
    if found:
        sys.exit(1)
    print(f"{tag} can be released" if files else f"the source is ready for {tag}")


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    main(*sys.argv[1:])
