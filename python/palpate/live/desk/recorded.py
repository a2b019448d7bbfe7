"""What the sidecar of an opened recording says, for the page: events, specimens, which touches are kept, notes."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from palpate._core import Touch
from palpate.live.desk.report import Report
from palpate.live.desk.states import of_file
from palpate.live.protocol import Command
from palpate.live.review import Review
from palpate.live.summary import Summary
from palpate.recording.session import Entry
from palpate.report import write
from palpate.sentences import advice
from palpate.several import objections

Document = dict[str, Any]
_FLAGGED = 1000  # touches


class Recorded:
    """The session of a recording.

    Parameters
    ----------
    review : Review
    summary : Summary
        Has the calibration in use.
    calibration_file : pathlib.Path, optional
        Where it is stored, for a report.

    Attributes
    ----------
    orders : dict
        Name of a command -> function: report, of a recording of palpate.
    told : dict
        Kind of a message -> function that returns it.
    """

    def __init__(self, review: Review, summary: Summary, calibration_file: Path | None = None) -> None:
        self.orders: dict[str, Callable[[Command], str | Document]] = {}
        if review.recordings.names:
            self.orders |= Report(review.recordings, write, lambda: calibration_file).orders
        self.told: dict[str, Callable[[], Document]] = {"events": self.events, "session": self.session}
        self._review, self._summary = review, summary
        self._touches: list[Touch] = []
        self._known: tuple[list[Document], list[Document]] = ([], [])

    def state(self) -> Document:
        """Return what the message `state` has beside the touches."""
        file = self._review.file
        refused = self._review.counters.refused
        useless = f", {refused} without a value" if refused else ""
        word, line = of_file(file["name"], file["end"], f"{file['rows']} rows, {file['missing']} missing{useless}")
        shown = {"level": line.level, "title": line.title, "text": line.text, "since_s": None, "what": line.what}
        told = {"now": word._asdict(), "line": shown, "announce": line.text}
        return {"recording": None, "proposed": "", "files": self._review.recordings.files, **told}

    def is_news(self) -> bool:
        """Return False: nothing happens by itself."""
        return False

    def events(self) -> Document:
        """Return the message `events`."""
        review = self._review
        names = ("from_s", "to_s", "lost", "text")
        return {
            "marks": [{"id": number, "t_s": t_s, "text": text} for number, (t_s, text) in enumerate(review.marks, 1)],
            "tares": list(review.tares),
            "gaps": [dict(zip(names, gap, strict=True)) for gap in review.gaps],
            "flags": self._caught_up()[1],
        }

    def rows(self) -> list[Document]:
        """Return specimen, deviation from the mean of its kept touches, whether it is kept, and why not, of each touch."""
        return self._caught_up()[0]

    def session(self) -> Document:
        """Return the message `session`."""
        plan, rows = self._review.plan, self.rows()
        specimens = []
        for one in plan.specimens:
            own = [(number, row) for number, row in enumerate(rows, 1) if row["specimen"] == one.name]
            ratios = [self._touches[number - 1].ratio for number, row in own if row["kept"]]
            specimens.append(
                {
                    "name": one.name,
                    "modulus": one.modulus_MPa,
                    "kept": len(ratios),
                    "of": one.wanted,
                    "mean": sum(ratios) / len(ratios) if ratios else None,
                    "deviations": [
                        {"touch": number, "deviation": row["deviation"], "kept": row["kept"]} for number, row in own
                    ],
                }
            )
        return {
            "title": plan.title,
            "operator": plan.operator,
            "wanted": max((one.wanted for one in plan.specimens), default=0),
            "specimens": specimens,
            "next": None,
            "count": {"kept": sum(row["kept"] for row in rows), "of": len(rows)},
            "notes": [{"t_s": note.t_s, "text": note.text} for note in plan.notes],
            "last": {"touch": len(rows), "kept": rows[-1]["kept"]} if rows else None,
        }

    def _caught_up(self) -> tuple[list[Document], list[Document]]:
        """Return the rows and the flags, computed again when there are more touches."""
        touches = self._review.touches
        if touches is not self._touches:
            self._touches, self._known = touches, (self._rows_of(touches), self._flags_of(touches))
        return self._known

    def _flags_of(self, touches: list[Touch]) -> list[Document]:
        first = max(len(touches) - _FLAGGED, 0)
        return [
            {"t_s": self._review.ends.get(number, touch.start_s), "touch": number, "name": flag, "text": sentence}
            for number, touch in enumerate(touches[first:], first + 1)
            if touch.flags
            for flag, sentence in zip(touch.flags, advice(touch), strict=False)
        ]

    def _rows_of(self, touches: list[Touch]) -> list[Document]:
        entries = self._review.plan.matched(touches, self._review.period_s)
        whys = [self._why(touch, entry) for touch, entry in zip(touches, entries, strict=True)]
        names = [entry.specimen if entry else None for entry in entries]
        ratios: dict[str | None, list[float]] = {}
        for touch, why, name in zip(touches, whys, names, strict=True):
            ratios.setdefault(name, []).extend([] if why else [touch.ratio])
        means = {name: sum(found) / len(found) if name and found else None for name, found in ratios.items()}
        return [
            {
                "specimen": name,
                "deviation": touch.ratio / mean - 1 if (mean := means[name]) else None,
                "kept": not why,
                "why": why,
            }
            for touch, why, name in zip(touches, whys, names, strict=True)
        ]

    def _why(self, touch: Touch, entry: Entry | None) -> str:
        if entry:
            return entry.left_out
        flags = objections(touch, self._summary.accepted)
        return next((line for line in advice(touch) if line.partition(":")[0] in flags), "")
