"""The report of a diagnosis: one self-contained HTML page."""

from identification.diagnosis.report.page import page as page
from identification.diagnosis.report.page import write_report as write_report
