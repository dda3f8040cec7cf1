"""The report of a fit: one self-contained HTML page."""

from identification.validation.report.page import page as page
from identification.validation.report.page import write_report as write_report
