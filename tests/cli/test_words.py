"""Words that are not allowed: the message has the one that was likely meant; and the words that the shell offers."""

from pathlib import Path

import pytest
from click.testing import CliRunner, Result
from palpate import errors
from palpate.cli import main
from project import ROOT

FOUR = str(ROOT / "tests" / "data" / "four-specimens.csv")


@pytest.fixture(autouse=True)
def _empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def run(*arguments: str, **environment: str) -> Result:
    return CliRunner(env=environment).invoke(main, arguments)


@pytest.mark.parametrize(
    ("arguments", "meant"),
    [
        (["relay"], "replay"),
        (["kit", "skan"], "scan"),
        (["replay", "--scne", "paper", FOUR], "--scene"),
        (["--verion"], "--version"),
        (["replay", FOUR, "--set", "treshold=6"], "threshold"),
        (["replay", FOUR, "--scene", "handhled"], "handheld"),
        (["replay", FOUR, "--unit", "PF"], "pF"),
        (["replay", FOUR, "--map", "hard=hard_pF,soft=sof_pF"], "soft_pF"),
        (["replay", FOUR, "--decimal", "coma"], "comma"),
        (["record", "sim:four-specimen", "-o", "x.csv"], "four-specimens"),
        (["record", "sim:?sed=1", "-o", "x.csv"], "seed"),
        (["record", "simu:", "-o", "x.csv"], "sim:"),
        (["bench", "--scenario", "tremr"], "tremor"),
        (["calibrate", FOUR, "--moduli", FOUR, "-o", "p.toml", "--accept", "saturatd"], "saturated"),
        (["kit", "accept", "sim:", "--skip", "capdack"], "capdac"),
        (["completion", "bsh"], "bash"),
    ],
)
def test_the_word_that_was_likely_meant(arguments: list[str], meant: str) -> None:
    result = run(*arguments)
    assert (result.exit_code, result.stdout) == (2, "")
    assert len(result.stderr.splitlines()) == 1
    assert f"; did you mean {meant!r}? See palpate" in result.stderr, result.stderr


@pytest.mark.parametrize(
    ("text", "meant"),
    [("[replay]\nscne = 1\n", "scene"), ("[relay]\n", "replay"), ("[kit.noise]\nround = 2\n", "rounds")],
)
def test_a_key_of_the_file_that_was_likely_meant(text: str, meant: str) -> None:
    Path("palpate.toml").write_text(text)
    result = run(*(["kit", "noise", "sim:"] if "kit" in text else ["replay", FOUR]))
    assert (result.exit_code, f"did you mean {meant!r}?" in result.stderr) == (2, True), result.stderr


def test_a_variable_that_was_likely_meant() -> None:
    """What all variables begin with is not compared: else each were like each."""
    assert "; did you mean 'PALPATE_REPLAY_SCENE'?" in run("replay", FOUR, PALPATE_REPLAY_SCNE="paper").stderr
    other = run("replay", FOUR, PALPATE_REPLAY_COLOUR="red")
    assert (other.exit_code, "did you mean" in other.stderr) == (2, False)


def test_a_file_and_a_specimen_that_were_likely_meant() -> None:
    Path("bench.csv").write_text("")
    missing = run("replay", "bnch.csv")
    assert missing.stderr == "Error: bnch.csv: No such file or directory; did you mean 'bench.csv'?\n"
    Path("gels.csv").write_bytes(Path(FOUR).read_bytes())
    Path("moduli.csv").write_text("name,modulus\ngel,1\n")
    wrong = run("calibrate", "gels.csv", "--moduli", "moduli.csv", "-o", "p.toml")
    assert (wrong.exit_code, "; did you mean 'gel'?" in wrong.stderr) == (4, True), wrong.stderr


def test_a_word_like_no_other() -> None:
    for arguments in (["colour"], ["replay", FOUR, "--set", "colour=1"], ["replay", FOUR, "--scene", "x" * 70]):
        assert "did you mean" not in run(*arguments).stderr
    assert errors.nearest("p.tml", ["bad.toml"]) == ""


def offered(*words: str) -> list[str]:
    """Return what a shell offers for the last word."""
    environment = {"_PALPATE_COMPLETE": "zsh_complete", "COMP_WORDS": " ".join(("palpate", *words))}
    environment["COMP_CWORD"] = str(len(words))
    done = CliRunner(env=environment).invoke(main, [], prog_name="palpate")
    return done.stdout.split("\n")[1::3]


def test_what_the_shell_offers() -> None:
    assert offered("replay", FOUR, "--scene", "p") == ["paper"]
    assert offered("replay", FOUR, "--set", "thr") == ["threshold=10.0"]
    assert offered("replay", FOUR, "--scene", "paper", "--set", "thr") == ["threshold=0.05"]
    assert offered("replay", FOUR, "--scene", "fixed", "--set", "thr") == [""]
    assert "steady=0.9995" in offered("record", "sim:", "--set", "s")
    assert offered("calibrate", FOUR, "--accept", "s") == ["short", "saturated"]
    assert offered("kit", "accept", "--skip", "re") == ["registers", "replug"]
