"""A report of a measurement as one HTML page: what was touched, what came out, how sure it is, and how to do it again.

`write` makes one. `recorded` reads a recording and its touches, `results` finds a result for each specimen, `repeatability`
compares touches with specimens, and `page` puts the sections together.
"""

from palpate.report.writing import Written, write

__all__ = ["Written", "write"]
