"""Mutation score: changes one operator or constant after another, and prints which changes no test detects.

    nice python tests/tools/mutation/run.py cpp|python [--count 100] [--seed 1] [--like LOG] [--tests FOLDER...]

Works in a copy of the project, with one process. First all tests run once and record what each one executes. Then each
mutant runs the tests that execute it, the fastest first, until one fails that passes without the mutant. A test that does not end
fails. Needs libclang for `cpp`, coverage for `python`.
"""

import argparse
import json
import os
import random
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import modules

HERE = Path(__file__).parent
ROOT = HERE.parents[2]
PYTEST = [sys.executable, "-m", "pytest", "-q", "-n0", "-p", "executed", "-p", "no:cacheprovider"]
TESTS = {
    "python": ["tests"],
    # Those left out only compile the headers: headers.native_failure takes their place.
    "cpp": [
        "tests/core",
        "tests/binding",
        "--ignore=tests/core/test_native.py",
        "--ignore=tests/core/test_embedded.py",
    ],
}
TESTS_S = 600
"""Duration without a mutant of all tests that a mutant may run, s."""


@dataclass(frozen=True)
class Mutant:
    """A change of a file: its number among those of the headers, or the new text of the module."""

    path: str
    line: int
    change: str
    source: str
    number: int = -1
    text: bytes = b""


def of_headers(copy: Path) -> Iterator[Mutant]:
    """Rewrite the headers with all mutants in them, and compile the extension."""
    import headers

    include = copy / "cpp" / "include"
    sources = {path: path.read_text().splitlines() for path in include.rglob("*.hpp")}
    found = headers.rewrite(include)
    if not headers.build(copy):
        raise SystemExit("the headers with mutants do not compile")
    for number, (path, line, change) in enumerate(found):
        yield Mutant(
            str(path.relative_to(copy)), line, change, sources[path][line - 1].strip(), number
        )


def of_modules(copy: Path) -> Iterator[Mutant]:
    """Yield the mutants of the package."""
    for path in sorted((copy / "python/palpate").rglob("*.py")):
        text = path.read_bytes()
        for start, end, mutant in modules.changes(path):
            line = text.count(b"\n", 0, start) + 1
            written = text[start:end].decode()
            source = text.splitlines()[line - 1].decode().strip()
            made = text[:start] + mutant.encode() + text[end:]
            yield Mutant(
                str(path.relative_to(copy)),
                line,
                f"{written} -> {mutant or 'nothing'}",
                source,
                text=made,
            )


