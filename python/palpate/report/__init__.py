"""Reports as one HTML page: what was touched, what came out, how sure it is, and how to do it again.

`runs` reads a recording and its touches, `results` finds a result for each specimen, `repeatability` compares touches with
specimens, `sections` has what the templates show, and `writing` fills them.
"""

from palpate.report.writing import Written, calibration_page, write

__all__ = ["Written", "calibration_page", "write"]
