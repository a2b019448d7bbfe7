"""The suite itself where it is started differently; .ci/nightly runs all of it in more of such surroundings."""

import os
import subprocess
import sys

import pytest
from project import ROOT


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no signals and forks on this system")
def test_ctrl_c_is_tested_also_where_the_suite_runs_in_the_background() -> None:
    """A shell lets what it runs in the background ignore SIGINT, and so would every command that a test interrupts."""
    command = [
        sys.executable,
        "-m",
        "pytest",
        "-q",
        "-n0",
        "-p",
        "no:cacheprovider",
        "tests/docs/test_readme.py",
        "tests/cli/test_record.py",
        "-k",
        "first_command or (ctrl_c and 0.15)",
    ]
    ignore = (
        "import os, signal, sys; [signal.signal(number, signal.SIG_IGN) for number in (signal.SIGINT, signal.SIGHUP)]; "
        "os.execv(sys.argv[1], sys.argv[1:])"
    )
    done = subprocess.run(
        [sys.executable, "-c", ignore, *command],
        cwd=ROOT,
        timeout=120,
        capture_output=True,
        text=True,
        check=False,
        start_new_session=True,
    )
    assert "4 passed" in done.stdout, done.stdout
    assert done.returncode == 0
