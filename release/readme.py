"""The README as a package's page can show it: that page has no other files, so links and images get full addresses."""

import re
from pathlib import Path

_FENCED = re.compile(r"^```.*?^```$", re.DOTALL | re.MULTILINE)
_LINK = re.compile(r"\]\(([^()\s]+)\)")
_WITH_SCHEME = re.compile(r"[a-z][a-z0-9+.-]*:", re.IGNORECASE)
_IMAGES = {".gif", ".jpg", ".png", ".svg", ".webp"}


def absolute(text: str, address: str, ref: str, folder: Path) -> str:
    """Return `text` with each relative link and image as an address of the repository.

    Parameters
    ----------
    text : str
        The README, in Markdown. Blocks of code stay as they are, and so do links with a scheme or to a heading of the page.
    address : str
        Where the repository is, "https://...".
    ref : str
        The tag or the branch that the links are to show.
    folder : Path
        The folder of the README.

    Raises
    ------
    ValueError
        A link to a file or a folder that is not there.
    """

    def linked(match: re.Match[str]) -> str:
        target = match[1]
        if target.startswith("#") or _WITH_SCHEME.match(target):
            return match[0]
        path = target.partition("#")[0]
        if not (folder / path).exists():
            raise ValueError(f"README.md links to {path}, which is not there; correct the link")
        kind = "raw" if Path(path).suffix in _IMAGES else "tree" if (folder / path).is_dir() else "blob"
        return f"]({address}/{kind}/{ref}/{target})"

    blocks = _FENCED.findall(text)
    between = [_LINK.sub(linked, part) for part in _FENCED.split(text)]
    return "".join(part + block for part, block in zip(between, [*blocks, ""], strict=True))
