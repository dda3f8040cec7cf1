"""One page to look at a diagnosis with, from disk and without network."""

from identification.diagnosis.studio.page import page as page
from identification.diagnosis.studio.page import write_studio as write_studio
