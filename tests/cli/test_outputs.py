"""What a command does with a file that exists where it writes: nothing is destroyed without a word."""

from pathlib import Path

import palpate
import pytest
from click.testing import CliRunner, Result
from palpate.calibration.specimen_files import write_session
from palpate.cli import main
from palpate.figures.drawings import files as figure_files
from palpate.samples import block_of
from project import ROOT

FOUR = ROOT / "tests" / "data" / "four-specimens.csv"
PROBE = ROOT / "tests" / "fuzz" / "corpus" / "calibration" / "probe.toml"


def run(*arguments: str | Path) -> Result:
    return CliRunner().invoke(main, [str(a) for a in arguments])


def planted(folder: Path, names: list[str]) -> dict[Path, Path]:
    """Plant a link to a precious file at each name; return the precious files by their links."""
    links = {}
    for name in names:
        precious = folder / f"precious-{name}"
        precious.write_text("precious")
        (folder / name).symlink_to(precious)
        links[folder / name] = precious
    return links


def test_no_predictable_name_is_written(tmp_path: Path) -> None:
    """The names that temporaries once had: links there are not written through, and a user's own file stays."""
    links = planted(tmp_path, ["run.csv.new", "run.json.new", "run.parquet.new", "probe.toml.part"])
    own = tmp_path / "other.csv.new"
    own.write_text("my own")
    for name in ("run.csv", "other.csv", "run.parquet"):
        assert run("convert", FOUR, "-o", tmp_path / name).exit_code == 0
    palpate.Calibration.load(PROBE).save(tmp_path / "probe.toml")
    assert own.read_text() == "my own"
    for link, precious in links.items():
        assert (link.is_symlink(), precious.read_text()) == (True, "precious"), link


@pytest.mark.parametrize("option", ["-o", "--plot", "--report"])
def test_calibrate_replaces_nothing_unasked(option: str, tmp_path: Path) -> None:
    taken, link = tmp_path / "taken.png", tmp_path / "link.png"
    taken.write_text("precious")
    link.symlink_to(tmp_path / "nowhere")
    free = {"-o": tmp_path / "p.toml", "--plot": tmp_path / "p.svg", "--report": tmp_path / "p.html"}
    for there in (taken, link):
        given = [part for pair in (free | {option: there}).items() for part in pair]
        result = run("calibrate", FOUR, "--moduli", taken, *given)
        assert result.exit_code == 4
        assert (
            "is an input file" in result.stderr
            or "already exists: choose another name, or use --force" in result.stderr
        )
        assert run("calibrate", there, FOUR, "--moduli", FOUR, *given, "--force").exit_code in (2, 4)
    assert (taken.read_text(), link.is_symlink(), list(tmp_path.glob("p.*"))) == ("precious", True, [])


def test_a_sidecar_of_an_input_is_an_input(tmp_path: Path) -> None:
    for suffix in (".csv", ".json"):
        (tmp_path / "four").with_suffix(suffix).write_bytes(FOUR.with_suffix(suffix).read_bytes())
    beside, before = tmp_path / "four.json", FOUR.with_suffix(".json").read_bytes()
    for option in ("-o", "--report"):
        given = {"-o": tmp_path / "p.toml"} | {option: beside}
        result = run(
            "calibrate",
            tmp_path / "four.csv",
            "--moduli",
            FOUR,
            *[x for pair in given.items() for x in pair],
            "--force",
        )
        assert result.exit_code == 4
        assert "four.json: is an input file: choose another name" in result.stderr
    assert beside.read_bytes() == before


def test_one_name_for_two_outputs(tmp_path: Path) -> None:
    both = ("-o", tmp_path / "p.svg", "--plot", tmp_path / "p.svg")
    result = run("calibrate", FOUR, "--moduli", FOUR, *both)
    assert result.exit_code in (2, 4)
    assert not (tmp_path / "p.svg").exists()
    table = tmp_path / "moduli.csv"
    table.write_text("name,modulus\nfour,1\n")
    result = run("calibrate", FOUR, "--moduli", table, *both)
    assert (result.exit_code, "for two files" in result.stderr) == (2, True)


def test_figures_replace_nothing_unasked(tmp_path: Path) -> None:
    names = figure_files(tmp_path)
    assert len(set(names)) == 19
    names[5].write_text("precious")
    result = run("figures", "-o", tmp_path)
    assert (result.exit_code, names[5].read_text(), len(list(tmp_path.iterdir()))) == (4, "precious", 1)
    assert f"{names[5]}: already exists: choose another name, or use --force" in result.stderr


def test_simulated_recordings_are_written_through_no_link(tmp_path: Path) -> None:
    (tmp_path / "gel.csv").symlink_to(tmp_path / "nowhere")
    with pytest.raises(FileExistsError):
        write_session(tmp_path, {"gel": block_of([])}, {"gel": 1.0})
    assert not (tmp_path / "nowhere").exists()


def test_long_values_are_cut_in_messages(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    path.write_text("t,hard,soft\n" + "1,2,3\n" * 5 + f"1,2,{'x' * 90_000}\n")
    cases: list[list[str | Path]] = [
        ["replay", path, "--map", "hard=2,soft=3"],
        ["replay", path, "--map", f"hard={'h' * 50_000},soft=3"],
        ["replay", FOUR, "--scene", "s" * 50_000],
        ["replay", FOUR, "--set", f"{'n' * 50_000}=1"],
        ["record", f"sim:{'m' * 9_000}", "-o", tmp_path / "run.csv"],
    ]
    for arguments in cases:
        result = run(*arguments)
        assert result.exit_code in (2, 4)
        assert len(result.stderr) < 3000, str(arguments[2])[:20]
