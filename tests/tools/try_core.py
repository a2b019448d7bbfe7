"""The core of docs/try, built once for all tests, and run in node."""

import base64
import json
import subprocess
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from build_core import module, scripts
from kept import kept_json
from numpy.typing import NDArray
from palpate.live.feed import FIELDS, ROW
from project import ROOT, need

COLUMNS = ("t", "hard", "soft", "ratio", "error", "statistic")
"""Those of `FIELDS`, as the page names them."""
_DRIVER = ROOT / "tests" / "tools" / "try_core.mjs"
_INPUTS = (ROOT / "cpp", ROOT / "docs" / "try")


def built(folder: Path) -> Path:
    """Build the core into a folder; its module only if its sources have changed."""
    for tool in ("clang++", "wasm-ld"):
        need(tool)
    made: str = kept_json("palpate.wasm", _INPUTS, (need("clang++"),), _module)
    (folder / "palpate.wasm").write_bytes(base64.b64decode(made))
    scripts(folder)
    (folder / "package.json").write_text('{"type": "module"}')  # for node
    return folder


def _module(to: Path) -> None:
    module(to)
    to.write_text(json.dumps(base64.b64encode(to.read_bytes()).decode()))


class Node:
    """The core in one process of node."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        command = [need("node"), str(_DRIVER), str(folder)]
        self._process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, encoding="utf-8"
        )

    def ask(self, do: str, **request: Any) -> Any:
        """Return the answer to a request."""
        assert self._process.stdin
        assert self._process.stdout
        self._process.stdin.write(json.dumps({"do": do, **request}) + "\n")
        self._process.stdin.flush()
        answer = json.loads(self._process.stdout.readline())
        assert "broken" not in answer, answer["broken"]
        return answer

    def open(self, *files: tuple[str, bytes]) -> Any:
        """Return what the core makes of dropped files."""
        told = [{"name": name, "base64": base64.b64encode(data).decode()} for name, data in files]
        return self.ask("open", files=told)

    def open_paths(self, *paths: Path) -> Any:
        """As `open`, of those files that exist."""
        return self.open(*((path.name, path.read_bytes()) for path in paths if path.exists()))

    def close(self) -> None:
        """End the process."""
        self._process.communicate()


def rows_in(blocks: Iterable[dict[str, Any]]) -> NDArray[np.void]:
    """Return the rows of blocks as the live page's server has them: dtype `ROW`."""
    parts = []
    for block in blocks:
        rows = np.zeros(block["end"], ROW)
        for name, field in zip(COLUMNS, FIELDS, strict=True):
            rows[field] = np.frombuffer(base64.b64decode(block[name]), "<f8")
        rows["flags"] = np.frombuffer(base64.b64decode(block["flags"]), "u1")
        parts.append(rows)
    return np.concatenate([np.zeros(0, ROW), *parts])


def bits(rows: NDArray[np.void]) -> bytes:
    """Return rows as bytes; every nan has the same."""
    plain = rows.copy()
    for name in FIELDS:
        plain[name][np.isnan(plain[name])] = np.nan
    return plain.tobytes()
