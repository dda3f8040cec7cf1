"""A named number with a unit."""

from __future__ import annotations

from dataclasses import dataclass

import sympy as sp

from bondgraph.support.bounds import Name, Positive


@dataclass(frozen=True, slots=True)
class Parameter:
    """A named number with a unit.

    Parameters
    ----------
    name : str
        Address of the parameter in equations, fits and verdicts.
    value : float
        Nominal value, SI.
    unit : str
        SI unit of `value`; `BondGraph.parameter` and elements convert, `check` refuses another.
    positive : bool
        Physics forbids zero and negative values.
    lower, upper : float or None
        Bounds for identification.
    scale : float or None
        Typical size, used to condition fits; the nominal value when not given.
    fixed : bool
        Known well enough not to be fitted (a gauge, a counted number, a weighed mass).
    source : str
        Where the number comes from.
    spread : float or None
        The true value lies within this factor of `value` (data sheet, drawing, weighing); fits
        stay inside, so that a wrong structure cannot hide behind absurd parameters.

    Examples
    --------
    >>> Parameter("m", 0.25, "kg", spread=1.2).symbol
    m
    """

    name: Name
    value: float
    unit: str = "1"
    positive: bool = True
    lower: float | None = None
    upper: float | None = None
    scale: float | None = None
    fixed: bool = False
    source: str = ""
    spread: Positive | None = None

    @property
    def symbol(self) -> sp.Symbol:
        """The SymPy symbol of this parameter."""
        return symbol(self.name, positive=self.positive)


def symbol(name: str, *, positive: bool = False) -> sp.Symbol:
    """Return the one symbol Bondsight uses for `name`."""
    return sp.Symbol(name, positive=True) if positive else sp.Symbol(name, real=True)
