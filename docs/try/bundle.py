"""The page as one HTML file that needs nothing else: `python docs/try/bundle.py palpate-try.html`.

It needs esbuild, clang 14 or newer with wasm-ld, and the C and C++ libraries of WASI; docs/try.md names the packages of Debian.
The same sources give the same bytes.
"""

import base64
import gzip
import hashlib
import json
import re
import shutil
import subprocess
import sys
import tempfile
from itertools import compress
from pathlib import Path
from typing import Any

from palpate import Tracker
from palpate.ad7746.registers import (
    CODES_PER_PF,
    SATURATED_PF,
    ZERO_CODE,
    linearity_pF,
)
from palpate.recording.rows import COLUMNS, EARLIER
from palpate.recording.sidecar import SCHEMAS

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
PAGE = ROOT / "python" / "palpate" / "live" / "page"
MOST_BYTES = 200_000
"""A page that is larger is not written."""


def core(to: Path) -> None:
    """Write the core, a module of WebAssembly; with these flags any program of the headers has the bits of every other target."""
    flags = [
        "--target=wasm32-wasi",
        "-std=c++17",
        "-Oz",
        "-fno-exceptions",
        "-fno-rtti",
        "-ffp-contract=off",
    ]
    more = [
        "-mexec-model=reactor",
        "-DPALPATE_CONTRACTION_OFF",
        f"-I{ROOT / 'cpp' / 'include'}",
        "-Wl,--strip-all",
    ]
    _run("clang++", *flags, *more, ROOT / "cpp" / "wasm" / "palpate.cpp", "-o", to)


def scripts(folder: Path) -> None:
    """Write the scripts of this folder and the live page's, and what they are given by palpate as data."""
    shutil.copytree(PAGE, folder / "page", dirs_exist_ok=True)
    for path in (*HERE.glob("*.js"), *HERE.glob("*.css")):
        shutil.copy(path, folder)
    (folder / "given.js").write_text(
        f"export const GIVEN = {json.dumps(_given())};\n", encoding="utf-8"
    )


def demo(folder: Path) -> None:
    """Write the recording that the page shows first."""
    _run(
        sys.executable,
        "-m",
        "palpate",
        "simulate",
        "-o",
        folder,
        "--object",
        "demo=2.18",
        "--touches",
        2,
        "--seed",
        22,
    )


