"""The moduli of the touches of a recording, and of the mean of those on each specimen."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from palpate.calibration.learning import learned_from
from palpate.calibration.ranges import wider
from palpate.cli.touch_table import modulus_cell
from palpate.repeatability import Agreement

if TYPE_CHECKING:
    from palpate import Calibration, Modulus, Touch


@dataclass(frozen=True)
class MeanModulus:
    """The mean of the touches on one specimen; "": they are not named.

    `modulus`: None if the touches differ.
    """

    specimen: str
    agreement: Agreement
    modulus: "Modulus | None"

    @classmethod
    def of(
        cls, calibration: "Calibration", specimen: str, touches: "Sequence[Touch]"
    ) -> "MeanModulus | None":
        """Return the mean of touches; None below two usable ones."""
        usable = [touch for touch in touches if not calibration.objections(touch)]
        if len(usable) < 2:
            return None
        agreement = calibration.agreement(usable)
        modulus = calibration.mean_modulus(usable) if agreement.agree else None
        return cls(specimen, agreement, modulus)

    def sentences(self) -> list[str]:
        """Return the sentences on the mean."""
        where = f"{self.specimen}: " if self.specimen else ""
        if self.modulus is None:
            return [f"{where}{self.agreement}"]
        condition = "" if self.specimen else ", if all are on one object"
        mean = f"{where}{self.agreement.mean_text}{condition}: {modulus_cell(self.modulus)}"
        return [mean, *filter(None, [self.agreement.trend_text])]

    def as_dict(self) -> dict[str, object]:
        """Return all values for JSON."""
        return {
            "specimen": self.specimen or None,
            "agreement": self.agreement.as_dict(),
            "modulus": self.modulus and self.modulus.as_dict(),
        }


@dataclass(frozen=True)
class TouchModuli:
    """The modulus of each touch, and of the mean of those on each specimen.

    Attributes
    ----------
    calibration : Calibration
        With what the repeated touches show of the contact exponent.
    learned : str
        A sentence on that; "": nothing.
    moduli : sequence of Modulus
    differences : mapping of str to list of int
        The numbers of the touches that differ from those that calibrated, by a sentence.
    means : list of MeanModulus
    """

    calibration: "Calibration"
    learned: str
    moduli: "Sequence[Modulus]"
    differences: Mapping[str, list[int]]
    means: list[MeanModulus]

    @classmethod
    def of(
        cls,
        calibration: "Calibration",
        touches: "Sequence[Touch]",
        specimens: "Mapping[str, Sequence[Touch]]",
    ) -> "TouchModuli":
        """Return the moduli of touches; `specimens`: those that count, by the name of the specimen."""
        learned = learned_from(calibration, specimens)
        calibration = learned.calibration
        differences: dict[str, list[int]] = {}
        for number, touch in enumerate(touches, 1):
            for sentence in calibration.differences(touch):
                differences.setdefault(sentence, []).append(number)
        means = []
        for name, group in specimens.items():
            mean = MeanModulus.of(calibration, name, group)
            if mean is not None:
                means.append(mean)
        moduli = [calibration.modulus_of(touch) for touch in touches]
        return cls(calibration, learned.sentence, moduli, differences, means)

    def sentences(self) -> list[str]:
        """Return the sentences below the table; none without touches."""
        if not self.moduli:
            return []
        sentences: list[str] = []
        for mean in self.means:
            sentences += mean.sentences()
        if self.learned:
            sentences.append(self.learned)
        for sentence, numbers in self.differences.items():
            touches = _numbered(numbers)
            sentences.append(f"{touches}: {wider(sentence)}.")
        sentences.append(f"The intervals are of 95 %, and include {self._contents}.")
        return sentences

    @property
    def _contents(self) -> str:
        """What the intervals include."""
        scatter = f"the {self.calibration.scatter}"
        low, high = self.calibration.possible_exponents
        if low == high:
            return scatter
        return f"{scatter}, and each contact exponent from {low:g} to {high:g}"

    def as_dict(self) -> dict[str, object]:
        """Return the means and what the touches differ in, for JSON."""
        only = self.means[0] if len(self.means) == 1 else None
        return {
            "agreement": only and only.agreement.as_dict(),
            "modulus_of_mean": only and only.modulus and only.modulus.as_dict(),
            "means": [mean.as_dict() for mean in self.means],
            "differences": self.differences,
            "contact_exponents": list(self.calibration.possible_exponents),
        }


def _numbered(numbers: Sequence[int]) -> str:
    """Return the numbers of touches as text."""
    if len(numbers) == 1:
        return f"touch {numbers[0]}"
    return f"touches {', '.join(map(str, numbers[:-1]))} and {numbers[-1]}"
