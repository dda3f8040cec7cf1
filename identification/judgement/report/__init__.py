"""The report of a fit: one self-contained HTML page."""

from identification.judgement.report.page import page as page
from identification.judgement.report.page import write_report as write_report
