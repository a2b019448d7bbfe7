"""Figures of the paper, from simulated data."""

from palpate.figures.drawings import FIGURES, draw

__all__ = ["FIGURES", "draw"]
