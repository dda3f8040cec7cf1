"""The page of a diagnosis: what was found, to look and click with, from disk without network."""

from identification.diagnosis.studio.page import page as page
from identification.diagnosis.studio.page import write_report as write_report
