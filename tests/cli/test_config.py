"""Defaults from palpate.toml and from the environment, words that were likely meant, and what a shell offers."""

import json
from pathlib import Path

import click
import pytest
from command_lines import commands, document, run
from palpate.cli import config
from palpate.cli.config import configurable_parameters
from palpate.cli.main import COMMANDS
from palpate.cli.paths import OUTPUT
from project import FOUR


@pytest.fixture(autouse=True)
def places(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[Path, Path]:
    """Name two files palpate.toml: the user's, and one in the working folder, which is empty."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(click, "get_app_dir", lambda name: str(tmp_path / "home" / name))
    (tmp_path / "home" / "palpate").mkdir(parents=True)
    assert config.config_paths()[1] == Path("palpate.toml")
    return config.config_paths()[0], tmp_path / "palpate.toml"


def scene(*arguments: str, **variables: str) -> str:
    return str(document("replay", FOUR, *arguments, **variables)["scene"])


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
    other.write_text(
        '[replay]\nset = ["false_alarm_interval=inf", "smallest_shift=1"]\nsamples = 80\n'
    )
    found = document("--config", other, "replay", FOUR)
    given = {
        "false_alarm_interval": "inf",
        "smallest_shift": 1.0,
        "samples": 80,
        "seconds": None,
    }
    assert (found["scene"], found["settings"]) == ("handheld", given)
    assert (
        json.loads(run("replay", FOUR, PALPATE_CONFIG=str(other), PALPATE_REPLAY_JSON="1").stdout)
        == found
    )


def test_a_command_of_a_group_has_a_table_and_variables(places: tuple[Path, Path]) -> None:
    user, here = places
    user.write_text("[kit.noise]\nreadings = 4\ncapf = [7]\n[kit.scan]\njson = true\n")
    here.write_text("[kit.noise]\ncapf = [1, 2]\n")

    def noise(*arguments: str, **variables: str) -> tuple[int, list[int]]:
        found = document("kit", "noise", "sim:", *arguments, **variables)
        return found["readings"], [row["capf"] for row in found["noise"]]

    assert noise() == (4, [1, 2])
    assert noise("--readings", "6", "--capf", "0", PALPATE_KIT_NOISE_READINGS="5") == (6, [0])
    assert noise(PALPATE_KIT_NOISE_READINGS="5", PALPATE_KIT_NOISE_CAPF="0 3") == (5, [0, 3])
    assert "inputs" in json.loads(run("kit", "scan", "sim:").stdout)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "[replay]\nscne = 1\n",
            "palpate.toml: [replay]: got 'scne', allowed: map, columns, pattern, unit",
        ),
        (
            "[relay]\nscene = 1\n",
            "palpate.toml: got 'relay', allowed: tables [live], [record], [replay]",
        ),
        ("record = 3\n", "got 'record', allowed: tables [live], [record], [replay]"),
        ("[replay\n", "palpate.toml: not TOML: "),
        ("[replay]\nsamples = 0\n", "0 is not in the range x>=1"),
        (
            f"[replay]\njobs = {'[' * 900}\n",
            "palpate.toml: not TOML: line 2: got more than 32 levels of dots and brackets, allowed: 32",
        ),
        (
            f"[replay]\njobs = 0x{'f' * 9000}\n",
            "palpate.toml: not TOML: line 2: got a number or name of 9,002 characters, allowed: 100",
        ),
        (
            "[kit.noise]\nreading = 4\n",
            "palpate.toml: [kit.noise]: got 'reading', allowed: source, firmware, capf",
        ),
    ],
)
def test_what_is_refused(places: tuple[Path, Path], text: str, message: str) -> None:
    places[1].write_text(text)
    result = run(*(["kit", "noise", "sim:"] if "[kit" in text else ["replay", FOUR]))
    assert (result.exit_code, result.stdout, message in result.stderr) == (2, "", True), (
        result.stderr
    )


def test_what_weakens_security_is_read_from_the_users_own_file(places: tuple[Path, Path]) -> None:
    user, here = places
    guarded = (
        "live no-token true",
        "live lsl 'lab'",
        "live record 'run.csv'",
        "live folder '/tmp'",
        "record lsl 'lab'",
        "calibrate plot 'fit.png'",
        "calibrate report 'fit.html'",
        "convert force true",
        "doctor install-udev true",
        "kit.noise firmware 'x.hex'",
    )
    for command, key, value in map(str.split, guarded):
        words = command.split(".")
        here.write_text(f"[{command}]\n{key} = {value}\n")
        refused, chosen = run(*words), run("--config", here, *words, "--nope")
        message = f"palpate.toml: [{command}]: {key}: got it in the working folder, allowed: --{key} in the command line, or"
        assert (
            refused.exit_code,
            f"{message} this key in {user}; see palpate --help" in refused.stderr,
        ) == (2, True)
        here.rename(user)
        assert "No such option '--nope'" in run(*words, "--nope").stderr
        assert "No such option '--nope'" in chosen.stderr
        user.unlink()
    here.write_text('[live]\nhost = "0.0.0.0"\n')
    assert "[live]: host: got it in the working folder" in run("live").stderr
    here.write_text('[record]\nsource = "lsl:lab"\n')
    message = "[record]: source: got it in the working folder, allowed: SOURCE in the command line"
    assert message in run("record", "-o", "run.csv").stderr


def test_where_a_command_writes_is_read_from_the_users_own_file() -> None:
    outputs = set()
    for _, command in commands():
        for key, parameter in configurable_parameters(command).items():
            if isinstance(parameter.type, type(OUTPUT)):
                outputs.add(key)
    assert outputs <= config.GUARDED, outputs - config.GUARDED
    assert outputs == {"record", "plot", "report"}


def test_where_defaults_are_from_is_printed_and_a_variable_of_no_option_is_refused(
    places: tuple[Path, Path],
) -> None:
    places[0].write_text('[replay]\nscene = "sliding"\n')
    result = run("replay", FOUR, PALPATE_REPLAY_JOBS="2")
    printed = [
        f"defaults of replay from {places[0]}: scene",
        "defaults of replay from the environment: jobs",
    ]
    assert result.stderr.splitlines()[:2] == printed
    result = run("replay", FOUR, PALPATE_REPLAY_SCNE="paper")
    assert "the environment: [replay]: got 'scne', allowed: map, " in result.stderr
    assert (result.exit_code, run("check", FOUR, PALPATE_REPLAY_SCNE="paper").exit_code) == (2, 0)
    assert run("kit", "scan", "sim:", PALPATE_KIT_NOISE_READING="5").exit_code == 2


@pytest.mark.parametrize("name", [" ".join(names) for names, _ in commands() if names])
def test_every_command_has_keys_a_short_help_and_an_example(name: str) -> None:
    command = dict(commands())[tuple(name.split())]
    assert ({"debug"} if isinstance(command, click.Group) else {"json", "debug"}) <= set(
        configurable_parameters(command)
    )
    long = [option for p in command.params for option in p.opts if option.startswith("--")]
    assert len(configurable_parameters(command)) >= len(long)
    if name in COMMANDS:
        assert command.get_short_help_str(limit=1000).rstrip(".") == COMMANDS[name].help.rstrip(".")
    assert (
        f"palpate {name}"
        in run(*name.split(), "--help").stdout.split("Example:\n")[1].split("Options:")[0]
    )


@pytest.mark.parametrize(
    ("arguments", "meant"),
    [
        (["relay"], "replay"),
        (["replay", FOUR, "--set", "smalest_shift=1"], "smallest_shift"),
        (["record", "sim:four-specimen", "-o", "x.csv"], "four-specimens"),
        (["colour"], ""),
    ],
)
def test_the_word_that_was_likely_meant(arguments: list[str], meant: str) -> None:
    result = run(*arguments)
    assert (result.exit_code, result.stdout, len(result.stderr.splitlines())) == (2, "", 1)
    assert (
        f"; did you mean {meant!r}? See palpate" if meant else "; see palpate"
    ) in result.stderr, result.stderr


def test_what_the_shell_offers() -> None:
    def offered(*words: str) -> list[str]:
        environment = {
            "_PALPATE_COMPLETE": "zsh_complete",
            "COMP_WORDS": " ".join(("palpate", *words)),
        }
        return run(**environment, COMP_CWORD=str(len(words))).stdout.split("\n")[1::3]

    assert offered("re") == ["record", "replay", "report"]
    assert offered("replay", str(FOUR), "--scene", "p") == ["paper"]
    assert offered("record", "s") == ["sim:", "serial:"]
    assert offered("record", "sim:step") == ["sim:step-up", "sim:step-down"]
    assert "_PALPATE_COMPLETE" in run(_PALPATE_COMPLETE="bash_source").stdout
