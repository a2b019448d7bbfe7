"""Options of `palpate calibrate` for the provenance, and the provenance by its recordings."""

from collections import defaultdict
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click

from palpate.calibration.origin import ReadingsOrigin
from palpate.calibration.provenance import (
    FileChecksum,
    Provenance,
    joined_texts,
    present_time,
    recorded_at,
)
from palpate.cli.shared_options import add_options, pass_as
from palpate.files import STANDARD_INPUT
from palpate.messages import listed
from palpate.report.findings import AnalysedRecording
from palpate.report.recording_facts import RecordingFacts

_Command = Callable[..., Any]
_STATED: Sequence[Callable[[_Command], _Command]] = [
    click.option("--probe", default="", help="Which probe was calibrated, for the file."),
    click.option(
        "--operator", default="", help="Who measured, for the file.  [default: from the sessions]"
    ),
    click.option("--site", default="", help="Where it was measured, for the file."),
]


@dataclass(frozen=True)
class StatedOrigin:
    """What the user states about a calibration; "": nothing."""

    probe: str = ""
    operator: str = ""
    site: str = ""


def stated_options(command: _Command) -> _Command:
    """Add the argument `stated`, of `StatedOrigin`, to a command."""
    return add_options(pass_as("stated", StatedOrigin, command), _STATED)


@dataclass(frozen=True)
class CalibratedOrigin:
    """Where the recordings of a calibration come from."""

    runs: Sequence[AnalysedRecording]

    def simulated(self) -> bool | None:
        """Return whether the touches are simulated; None: unknown.

        If some recordings state it and the others do not, they are simulated if any states that.

        Raises
        ------
        click.UsageError
            Some are simulated, and others are of a probe.
        """
        names = self._names()
        if names[True] and names[False]:
            allowed = "recordings of one kind"
            raise click.UsageError(
                f"FILE: got simulated recordings ({listed(names[True])}) and recordings from a probe "
                f"({listed(names[False])}), allowed: {allowed}"
            )
        if names[True]:
            return True
        return None if names[None] else False

    def chips(self) -> list[str]:
        """Return the fingerprints of the chips."""
        chips = {origin.chip for origin in self._origins()}
        return sorted(chips - {""})

    def notes(self) -> list[str]:
        """Return notes on recordings whose origins differ."""
        notes = []
        names = self._names()
        unknown = listed(names[None])
        if names[None] and names[True]:
            notes.append(
                f"{unknown}: no sidecar states whether they are simulated; the other recordings are "
                "simulated, so the calibration counts as simulated"
            )
        elif names[None] and names[False]:
            notes.append(f"{unknown}: no sidecar states whether they are simulated")
        chips = self.chips()
        if len(chips) > 1:
            notes.append(f"the recordings are from {len(chips)} chips: {listed(chips)}")
        return notes

    def provenance(self, files: Iterable[Path | None], stated: StatedOrigin) -> Provenance:
        """Return the provenance: of the recordings, these files, and what is stated.

        Raises
        ------
        ValueError
            A text that is stated is too long, or has characters that cannot be shown.
        OSError
            A file cannot be read any more.
        """
        paths: dict[Path, None] = {}
        operators = []
        begins = []
        for run in self.runs:
            for file in RecordingFacts(run).files():
                paths[file.path] = None
            operators.append(run.plan.operator)
            begins.append(recorded_at(run.recording.sidecar))
        for path in files:
            if path is not None and path != STANDARD_INPUT:
                paths[path] = None
        return Provenance(
            date=present_time(),
            measured=min(filter(None, begins), default=None),
            probe=stated.probe,
            operator=stated.operator or joined_texts(operators),
            site=stated.site,
            files=tuple(map(FileChecksum.of, paths)),
            chips=tuple(self.chips()),
            simulated=self.simulated(),
        )

    def _origins(self) -> list[ReadingsOrigin]:
        return [ReadingsOrigin.of_sidecar(run.recording.sidecar) for run in self.runs]

    def _names(self) -> dict[bool | None, list[str]]:
        """Return the names of the recordings that are simulated, of a probe, or unknown."""
        names: dict[bool | None, list[str]] = defaultdict(list)
        for run, origin in zip(self.runs, self._origins(), strict=True):
            names[origin.simulated].append(run.name)
        return names
