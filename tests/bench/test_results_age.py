"""Results in the tree tell which headers of the estimator they were measured with."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
from project import ROOT

from bench import results_age

HEADER = "// A comment.\n#pragma once\nconstexpr int limit = 8;  // samples\n"


@pytest.fixture
def headers(tmp_path: Path) -> Path:
    folder = tmp_path / "include"
    (folder / "stage").mkdir(parents=True)
    (folder / "stage" / "one.hpp").write_text(HEADER)
    return folder


def test_comments_and_spaces_do_not_count(headers: Path) -> None:
    before, header = results_age.headers_hash(headers), headers / "stage" / "one.hpp"
    header.write_text("#pragma once\n\nconstexpr int  limit = 8;\n// Another one.\n")
    assert results_age.headers_hash(headers) == before
    header.write_text(HEADER.replace("8", "9"))
    assert results_age.headers_hash(headers) != before


def test_a_new_place_is_a_change(headers: Path) -> None:
    before = results_age.headers_hash(headers)
    (headers / "stage" / "one.hpp").rename(headers / "one.hpp")
    assert results_age.headers_hash(headers) != before


def test_ages(tmp_path: Path, headers: Path) -> None:
    results = tmp_path / "results"
    results.mkdir()
    now = results_age.headers_hash(headers)
    for name, document in (("new", {"headers": now}), ("old", {"headers": "0"}), ("without", {})):
        (results / f"{name}.json").write_text(json.dumps(document))
    assert dict(results_age.ages(results, headers)) == {"new.json": True, "old.json": False, "without.json": False}


def test_the_command_names_each_file() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "bench.results_age"], cwd=ROOT, capture_output=True, text=True, check=False
    )
    files = {path.name for path in (ROOT / "bench" / "results").glob("*.json")}
    assert {line.split(":")[0].rpartition("/")[2] for line in done.stdout.splitlines()} == files
    assert done.returncode == ("OLDER" in done.stdout)
    assert "results" in (ROOT / ".ci" / "nightly").read_text().split("all=(")[1].split(")")[0].split()
