"""What lies between a recorded command and a source: limits, lags, dead time.

A drive has no power port of its own (the amplifier's supply is not modelled); it changes the
command before the source imposes it.
"""

from __future__ import annotations

from dataclasses import dataclass

from bondgraph.laws.law import Law
from bondgraph.support.bounds import Name


@dataclass(frozen=True, slots=True)
class Drive:
    """The chain command -> law -> lag -> source.

    Parameters
    ----------
    law : Law or None
        Memoryless or hysteretic law of the command, identity plus a deviation.
    lag : str or None
        Name of the time constant parameter (s) of a first-order lag.
    delay : str or None
        Name of the dead time parameter (s); it shifts every output.
    """

    law: Law | None = None
    lag: Name | None = None
    delay: Name | None = None
