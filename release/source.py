"""Makes the source distribution of a release: `python -m release.source FOLDER [ADDRESS]`.

It is the last commit, with the links of README.md as full addresses. The wheels are built from it, so their pages have
the same links. ADDRESS stands in for that of pyproject.toml in a rehearsal.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

from release.project import ROOT, NotReadyError, address, pyproject, version
from release.readme import absolute


def tree(target: Path, source: str) -> None:
    """Put the files of the last commit in `target`, with README.md as the package's page needs it."""
    archive = subprocess.run(["git", "archive", "HEAD"], cwd=ROOT, stdout=subprocess.PIPE, check=True)
    subprocess.run(["tar", "-x", "-C", target], input=archive.stdout, check=True)
    readme = target / "README.md"
    text = readme.read_text(encoding="utf-8")
    readme.write_text(absolute(text, source, f"v{version(target)}", target), encoding="utf-8")
    if "Source" not in pyproject(target)["project"]["urls"]:  # a rehearsal
        file = target / "pyproject.toml"
        text = file.read_text(encoding="utf-8")
        file.write_text(text.replace("[project.urls]\n", f'[project.urls]\nSource = "{source}"\n'), encoding="utf-8")


def main(folder: str, *rehearsal: str) -> None:
    """Make it in `folder`."""
    try:
        source = rehearsal[0] if rehearsal else address()
    except NotReadyError as error:
        sys.exit(f"error: {error}")
    with tempfile.TemporaryDirectory() as name:
        tree(Path(name), source)
        build = [sys.executable, "-m", "build", "--sdist", "--outdir", str(Path(folder).resolve()), name]
        subprocess.run(build, check=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
