"""Defaults from palpate.toml and from the environment; completion."""

import json
import os
import subprocess
import sys
from importlib import import_module
from keyword import iskeyword
from pathlib import Path

import click
import pytest
from click.testing import CliRunner, Result
from palpate.cli import COMMANDS, config, main
from palpate.cli.config import keys
from palpate.cli.kit import COMMANDS as OF_KIT
from project import ROOT, need

SHORT_HELPS = {**COMMANDS, **{f"kit {name}": text for name, text in OF_KIT.items()}}
FOUR = ROOT / "tests" / "data" / "four-specimens.csv"


def run(*arguments: str | Path, **variables: str) -> Result:
    return CliRunner().invoke(main, [str(a) for a in arguments], env=variables)


@pytest.fixture
def places(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[Path, Path]:
    """Name the user's palpate.toml and that of the working folder."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(click, "get_app_dir", lambda name: str(tmp_path / "home" / name))
    (tmp_path / "home" / "palpate").mkdir(parents=True)
    assert config.places()[1] == Path("palpate.toml")
    return config.places()[0], tmp_path / "palpate.toml"


def scene(*arguments: str, **variables: str) -> str:
    result = run("replay", FOUR, "--json", *arguments, **variables)
    assert result.exit_code in (0, 5), result.stderr
    return str(json.loads(result.stdout)["scene"])


def test_the_nearer_wins(places: tuple[Path, Path], tmp_path: Path) -> None:
    user, here = places
    assert scene() == "handheld"
    user.write_text('[replay]\nscene = "sliding"\n')
    assert scene() == "sliding"
    here.write_text('[replay]\nscene = "paper"\n[record]\ntouches = 3\n')
    assert scene() == "paper"
    assert scene(PALPATE_REPLAY_SCENE="sliding") == "sliding"
    assert scene("--scene", "handheld", PALPATE_REPLAY_SCENE="sliding") == "handheld"
    other = tmp_path / "other.toml"
    other.write_text('[replay]\nset = ["threshold=inf", "drift=0.5"]\nsamples = 80\n')
    result = run("--config", other, "replay", FOUR, "--json")
    document = json.loads(result.stdout)
    assert (document["scene"], document["settings"]) == (
        "handheld",
        {"threshold": "inf", "drift": 0.5, "samples": 80, "seconds": None},
    )
    assert json.loads(run("replay", FOUR, PALPATE_CONFIG=str(other), PALPATE_REPLAY_JSON="1").stdout) == document


def test_a_command_of_a_group_has_a_table_and_variables(places: tuple[Path, Path]) -> None:
    user, here = places
    user.write_text("[kit.noise]\nreadings = 4\ncapf = [7]\n[kit.scan]\njson = true\n")
    here.write_text("[kit.noise]\ncapf = [1, 2]\n")

    def noise(*arguments: str, **variables: str) -> tuple[int, list[int]]:
        result = run("kit", "noise", "sim:", "--json", *arguments, **variables)
        document = json.loads(result.stdout)
        return document["readings"], [row["capf"] for row in document["noise"]]

    assert noise() == (4, [1, 2])
    assert noise(PALPATE_KIT_NOISE_READINGS="5") == (5, [1, 2])
    assert noise("--readings", "6", "--capf", "0", PALPATE_KIT_NOISE_READINGS="5") == (6, [0])
    assert "inputs" in json.loads(run("kit", "scan", "sim:").stdout)
    refused = run("kit", "noise", "sim:", PALPATE_KIT_NOISE_READING="5")
    assert (refused.exit_code, "got PALPATE_KIT_NOISE_READING, allowed: " in refused.stderr) == (2, True)
    wrong = run("kit", "noise", "sim:", PALPATE_KIT_NOISE_READINGS="1")
    assert "(defaults: " in wrong.stderr
    here.write_text("[kit.noise]\nreading = 4\n")
    assert "palpate.toml: [kit.noise]: got 'reading', allowed: source, firmware, capf" in run("kit", "noise").stderr
    here.write_text("[kit]\nreadings = 4\n")
    assert "palpate.toml: [kit]: got 'readings', allowed: debug, accept, noise" in run("kit", "noise").stderr


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "[replay]\nscne = 1\n",
            "palpate.toml: [replay]: got 'scne', allowed: map, unit, time-unit, rate, decimal, soft, part, scene, touch-seconds, samples, set",
        ),
        ("[relay]\nscene = 1\n", "palpate.toml: got 'relay', allowed: tables [live], [record], [replay]"),
        ('scene = "paper"\n', "palpate.toml: got 'scene', allowed: tables [live], [record]"),
        ("[replay]\nscene = {a = 1}\n", "palpate.toml: [replay]: scene: got a table"),
        ("[replay\n", "palpate.toml: not TOML: "),
        ("[replay]\nsamples = 0\n", "0 is not in the range x>=1 (defaults: palpate.toml)"),
        (
            '[replay]\nscene = "moon"\n',
            "scene: got 'moon', allowed: fixed, paper, handheld, sliding (defaults: palpate.toml)",
        ),
    ],
)
def test_what_is_refused(places: tuple[Path, Path], text: str, message: str) -> None:
    places[1].write_text(text)
    result = run("replay", FOUR)
    assert (result.exit_code, result.stdout) == (2, "")
    assert message in result.stderr
    told = [
        line for line in result.stderr.splitlines() if not line.startswith("defaults of replay from palpate.toml: ")
    ]
    assert len(told) == 1


def test_what_is_taken_from_a_file_is_said(places: tuple[Path, Path]) -> None:
    user, here = places
    user.write_text('[replay]\nscene = "sliding"\n')
    here.write_text("[replay]\nsamples = 100\n[check]\nrepair = true\n")
    assert run("replay", FOUR).stderr == f"defaults of replay from {user}, palpate.toml: scene, samples\n"


def test_a_variable_of_no_option_is_refused(places: tuple[Path, Path]) -> None:
    result = run("replay", FOUR, PALPATE_REPLAY_SCNE="paper")
    assert result.exit_code == 2
    assert "got PALPATE_REPLAY_SCNE, allowed: PALPATE_REPLAY_CALIBRATION" in result.stderr
    assert run("check", FOUR, PALPATE_REPLAY_SCNE="paper").exit_code == 0


def command_of(path: str) -> click.Command:
    found: click.Command = main
    for name in path.split():
        assert isinstance(found, click.Group)
        inner = found.get_command(click.Context(found), name)
        assert inner is not None
        found = inner
    return found


@pytest.mark.parametrize("name", SHORT_HELPS)
def test_every_option_has_a_name_of_its_own(name: str) -> None:
    command = command_of(name)
    assert {"debug"} if isinstance(command, click.Group) else {"json", "debug"} <= set(keys(command))
    long = [option for p in command.params for option in p.opts if option.startswith("--")]
    assert len(keys(command)) >= len(long)


@pytest.mark.parametrize("name", SHORT_HELPS)
def test_help_has_the_short_help_of_the_list_and_an_example(name: str) -> None:
    result = run(*name.split(), "--help")
    assert result.exit_code == 0
    where = f"palpate.cli.{name.replace(' ', '.')}" + ("_" if iskeyword(name) else "")
    command = getattr(import_module(where), where.split(".")[-1])
    assert command.get_short_help_str(limit=1000).rstrip(".") == SHORT_HELPS[name].rstrip(".")
    assert f"palpate {name}" in result.stdout.split("Example:\n")[1].split("Options:")[0]


def complete(words: str, folder: Path, program: str = "bash") -> list[str]:
    """Return what bash offers for the last of some words."""
    bash = need(program)
    stub = folder / "palpate"
    stub.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m palpate "$@"\n')
    stub.chmod(0o755)
    listed = " ".join(f"'{word}'" for word in words.split(" "))
    code = f"""
eval "$(palpate completion bash)"
compopt() {{ printf '%s\\n' "$1 $2"; }}
COMP_WORDS=({listed}); COMP_CWORD=$((${{#COMP_WORDS[@]}} - 1)); COMPREPLY=()
_palpate_completion palpate
printf '%s\\n' "${{COMPREPLY[@]}}"
"""
    path = {"PATH": f"{folder}:{os.environ['PATH']}"}
    done = subprocess.run([bash, "-c", code], capture_output=True, text=True, check=True, env={**os.environ, **path})
    return done.stdout.splitlines()


def test_bash_completes_commands_options_and_sources(tmp_path: Path) -> None:
    assert complete("palpate re", tmp_path) == ["record", "replay", "report"]
    assert "--touches" in complete("palpate record --t", tmp_path)
    assert complete("palpate record s", tmp_path) == ["sim:", "serial:"]
    assert complete("palpate record sim : st", tmp_path) == ["stiff-steady", "step-up", "step-down", "strong-tremor"]
    assert "four-specimens" in complete("palpate record sim :", tmp_path)
    assert complete("palpate replay run", tmp_path) == ["-o default", ""]
    assert complete("palpate replay run.csv --set thr", tmp_path) == ["threshold=10.0"]
    assert complete("palpate replay run.csv --set threshold =", tmp_path) == ["10.0"]
    assert complete("palpate replay run.csv --scene = pa", tmp_path) == ["paper"]


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_each_shell_has_a_script(shell: str) -> None:
    text = run("completion", shell).stdout
    assert "_PALPATE_COMPLETE" in text
    document = json.loads(run("completion", shell, "--json").stdout)
    assert document["script"] == text.removesuffix("\n")
    assert "palpate completion" in document["use"]
    assert run("completion", "tcsh").exit_code == 2


def test_a_wrong_value_of_the_environment_is_not_blamed_on_the_file_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("palpate.toml").write_text('[replay]\nset = ["threshold=6"]\n')
    Path("run.csv").write_text("hard,soft\n1,2\n")
    monkeypatch.setenv("PALPATE_REPLAY_SCENE", "foo")
    told = CliRunner().invoke(main, ["replay", "run.csv"]).stderr
    assert "(defaults: palpate.toml, PALPATE_REPLAY_SCENE)" in told
