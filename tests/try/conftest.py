"""The core of docs/try, built once for all tests, and run in one process of node."""

import base64
import json
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import bundle
import pytest
from project import ROOT, kept_json, need

Ask = Callable[..., Any]


@pytest.fixture(scope="session")
def node(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Ask]:
    """Return a function: a request, to the answer of the core."""
    folder = tmp_path_factory.mktemp("core")
    made: str = kept_json(
        "palpate.wasm", (ROOT / "cpp", ROOT / "docs" / "try"), (need("clang++"),), _core
    )
    (folder / "palpate.wasm").write_bytes(base64.b64decode(made))
    bundle.scripts(folder)
    (folder / "package.json").write_text('{"type": "module"}')  # for node
    command = [need("node"), str(ROOT / "tests" / "try" / "core.mjs"), str(folder)]
    process = subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, encoding="utf-8"
    )

    def ask(do: str, **request: Any) -> Any:
        assert process.stdin
        assert process.stdout
        process.stdin.write(json.dumps({"do": do, **request}) + "\n")
        process.stdin.flush()
        answer = json.loads(process.stdout.readline())
        assert "broken" not in answer, answer["broken"]
        return answer

    yield ask
    process.communicate()


def _core(to: Path) -> None:
    need("wasm-ld")
    bundle.core(to)
    to.write_text(json.dumps(base64.b64encode(to.read_bytes()).decode()))
