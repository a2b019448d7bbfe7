"""Reports as one HTML page: what was touched, what came out, how sure it is, and how to do it again.

`findings` reads recordings and finds the touches and the result of each specimen, `repeatability` compares touches with
specimens, and `writing` makes tables and texts of them and fills the template.
"""

from palpate.report.report_html import WrittenReport, calibration_page, write_report

__all__ = ["WrittenReport", "calibration_page", "write_report"]
