"""Writes the pages of docs/reference from the commands, docstrings, options and C++ headers."""
