"""Readings of one touch: its baseline, aligned pairs, sweep of the depth, and stiffening."""
