"""The times of the rows: units, steps, pairs of two channels."""
