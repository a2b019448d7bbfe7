"""Reports as one HTML page: touches, results with uncertainty, and how to repeat them.

`findings` measures recordings and finds the result of each specimen, `anova` compares touches with
specimens, `recording_facts` reads the sidecars, `tables`, `content` and `calibration_head` make the
sections as data, and `report_html` fills the template.
"""

from palpate.report.calibration_head import CalibrationHead
from palpate.report.content import ReportOptions
from palpate.report.report_html import WrittenReport, calibration_page, write_report

__all__ = ["CalibrationHead", "ReportOptions", "WrittenReport", "calibration_page", "write_report"]
