"""Recordings beside each other: what is computed, and the page."""

from collections.abc import Callable
from pathlib import Path
from shutil import copy

import page_looks
import palpate
import pytest
from command_lines import run
from live_bench import OWN_FILE
from live_browser import Browser
from live_server import Live
from palpate.live.compare import compared
from palpate.live.protocol import RefusedCommand
from palpate.recording import sidecar
from palpate.recording.session import Entry, Plan
from selenium.webdriver.common.keys import Keys

TOUCHES = palpate.touches(palpate.read(OWN_FILE))


def named(path: Path, *names: str | None) -> Path:
    """Copy a recording of touches on four specimens, and name them."""
    for suffix in (".csv", ".json"):
        copy(OWN_FILE.with_suffix(suffix), path.with_suffix(suffix))
    entries = tuple(Entry(one.start_s, name) for one, name in zip(TOUCHES, names, strict=True))
    sidecar.amend(path, Plan(touches=entries), Plan())
    return path


@pytest.fixture
def three(tmp_path: Path) -> list[Path]:
    """Return recordings in one of which a and b are exchanged; d is in one alone."""
    return [
        named(tmp_path / f"{day}.csv", *names)
        for day, names in (
            ("mo", "abcd"),
            ("tu", ("a", "b", "c", None)),
            ("we", ("b", "a", "c", None)),
        )
    ]


def test_touches_by_specimen_with_what_agreement_says(three: list[Path]) -> None:
    found = compared(three, None)
    assert (found.agree, found.of) == (1, 3)
    ratios = [one.ratio for one in TOUCHES]
    for name, touches in (("a", [0, 0, 1]), ("b", [1, 1, 0]), ("c", [2, 2, 2]), ("d", [3])):
        [one] = [each for each in found.specimens if each.name == name]
        wanted = palpate.agreement([TOUCHES[at] for at in touches])
        shown = one.agreement
        assert shown
        assert (shown.agree, shown.probability, shown.ratio) == (
            wanted.agree,
            wanted.probability,
            wanted.ratio,
        )
        assert [(each.file, each.number, each.ratio) for each in one.touches] == [
            (file, at + 1, ratios[at]) for file, at in enumerate(touches)
        ]
        if name in "ab":
            away = ratios[touches[2]] / ratios[touches[0]] - 1
            assert one.farthest == 2
            assert one.apart == pytest.approx(away)
    assert [(file.kept, file.touches) for file in found.files] == [(4, 4), (3, 4), (3, 4)]


def test_what_cannot_be_compared_says_why(three: list[Path], tmp_path: Path) -> None:
    with pytest.raises(RefusedCommand, match="compare: got 1 recordings, allowed: two or more"):
        compared(three[:1], None)
    unnamed = compared([named(tmp_path / name, *[None] * 4) for name in ("x.csv", "y.csv")], None)
    # by the names of the files
    assert (unnamed.of, [one.name for one in unnamed.specimens]) == (0, ["x", "y"])
    assert compared(three, None).same is None  # specimens are in several of them
    for files in (three * 2, three[:1] * 2, [three[0], "sim:tremor"]):
        assert "allowed: 4 recordings at most, each once" in run("live", *files).stderr


def test_the_page_answers_first_and_goes_to_what_differs(
    page: Browser, serve: Callable[..., Live], three: list[Path]
) -> None:
    page.driver.get(serve(*map(str, three[1:]), source=str(three[0])).address)
    page.until(lambda: page["compare"].is_displayed())
    assert page.text("compare").startswith("1 of 3\nspecimens agree. Look at a, b.")
    chosen = "return document.querySelector('#compare tr.chosen').cells[0].textContent"
    seen = [page.run(chosen)]
    for _ in range(2):
        page.press("n")
        seen.append(page.run(chosen))
    assert seen == ["a", "b", "a"]
    assert page.run("return document.activeElement.textContent") == "a"
    assert "a: ▲ recording C is " in page.text("compare")
    assert (
        len(page.all("#compare tr.chosen td svg *")) == 3 + 3 + 2
    )  # touches, their means, band and middle
    page.press(Keys.ESCAPE)
    page.until(lambda: page["timeline"].is_displayed() and not page["compare"].is_displayed())
    page.press("c")
    page.until(lambda: page["compare"].is_displayed())


def test_recordings_without_names_are_compared_as_one_object(
    page: Browser, serve: Callable[..., Live], tmp_path: Path
) -> None:
    """The touches are on four objects: they differ; those on one of them agree."""
    paths = [named(tmp_path / name, *[None] * 4) for name in ("x.csv", "y.csv")]
    same = compared(paths, None).same
    assert same is not None
    assert same.agreement is not None
    wanted = palpate.agreement(TOUCHES * 2)
    assert same.agreement.agree is wanted.agree is False
    assert (same.agreement.ratio, len(same.touches)) == (wanted.ratio, 8)
    page.driver.get(serve(str(paths[1]), source=str(paths[0])).address)
    page.until(lambda: page["compare"].is_displayed())
    [button] = page.all("#compare .same")
    assert button.text == "Are A and B the same object?"
    button.click()
    assert page.text("compare").startswith("0 of 1\nA and B differ: not the same object")
    assert page_looks.audit(page.driver) == []
