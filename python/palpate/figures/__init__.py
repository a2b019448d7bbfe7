"""The paper's figures, from the simulation."""

from palpate.figures.drawings import FIGURES, draw

__all__ = ["FIGURES", "draw"]
