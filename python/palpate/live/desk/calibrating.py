"""Guided calibration: the fit after each touch, what is still missing, and the file at the end."""

from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from palpate.calibration import Calibration
from palpate.calibration.band import band
from palpate.calibration.characterise import Specimen, calibrate
from palpate.calibration.report import html, parameter_rows
from palpate.errors import CalibrationError, MissingExtra, PalpateError
from palpate.files import replacing
from palpate.live.desk.growth import Growth, Known, missing, next_best
from palpate.live.protocol import Command, Refused
from palpate.live.recordings import Kind

Document = dict[str, Any]
_POINTS = 81


@dataclass(frozen=True)
class Files:
    """Where the calibration is written.

    Attributes
    ----------
    propose : callable
        Takes a name such as "probe.toml"; returns a path in the folder that no file has.
    checked : callable
        Takes a name of the page and its suffix, and returns its path; raises ValueError if it is not allowed, or exists.
    made : callable
        Takes a path and a kind, "calibration" or "report": a page may download the file from then on.
    """

    propose: Callable[[str], Path]
    checked: Callable[[str, str], Path]
    made: Callable[[Path, Kind], object]


class Calibrating:
    """Fits a calibration to the touches so far, in a thread of its own.

    Parameters
    ----------
    known : callable
        Returns the specimens of known modulus with their touches.
    files : Files
    use : callable
        Takes a saved calibration and its path: the measurement goes on with it.
    scene : str

    Attributes
    ----------
    orders : dict
        Name of a command -> function.
    """

    def __init__(
        self,
        known: Callable[[], Sequence[Known]],
        files: Files,
        use: Callable[[Calibration, Path], None],
        scene: str = "handheld",
    ) -> None:
        self.orders: dict[str, Callable[[Command], str | Document]] = {
            "calibrating": self._switch,
            "save calibration": self._save,
        }
        self._known, self._files, self._use, self._scene = known, files, use, scene
        self._on, self._saved = False, ""
        self._growth = Growth(self._fit)
        self._worker: ThreadPoolExecutor | None = None
        self._seen: Any = None
        self._running: Future[Document] | None = None
        self._shown: Document = {}

    def document(self) -> Document:
        """Return the message: the newest fit that is ready, and never one of other touches with these."""
        if not self._on:
            return {"on": False}
        known = self._known()
        seen = [
            (each.name, each.modulus, each.wanted, [(n, t.ratio, kept) for n, t, kept in each.touches])
            for each in known
        ]
        if self._running and self._running.done():
            self._shown, self._running = self._running.result(), None
        if seen != self._seen and self._running is None and self._worker:
            self._seen = seen
            self._running = self._worker.submit(self._grown, known)
        return {"on": True, "saved": self._saved or None, **self._shown}

    def close(self) -> None:
        """End the thread."""
        if self._worker:
            self._worker.shutdown(wait=False, cancel_futures=True)
            self._worker = None

    def _switch(self, command: Command) -> str:
        if not command["on"]:
            self._on = False
            return "Calibrating has ended; nothing is lost."
        known = self._known()
        if len(known) < 3:
            raise Refused(
                f"calibrating: got {len(known)} specimens of known modulus, allowed: 3 or more, of different moduli; "
                "give their moduli, MPa, in the list of specimens"
            )
        self._on, self._seen = True, None
        self._worker = self._worker or ThreadPoolExecutor(1, "palpate-calibrating")
        return f"Calibrating with {len(known)} specimens of known modulus."

    def _save(self, command: Command) -> Document:
        known = self._known()
        name = command.given.get("name")
        path = self._files.checked(name, ".toml") if name else self._files.propose("probe.toml")
        try:
            specimens, found = self._fit(known)
        except (ValueError, PalpateError) as error:
            raise Refused(f"save calibration: {error}") from error
        found.save(path)
        self._files.made(path, "calibration")
        report = self._report(path, found, specimens)
        self._saved = path.name
        self._use(found, path)
        doubt = "" if found.sound else " It is not reliable yet: its verdict is in the file."
        return {"message": f"Saved as {path.name}; moduli are from it now.{doubt}", "file": path.name, "report": report}

    def _report(self, path: Path, found: Calibration, specimens: list[Specimen]) -> str | None:
        try:
            text = html(found, specimens)
        except MissingExtra:
            return None
        beside = self._files.propose(f"{path.stem}-calibration.html")
        with replacing(beside) as file:
            file.write(text.encode())
        self._files.made(beside, "report")
        return beside.name

    def _fit(self, known: Sequence[Known]) -> tuple[list[Specimen], Calibration]:
        specimens = [Specimen(each.name, each.modulus, each.kept) for each in known if each.usable]
        return specimens, calibrate(specimens, about={"scene": self._scene})

    def _grown(self, known: Sequence[Known]) -> Document:
        document: Document = {
            "touches": sum(len(each.usable) for each in known),
            "missing": missing(known),
            "next": next_best(known),
            "history": self._growth.history(known),
            "points": _points(known, None),
            **_NOTHING,
        }
        try:
            _, found = self._fit(known)
            return document | _fitted(known, found)
        except CalibrationError as error:
            return document | {"error": str(error), "verdict": f"Not enough yet: {error}"}
        except (ValueError, PalpateError) as error:  # MissingExtra, too
            return document | {"error": str(error), "verdict": str(error)}


_NOTHING: Document = {
    "verdict": "",
    "sound": False,
    "parameters": [],
    "curve": None,
    "rigid": None,
    "error": None,
}


def _fitted(known: Sequence[Known], found: Calibration) -> Document:
    x, level, reach = band(found, _POINTS)
    return {
        "verdict": found.verdict,
        "sound": found.sound,
        "parameters": [
            {"name": name, "value": value, "interval": interval} for name, value, interval in parameter_rows(found)
        ],
        "curve": {
            "modulus": np.exp(x).tolist(),
            "ratio": level.tolist(),
            "low": (level - reach).tolist(),
            "high": (level + reach).tolist(),
        },
        "points": _points(known, found),
        "rigid": {"value": found.probe.rigid_ratio, "error": float(found.fitted.covariance[0, 0] ** 0.5)},
    }


def _points(known: Sequence[Known], found: Calibration | None) -> list[Document]:
    points = []
    for each in known:
        fitted = found.probe.ratio(each.modulus) if found else None
        points += [
            {
                "modulus": each.modulus,
                "specimen": each.name,
                "touch": n,
                "ratio": t.ratio,
                "fitted": fitted,
                "kept": kept,
            }
            for n, t, kept in each.touches
        ]
    return points
