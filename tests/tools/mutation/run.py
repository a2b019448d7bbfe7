"""Mutation score of the C++ headers: changes one operator or constant after another, and prints which changes no test detects.

    nice python tests/tools/mutation/run.py cpp [--count 100] [--seed 1] [--tests FOLDER...]

Works in a copy of the project, with one process. First all tests run once and record what each one executes. Then each
mutant runs the tests that execute it, the fastest first, until one fails that passes without the mutant. A test that does not end
fails. Needs libclang.
"""

import argparse
import json
import os
import random
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import headers

HERE = Path(__file__).parent
ROOT = HERE.parents[2]
PYTEST = [sys.executable, "-m", "pytest", "-q", "--tb=no", "-n0", "-p", "executed", "-p", "no:cacheprovider"]
# Those left out only compile the headers: headers.native_failure takes their place.
LEFT_OUT = ("test_native.py", "test_embedded.py")
TESTS = ["tests/core", "tests/binding", *(f"--ignore=tests/core/{name}" for name in LEFT_OUT)]
TESTS_S = 600
"""Duration without a mutant of all tests that a mutant may run, s."""


class Project:
    """A copy of the project with its tests, and what each test executes."""

    def __init__(self, copy: Path, tests: list[str]) -> None:
        ignored = shutil.ignore_patterns(".git", ".venv", ".*cache", "__pycache__", "build")
        shutil.copytree(ROOT, copy, symlinks=True, ignore=ignored)
        (copy / "python/palpate/include").unlink(missing_ok=True)
        (copy / "python/palpate/include").symlink_to("../../cpp/include")
        self.copy, self.build = copy, copy / "build"
        self.build.mkdir()
        (self.build / "executed").write_bytes(bytes(1 << 16))
        self.mutants = headers.rewrite(copy / "cpp" / "include")
        if not headers.build(copy):
            raise SystemExit("the headers with mutants do not compile")
        record = self.build / "record.json"
        self._pytest(tests, MUTATION_RECORD=record)
        recorded = json.loads(record.read_text()) if record.exists() else {}
        if not recorded:
            raise SystemExit((self.build / "said.txt").read_text())
        passed = {name: test for name, test in recorded.items() if test["passed"]}
        self.tests: dict[str, Any] = dict(sorted(passed.items(), key=lambda item: item[1]["s"]))

    def detecting(self, mutant: headers.Mutant) -> str:
        """Return the test that detects a mutant, or an empty text."""
        if by_switch := [name for name, test in self.tests.items() if mutant.number in test["mutants"]]:
            return self._failing(by_switch, mutant) or headers.native_failure(self.copy, mutant.number)
        # In a constant expression, or not executed: compiled for itself.
        if not (failed := headers.native_failure(self.copy, mutant.number)):
            failed = self._failing([*self.tests], mutant) if headers.build(self.copy, mutant.number) else "compiler"
            headers.build(self.copy)
        return failed

    def _failing(self, names: list[str], mutant: headers.Mutant) -> str:
        chosen, total = [], 0.0
        for name in names:
            total += self.tests[name]["s"]
            if total < TESTS_S:
                chosen.append(name)
        while chosen and (failed := self._run(chosen, mutant.number)):
            if not self._run([failed], -1):
                return failed
            chosen.remove(failed)  # it fails without the mutant, too
        return ""

    def _run(self, names: list[str], number: int) -> str:
        """Return the first of these tests that fails with a mutant, or an empty text."""
        limit_s = 60 + 10 * sum(self.tests[name]["s"] for name in names)
        if self._pytest(["-x", *names], limit_s, PALPATE_MUTANT=number) == 0:
            return ""
        said = (self.build / "said.txt").read_text()
        return next((name for name in names if f"FAILED {name}" in said), names[0])

    def _pytest(self, arguments: list[str], limit_s: float | None = None, **environment: Any) -> int | None:
        path = os.pathsep.join(map(str, (self.copy / "python", HERE)))
        environment |= {"PYTHONPATH": path, "PYTHONDONTWRITEBYTECODE": "1", "PALPATE_EXECUTED": self.build / "executed"}
        full = os.environ | {name: str(value) for name, value in environment.items()}
        with (self.build / "said.txt").open("w") as said:
            done = subprocess.Popen(
                [*PYTEST, *arguments], cwd=self.copy, env=full, stdout=said, stderr=said, start_new_session=True
            )
            try:
                return done.wait(limit_s)
            except subprocess.TimeoutExpired:
                os.killpg(done.pid, 9)
                done.wait()
                return None


def main() -> None:
    """Print each mutant with its fate, then the score."""
    parser = argparse.ArgumentParser(description="Mutation score of the headers.")
    parser.add_argument("kind", choices=["cpp"])
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--tests", nargs="*", default=TESTS, help="folders or options of pytest")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        project = Project(Path(folder) / "palpate", arguments.tests)
        count = min(arguments.count, len(project.mutants))
        chosen = random.Random(arguments.seed).sample(project.mutants, count)
        print(f"{len(chosen)} of {len(project.mutants)} mutants, {len(project.tests)} tests", flush=True)
        killed = 0
        for m in chosen:
            test = project.detecting(m)
            killed += bool(test)
            fate = "killed" if test else "survived"
            print(fate, f"{m.path}:{m.line}", m.change, m.source, test, sep="\t", flush=True)
    print(f"{killed} of {len(chosen)} detected")


if __name__ == "__main__":
    main()
