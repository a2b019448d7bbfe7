"""Objects that matplotlib draws: a recording, its touches, a calibration."""

from typing import Any


class Plotted:
    """An object that draws itself."""

    def plot(self, ax: Any = None) -> Any:
        """Draw with matplotlib.

        A recording: the change of both channels over time, with the marks, and a dashed line at
        each gap. Touches: the ratio of each over its begin, with its uncertainty and flags. A
        calibration: the curve, the band for a touch, and the measured ratios over the modulus.

        Parameters
        ----------
        ax : matplotlib Axes, optional
            Default: new axes of pyplot.

        Returns
        -------
        matplotlib Axes

        Raises
        ------
        MissingExtra
            matplotlib is missing; type: pip install 'palpate[science]'.
        """
        from palpate.display.plots import axes

        with axes(ax) as drawn:
            self._draw(drawn)
        return drawn

    def _draw(self, ax: Any) -> None:
        """Draw on these axes."""
        raise NotImplementedError
