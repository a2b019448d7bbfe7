"""`palpate replay --calibration`: the modulus for each touch, and for the mean of touches that agree."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from palpate import Touch

if TYPE_CHECKING:
    from palpate import Modulus
    from palpate.several import Agreement


def tell_origin(path: Path, about: Mapping[str, str], scene: str) -> None:
    """Print what may be wrong with a calibration for this scene, from what its file says about its origin."""
    made_by, doubts = about.get("scene", scene), about.get("doubts", "")
    if made_by != scene:
        click.echo(
            f"{path}: was made with scene {made_by}, but this is scene {scene}: the moduli may be wrong", err=True
        )
    if doubts:
        click.echo(
            f"{path}: was made from recordings that were not as written, so the moduli may be wrong: {doubts}", err=True
        )


class Moduli:
    """Moduli of the touches of a recording, by a calibration."""

    def __init__(self, path: Path, scene: str) -> None:
        from palpate import Calibration

        self._calibration = Calibration.load(path)
        tell_origin(path, self._calibration.about, scene)

    def of(self, touch: Touch) -> "Modulus":
        """Return the modulus of the object of one touch."""
        error = touch.standard_error
        return self._calibration.modulus(touch.ratio, error if math.isfinite(error) else None)

    def agreement(self, touches: Sequence[Touch]) -> "Agreement | None":
        """Return whether several touches agree; None for fewer than two usable ones."""
        from palpate.several import objections

        accepted = self._calibration.accepted
        usable = [touch for touch in touches if not objections(touch, accepted)]
        return self._calibration.agreement(usable) if len(usable) > 1 else None

    def together(self, found: "Agreement") -> "Modulus":
        """Return the modulus for the mean of touches that agree."""
        return self._calibration.modulus(found.ratio, found.own_error, touches=found.effective)

    def table(self, table: str, touches: Sequence[Touch]) -> str:
        """Return the table of touches with a column for the modulus, and a line for their mean."""
        head, *rows = table.splitlines()
        moduli = [self.of(touch) for touch in touches]
        width = max(len(line) for line in table.splitlines())
        lines = [f"{head:{width}}  modulus (95 % interval)"]
        for row, modulus in zip(rows, moduli, strict=True):
            beyond = "  beyond the calibrated moduli" if modulus.extrapolated else ""
            reason = f": {modulus.reason}" if modulus.reason else ""
            lines.append(f"{row:{width}}  {modulus}{reason}{beyond}")
        found = self.agreement(touches)
        if found:
            lines.append(f"{found}, if all are on one object: {self.together(found)}" if found.agree else str(found))
        lines.append(f"The intervals include the {self._calibration.scatter}.")
        return "\n".join(lines) + "\n"

    def add(self, document: dict[str, Any], touches: Sequence[Touch]) -> None:
        """Add the moduli to replay's JSON document."""
        for record, touch in zip(document["touches"], touches, strict=True):
            record["modulus"] = self.of(touch).as_dict()
        found = self.agreement(touches)
        document["agreement"] = found.as_dict() if found else None
        document["modulus_of_mean"] = self.together(found).as_dict() if found and found.agree else None
