"""A printed number: what it is called, where it stands, and what is wrong with it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

from bondgraph.support.errors import unknown_name


@final
@dataclass(frozen=True, slots=True)
class Printed:
    """One number of the stack actuator thesis.

    Parameters
    ----------
    symbol : str
        As printed, with the index where there is one.
    value : float
        In `unit`; the printed digits, only the power of ten is changed.
    unit : str
        SI.
    where : str
        Table, equation or section.
    correction : str
        What a reader must change before using it; empty if nothing.

    Examples
    --------
    >>> Printed("k", 65e6, "N/m", "table 6.1").value
    65000000.0
    """

    symbol: str
    value: float
    unit: str
    where: str
    correction: str = ""


def named(values: Sequence[Printed], symbol: str) -> float:
    """Return the value of `symbol`, SI.

    Raises
    ------
    UnknownName
        If no entry carries the symbol; names the nearest.

    Examples
    --------
    >>> named((Printed("k", 65e6, "N/m", "table 6.1"),), "k")
    65000000.0
    """
    for entry in values:
        if entry.symbol == symbol:
            return entry.value
    where = values[0].where if values else "an empty list"
    raise unknown_name("symbol", symbol, where, [entry.symbol for entry in values])
