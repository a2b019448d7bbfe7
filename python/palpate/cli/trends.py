"""Trends over the touches of a recording, specimen by specimen."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING

from palpate.differences import Trend
from palpate.repeatability import Agreement

if TYPE_CHECKING:
    from palpate import Touch
    from palpate.recording.session import Entry


@dataclass(frozen=True)
class SpecimenTrend:
    """The trend over the touches on one specimen; "": the touches are not named."""

    specimen: str
    trend: Trend
    text: str

    def __str__(self) -> str:
        """Return the trend as a sentence."""
        return f"{self.specimen or 'all touches'}: {self.text}"

    def as_dict(self) -> dict[str, object]:
        """Return all values for JSON."""
        return {"specimen": self.specimen or None, **asdict(self.trend), "text": self.text}


def specimen_trends(
    touches: "Sequence[Touch]",
    entries: "Sequence[Entry | None]",
    agreement_of: "Callable[[list[Touch]], Agreement]",
) -> Iterator[SpecimenTrend]:
    """Yield the trend of each specimen that has one.

    Touches that differ for no known reason may be on several objects: these show no trend.
    """
    for specimen, group in by_specimen(touches, entries).items():
        try:
            found = agreement_of(group)
        except ValueError:  # no touch counts
            continue
        is_one_object = found.agree or found.cause is not None
        if found.trend and found.trend_text and is_one_object:
            yield SpecimenTrend(specimen, found.trend, found.trend_text)


def by_specimen(
    touches: "Sequence[Touch]", entries: "Sequence[Entry | None]"
) -> "dict[str, list[Touch]]":
    """Return the touches that are not left out by hand, by the names of their specimens."""
    groups: dict[str, list[Touch]] = {}
    for touch, entry in zip(touches, entries, strict=True):
        name = ""
        if entry:
            if entry.left_out:
                continue
            name = entry.specimen or ""
        groups.setdefault(name, []).append(touch)
    return groups
