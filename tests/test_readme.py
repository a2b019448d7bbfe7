"""The README's commands and outputs are what they say."""

import re
import shlex
import subprocess
import sys
from pathlib import Path

from conftest import ROOT

README = (ROOT / "README.md").read_text()


def test_the_first_command_prints_what_the_readme_shows() -> None:
    command, shown = re.findall(r"```sh\n(.*?)\n```\n\n```text\n(.*?)```", README, re.DOTALL)[0]
    replay = shlex.split(command.split("&&")[-1])
    assert replay[0] == ".venv/bin/palpate"
    done = subprocess.run(
        [sys.executable, "-m", "palpate", *replay[1:]], capture_output=True, text=True, check=True, cwd=ROOT
    )
    assert done.stdout == shown


def test_the_way_to_a_modulus_prints_what_the_readme_shows(tmp_path: Path) -> None:
    commands, shown = re.findall(r"```sh\n(palpate simulate.*?)```\n\n```text\n(.*?)```", README, re.DOTALL)[0]
    program = f"{shlex.quote(sys.executable)} -m palpate"
    lines = [re.sub("^palpate", program, line) for line in commands.splitlines()]
    for line in lines[:-1]:
        subprocess.run(["bash", "-c", line], check=True, cwd=tmp_path, capture_output=True)
    done = subprocess.run(["bash", "-c", lines[-1]], check=True, cwd=tmp_path, capture_output=True, text=True)
    assert done.stdout == shown


def test_ci_runs_the_readmes_test_command() -> None:
    script = (ROOT / ".ci" / "run").read_text()
    extract = re.search(r"^command=\$\((.*)\)$", script, re.MULTILINE)
    assert extract
    done = subprocess.run(["bash", "-c", extract[1]], capture_output=True, text=True, check=True, cwd=ROOT)
    assert done.stdout.strip().endswith("&& .venv/bin/pytest")
    assert done.stdout.strip() in README
