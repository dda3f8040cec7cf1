"""Published identification protocols, one file a recording, run as they are stated."""

from tests.proof.published.catalogue import PROTOCOLS as PROTOCOLS
from tests.proof.published.catalogue import run_protocol as run_protocol
from tests.proof.published.outcome import Compared as Compared
from tests.proof.published.outcome import Outcome as Outcome
from tests.proof.published.outcome import Reached as Reached
from tests.proof.published.table import table as table
