"""Pictures of the site, light and dark, desk and phone: `python tests/tools/docs_pictures.py FOLDER [PAGE...]`.

The site is built into build/docs first. Default pages: how it works, three of the API, the index of questions, the glossary.
"""

import subprocess
import sys
from pathlib import Path

from project import ROOT
from site_browser import SIZES, site_browser

PAGES = ("how", "api/palpate.Tracker", "api/palpate.touches", "api/palpate.Stream", "howdoi", "glossary")


def main(folder: Path, pages: tuple[str, ...]) -> None:
    """Write the pictures."""
    built = ROOT / "build" / "docs"
    subprocess.run([sys.executable, "-m", "sphinx", "-W", "-q", str(ROOT / "docs"), str(built)], check=True)
    folder.mkdir(parents=True, exist_ok=True)
    with site_browser(built, folder) as site:
        for size, (width, height) in SIZES.items():
            site.sized(width, height)
            for scheme in ("light", "dark"):
                site.coloured(scheme)
                for page in pages:
                    site.open(f"{page}.html")
                    site.settled()
                    site.shoot(folder / f"{Path(page).name.removeprefix('palpate.')}-{size}-{scheme}.png")


if __name__ == "__main__":
    main(Path(sys.argv[1]), tuple(sys.argv[2:]) or PAGES)
