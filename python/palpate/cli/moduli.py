"""`palpate replay --calibration`: the modulus for each touch, and for the mean of all touches."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from palpate import Touch

if TYPE_CHECKING:
    from palpate import Modulus


class Moduli:
    """Moduli of the touches of a recording, by a calibration."""

    def __init__(self, path: Path, scene: str) -> None:
        from palpate import Calibration

        self._calibration = Calibration.load(path)
        made_by = self._calibration.about.get("scene", scene)
        if made_by != scene:
            click.echo(
                f"{path}: was made with scene {made_by}, but this is scene {scene}: the moduli may be wrong", err=True
            )

    def of(self, touch: Touch) -> "Modulus":
        """Return the modulus of the object of one touch."""
        error = touch.standard_error
        return self._calibration.modulus(touch.ratio, error if math.isfinite(error) else None)

    def together(self, touches: Sequence[Touch]) -> "Modulus | None":
        """Return the modulus for the mean of several touches; None for fewer than two without a flag."""
        from palpate.calibration.characterise import choose

        if sum(not touch.flags for touch in touches) < 2:
            return None
        mean = choose(touches, "mean")
        return self._calibration.modulus(mean.ratio, mean.standard_error, touches=mean.touches)

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
        together = self.together(touches)
        if together:
            lines.append(f"mean, if all touches are on one object: {together}")
        return "\n".join(lines) + "\n"

    def add(self, document: dict[str, Any], touches: Sequence[Touch]) -> None:
        """Add the moduli to replay's JSON document."""
        for record, touch in zip(document["touches"], touches, strict=True):
            record["modulus"] = self.of(touch).as_dict()
        together = self.together(touches)
        document["modulus_of_mean"] = together.as_dict() if together else None
