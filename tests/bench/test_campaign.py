"""The campaign of faults in short: no promise is broken, and it notices a broken one."""

import json
import sys
from random import Random

import pytest
from effort import SEED
from project import ROOT, need

from bench.results_age import RESULTS
from bench.soak import campaign
from bench.soak.campaign import Campaign, Outcome, Trial

linux = pytest.mark.skipif(
    sys.platform != "linux", reason="its calls fail in the C library of Linux"
)


@pytest.fixture(scope="module")
def ready(tmp_path_factory: pytest.TempPathFactory) -> Campaign:
    """Return a campaign with its runs without faults."""
    need("cc")
    return Campaign(tmp_path_factory.mktemp("campaign"))


@linux
def test_no_promise_is_broken(ready: Campaign) -> None:
    figures = campaign.run_trials(ready, 12.0, SEED)
    broken = [text for each in figures.values() for outcome in each for text in outcome.texts]
    assert broken == []


@linux
@pytest.mark.parametrize(
    ("call", "kept"),
    [("write run.csv 8 28 60000", "rows"), ("rename run.json 9 13 60000", "orders")],
)
def test_a_fault_that_lasts_to_the_end_is_noticed(ready: Campaign, call: str, kept: str) -> None:
    """So the campaign finds a program that loses what it cannot write."""
    outcome = ready.try_one(10_000 + len(kept), Trial("lasting", call=call))
    assert outcome.unclean == 1
    assert (outcome.rows_lost > 0) == (kept == "rows")
    assert (outcome.orders_lost > 0) == (kept == "orders")
    assert outcome.touches == 0, "the measurement goes on"


@linux
def test_each_call_of_a_recording_is_among_its_trials(ready: Campaign) -> None:
    families = {trial.family for trial in campaign.systematic(ready, Random(1))}
    calls = {
        f"{call} {target}"
        for call in ("open", "write", "sync")
        for target in ("run.csv", "run.json")
    }
    calls |= {
        "rename run.json",
        "sync folder",
        "print to stdout",
        "print to stderr",
        "USB stall",
        "USB unplug",
        "computer sleep",
    }
    assert calls <= families


def test_the_page_shows_the_figures_of_the_last_campaign() -> None:
    figures = json.loads((RESULTS / "campaign.json").read_text())["figures"]
    page = (ROOT / "SECURITY.md").read_text(encoding="utf-8")
    assert campaign.table(figures) in page
    assert campaign.written(page, campaign.table(figures)) == page


def test_a_broken_promise_is_counted() -> None:
    assert Outcome(refused=3).broken == 0
    assert Outcome(rows_lost=2, ended=1, files_left=1).broken == 4