class Project:
    """A copy of the project with its tests, and what each test executes."""

    def __init__(self, copy: Path, kind: str, tests: list[str]) -> None:
        ignored = shutil.ignore_patterns(".git", ".venv", ".*cache", "__pycache__", "build")
        shutil.copytree(ROOT, copy, symlinks=True, ignore=ignored)
        (copy / "python/palpate/include").unlink(missing_ok=True)
        (copy / "python/palpate/include").symlink_to("../../cpp/include")
        self.copy = copy
        self.kind = kind
        self.build = copy / "build"
        self.build.mkdir()
        (self.build / "executed").write_bytes(bytes(1 << 16))
        self.mutants = list((of_headers if kind == "cpp" else of_modules)(copy))
        self._pytest(tests, None, MUTATION_RECORD=self.build / "record.json")
        recorded = json.loads((self.build / "record.json").read_text())
        self.lines: dict[str, dict[str, list[str]]] = recorded["lines"]
        if not recorded["tests"]:
            raise SystemExit((self.build / "said.txt").read_text())
        passed = {name: test for name, test in recorded["tests"].items() if test["passed"]}
        self.tests: dict[str, Any] = dict(sorted(passed.items(), key=lambda item: item[1]["s"]))

    def detecting(self, mutant: Mutant) -> str:
        """Return the test that detects a mutant, or an empty text."""
        if self.kind == "python":
            lines = self.lines.get(mutant.path, {})
            by_line = {name for name in lines.get(str(mutant.line), []) if name}
            # A line that an import executes: all tests of its module.
            return self._failing(
                by_line or {name for names in lines.values() for name in names}, mutant
            )
        import headers

        if by_switch := {
            name for name, test in self.tests.items() if mutant.number in test["mutants"]
        }:
            return self._failing(by_switch, mutant) or headers.native_failure(
                self.copy, mutant.number
            )
        # In a constant expression, or not executed: compiled for itself.
        if not (failed := headers.native_failure(self.copy, mutant.number)):
            if headers.build(self.copy, mutant.number):
                failed = self._failing(set(self.tests), mutant)
            else:
                failed = "compiler"
            headers.build(self.copy)
        return failed

    def _failing(self, names: set[str], mutant: Mutant) -> str:
        chosen = []
        total = 0.0
        for name in (name for name in self.tests if name in names):
            total += self.tests[name]["s"]
            if total < TESTS_S:
                chosen.append(name)
        path = self.copy / mutant.path
        original = path.read_bytes()
        while chosen:
            path.write_bytes(mutant.text or original)
            failed = self._run(chosen, mutant.number)
            path.write_bytes(original)
            if not failed or not self._run([failed], -1):
                return failed
            chosen.remove(failed)  # it fails without the mutant, too
        return ""

    def _run(self, names: list[str], number: int) -> str:
        """Return the first of these tests that fails with a mutant of the headers, or an empty text."""
        run = self.build / "run.json"
        run.write_text(json.dumps(names))
        run.with_suffix(".failed").unlink(missing_ok=True)
        limit_s = 60 + 10 * sum(self.tests[name]["s"] for name in names)
        files = sorted({name.partition("::")[0] for name in names})
        code = self._pytest(["-x", *files], limit_s, MUTATION_RUN=run, PALPATE_MUTANT=number)
        failed = run.with_suffix(".failed")
        return "" if code == 0 else failed.read_text() if failed.exists() else names[0]

    def _pytest(
        self, arguments: list[str], limit_s: float | None, **environment: Any
    ) -> int | None:
        path = os.pathsep.join(map(str, (self.copy / "python", HERE)))
        environment |= {"PYTHONPATH": path, "PYTHONDONTWRITEBYTECODE": "1"}
        if self.kind == "cpp":
            environment["PALPATE_EXECUTED"] = self.build / "executed"
        full = os.environ | {name: str(value) for name, value in environment.items()}
        with (self.build / "said.txt").open("w") as said:
            done = subprocess.Popen(
                [*PYTEST, *arguments],
                cwd=self.copy,
                env=full,
                stdout=said,
                stderr=said,
                start_new_session=True,
            )
            try:
                return done.wait(limit_s)
            except subprocess.TimeoutExpired:
                os.killpg(done.pid, 9)
                done.wait()
                return None


def drawn(mutants: list[Mutant], count: int, seed: int, like: Path | None) -> list[Mutant]:
    """Return mutants at random, or those of a log whose line still exists somewhere."""
    if like is None:
        return random.Random(seed).sample(mutants, min(count, len(mutants)))
    logged = [tuple(line.split("\t")[2:4]) for line in like.read_text().splitlines()]
    same = {(m.change, m.source): m for m in mutants}
    return [same[key] for key in logged if key in same]


def main() -> None:
    """Print each mutant with its fate, then the score."""
    parser = argparse.ArgumentParser(
        description="Mutation score of the headers or the Python package."
    )
    parser.add_argument("kind", choices=TESTS)
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--like", type=Path, help="a log: run its mutants again")
    parser.add_argument(
        "--tests", nargs="*", help="folders or options of pytest; default: those of the kind"
    )
    arguments = parser.parse_args()
    tests = arguments.tests or TESTS[arguments.kind]
    with tempfile.TemporaryDirectory() as folder:
        project = Project(Path(folder) / "palpate", arguments.kind, tests)
        chosen = drawn(project.mutants, arguments.count, arguments.seed, arguments.like)
        print(
            f"{len(chosen)} of {len(project.mutants)} mutants, {len(project.tests)} tests",
            flush=True,
        )
        killed = 0
        for m in chosen:
            test = project.detecting(m)
            killed += bool(test)
            print(
                "killed" if test else "survived",
                f"{m.path}:{m.line}",
                m.change,
                m.source,
                test,
                sep="\t",
                flush=True,
            )
    print(f"{killed} of {len(chosen)} detected")


if __name__ == "__main__":
    main()
