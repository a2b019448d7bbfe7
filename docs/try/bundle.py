"""The page of `docs/try` as one HTML file that needs nothing else: `python docs/try/bundle.py palpate-try.html`.

esbuild puts the modules together; the script goes in packed, and a browser unpacks it. The same sources give the same
bytes.
"""

import base64
import gzip
import hashlib
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from build_core import build

HERE = Path(__file__).parent
PAGE = HERE.parents[1] / "python" / "palpate" / "live" / "page"
MOST_BYTES = 150_000
"""A page that is larger is not written."""


def bundle(out: Path) -> int:
    """Write the page.

    Parameters
    ----------
    out : pathlib.Path
        A file that ends in ".html"; it is replaced.

    Returns
    -------
    int
        Its size, bytes.

    Raises
    ------
    RuntimeError
        A program that it needs is missing or failed, or the page is too large.
    """
    if shutil.which("esbuild") is None:
        raise RuntimeError("esbuild: not found; install it, on Debian: apt install esbuild")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        build(folder)
        page = _page(folder)
    if len(page) > MOST_BYTES:
        raise RuntimeError(f"{out.name}: got {len(page)} bytes, allowed: {MOST_BYTES}")
    out.parent.mkdir(parents=True, exist_ok=True)
    out.write_bytes(page)
    return len(page)


def _page(folder: Path) -> bytes:
    for path in [*HERE.glob("*.js"), *HERE.glob("*.css")]:
        shutil.copy(path, folder)
    shutil.copytree(PAGE, folder / "page", dirs_exist_ok=True)
    (folder / "palpate.wasm.gz").write_bytes(_packed((folder / "palpate.wasm").read_bytes()))
    script = _bundled(folder / "try.js", "--format=iife", "--loader:.gz=binary", "--target=es2022")
    unpack = _bundled(folder / "unpack.js", "--format=iife", "--target=es2020")
    style = _bundled(folder / "try.css")
    icon = base64.b64encode((PAGE / "icon.svg").read_bytes()).decode()
    head = (
        f'<meta http-equiv="Content-Security-Policy" content="{_policy([unpack, script], style)}">\n'
        f'<link rel="icon" href="data:image/svg+xml;base64,{icon}">\n<style>{style}</style>'
    )
    text = (HERE / "index.html").read_text(encoding="utf-8")
    for place, inner in {
        '<link rel="stylesheet" href="try.css">': head,
        '<script src="try.js"></script>': _scripts(unpack, script),
    }.items():
        before, found, after = text.partition(place)
        assert found, place
        text = before + inner + after
    return text.encode()


def _bundled(path: Path, *options: str) -> str:
    """Return a module or a style sheet with all that it imports."""
    command = ["esbuild", path.name, "--bundle", "--minify", "--charset=utf8", "--log-level=warning", *options]
    done = subprocess.run(command, cwd=path.parent, capture_output=True, encoding="utf-8", check=False)
    if done.returncode or done.stderr:
        raise RuntimeError(f"esbuild {path.name}: {done.stderr.strip()}")
    assert not re.search("</(script|style)", done.stdout, re.IGNORECASE)
    return done.stdout


def _packed(content: bytes) -> bytes:
    return gzip.compress(content, 9, mtime=0)


def _scripts(unpack: str, script: str) -> str:
    """Return the script of the page, packed, and the one that unpacks it."""
    packed = base64.b64encode(_packed(script.encode())).decode()
    return f'<script type="text/plain" id="packed">{packed}</script>\n<script>{unpack}</script>'


def _policy(scripts: list[str], style: str) -> str:
    """Return what the page may do: run its own scripts, the core, and its own style. No request leaves it."""
    own = " ".join(map(_hash, scripts))
    return (
        f"default-src 'none'; script-src {own} 'wasm-unsafe-eval'; style-src {_hash(style)}; img-src data:; "
        "base-uri 'none'; form-action 'none'"
    )


def _hash(text: str) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"


if __name__ == "__main__":
    if len(sys.argv) != 2 or not sys.argv[1].endswith(".html"):
        sys.exit("usage: python docs/try/bundle.py FILE.html")
    try:
        print(f"{sys.argv[1]}: {bundle(Path(sys.argv[1])):,} bytes")
    except RuntimeError as error:
        sys.exit(f"Error: {error}")
