"""Published identification protocols, one file a recording, run as they are stated."""

from identification.published.catalogue import PROTOCOLS as PROTOCOLS
from identification.published.catalogue import run_protocol as run_protocol
from identification.published.outcome import Compared as Compared
from identification.published.outcome import Outcome as Outcome
from identification.published.outcome import Reached as Reached
from identification.published.table import table as table