def page() -> bytes:
    """Return the page."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        core(folder / "palpate.wasm")
        scripts(folder)
        demo(folder / "demo")
        rows = folder / "demo.rows"
        rows.write_text(without_capacitances(folder / "demo" / "demo.csv"), encoding="ascii")
        for path in (folder / "palpate.wasm", rows, folder / "demo" / "demo.json"):
            (folder / f"{path.name}.gz").write_bytes(gzip.compress(path.read_bytes(), 9, mtime=0))
        script = _bundled(
            folder / "try.js", "--format=iife", "--loader:.gz=binary", "--target=es2022"
        )
        style = _bundled(folder / "try.css")
    text = (HERE / "index.html").read_text(encoding="utf-8")
    live = (PAGE / "index.html").read_text(encoding="utf-8")
    for empty, tag, name in re.findall(r'(<(section|dialog|div) id="(\w+)"></\w+>)', text):
        text = text.replace(empty, part_of(live, tag, name))
    style = without_unused(style, text, script)
    policy = (  # it runs its own script, the core, and its own style; no request leaves it
        f"default-src 'none'; script-src {_hash(script)} 'wasm-unsafe-eval'; style-src {_hash(style)}; img-src data:; "
        "base-uri 'none'; form-action 'none'"
    )
    icon = base64.b64encode((PAGE / "icon.svg").read_bytes()).decode()
    head = f'<meta http-equiv="Content-Security-Policy" content="{policy}">\n<link rel="icon" href="data:image/svg+xml;base64,{icon}">'
    text = text.replace('<link rel="stylesheet" href="try.css">', f"{head}\n<style>{style}</style>")
    return text.replace('<script src="try.js"></script>', f"<script>{script}</script>").encode()


def without_capacitances(path: Path) -> str:
    """Return the rows of a recording without the columns that follow from its codes; try.js puts them back."""
    head, *lines = path.read_text(encoding="ascii").splitlines()
    is_kept = [not name.endswith("_pF") for name in head.split(",")]
    rows = []
    for line in lines:
        rows.append(",".join(compress(line.split(","), is_kept)))
    return "\n".join(rows)


def without_unused(style: str, page: str, script: str) -> str:
    """Return a minified style sheet without selectors of ids that the page lacks, and of classes that script and page lack."""

    def used(rule: re.Match[str]) -> str:
        kept = []
        for selector in re.split(r",(?![^(]*\))", rule[1]):
            if _is_used(selector, page, script):
                kept.append(selector)
        if not kept:
            return ""
        return f"{','.join(kept)}{{{rule[2]}}}"

    return re.sub(r"([^{}@;]+)\{([^{}]*)\}", used, style)


def _is_used(selector: str, page: str, script: str) -> bool:
    """Return whether a page has a place for a selector; what is in parentheses does not count."""
    before = ""
    outside = selector
    while outside != before:
        before = outside
        outside = re.sub(r"\([^()]*\)", "", outside)
    for name in re.findall(r"#([\w-]+)", outside):
        if f'id="{name}"' not in page:
            return False
    for name in re.findall(r"\.([a-z][\w-]*)", outside):
        if not re.search(rf"\b{name}\b", page + script):
            return False
    return True


def part_of(page: str, tag: str, name: str) -> str:
    """Return the element of a page that has this tag and id, with all that is in it."""
    begin = page.index(f'<{tag} id="{name}"')
    depth = 0
    for edge in re.finditer(rf"<(/?){tag}\b", page[begin:]):
        if edge[1]:
            depth -= 1
        else:
            depth += 1
        if depth == 0:
            return page[begin : begin + edge.end()] + ">"
    raise RuntimeError(f"{name}: got no end of <{tag}>, allowed: as many ends as beginnings")


def _given() -> dict[str, Any]:
    scenes = {}
    for scene in ("handheld", "sliding"):
        scenes[scene] = dict(Tracker(scene).settings)
        scenes[scene].pop("full_scale", None)
    return {
        "scenes": scenes,
        "threshold": Tracker("handheld").threshold,
        "headers": [",".join(COLUMNS), ",".join(EARLIER)],
        "schemas": SCHEMAS,
        "codes": {"zero": ZERO_CODE, "per_pF": CODES_PER_PF},
        "full_scale_pF": SATURATED_PF,
        "linearity_pF": linearity_pF(SATURATED_PF),
    }


def _bundled(path: Path, *options: str) -> str:
    """Return a module or a style sheet with all that it imports."""
    return _run(
        "esbuild", path, "--bundle", "--minify", "--charset=utf8", "--log-level=warning", *options
    )


def _run(program: str, *given: Any) -> str:
    if shutil.which(program) is None:
        raise RuntimeError(f"{program}: not found; docs/try.md says what to install")
    done = subprocess.run(
        [program, *map(str, given)], capture_output=True, encoding="utf-8", check=False
    )
    if done.returncode:
        raise RuntimeError(f"{program}: {done.stderr.strip()}")
    return done.stdout


def _hash(text: str) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"


def main() -> None:
    """Write the page."""
    if len(sys.argv) != 2 or not sys.argv[1].endswith(".html"):
        sys.exit("usage: python docs/try/bundle.py FILE.html")
    try:
        made = page()
    except RuntimeError as error:
        sys.exit(f"Error: {error}")
    if len(made) > MOST_BYTES:
        sys.exit(f"Error: {sys.argv[1]}: got {len(made)} bytes, allowed: {MOST_BYTES}")
    Path(sys.argv[1]).write_bytes(made)
    print(f"{sys.argv[1]}: {len(made):,} bytes")


if __name__ == "__main__":
    main()
