"""Reports as one HTML page: what was touched, what came out, how sure it is, and how to do it again.

`findings` reads recordings and finds the touches and the result of each specimen, `repeatability` compares touches with
specimens, `sections` has the texts that the template cannot make, and `writing` fills it.
"""

from palpate.report.writing import Written, calibration_page, write

__all__ = ["Written", "calibration_page", "write"]
