"""Guards: what turns a switched junction on and off, as levels of signals; data, no code."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TypeAlias

import sympy as sp

from bondgraph.graph.elements import Value
from bondgraph.support.errors import GraphError, UnusableInput, real_number

Signal: TypeAlias = str | sp.Expr
"""Name of a sensor, or an expression of signals as in a `Reading`."""


@dataclass(frozen=True)
class When:
    """A condition: a signal is above a level, or below one.

    With both levels it holds outside of the band from `below` to `above` (a stiction that breaks
    loose either way). A level itself fulfils nothing.

    Parameters
    ----------
    signal : str or sympy expression
        Name of a sensor, whose reading it is; or an expression of signals (`effort`, `flow`,
        `displacement`, `momentum`). Beside those that a `Reading` knows there is what an open
        junction holds back: ``effort`` of an X1, flows of which are zero, and ``flow`` of an X0, in
        minus out; both are zero while it is on. Where it is not linear, the modes that watch it
        take the general step.
    above, below : float, str or sympy expression, SI
        A number, the name of a parameter or an expression of parameters.

    Examples
    --------
    >>> When("T", above=21.0)
    When('T', above=21.0)
    >>> from bondgraph import effort
    >>> When(effort("stick"), above="F_s", below=-2.5)
    When(e_stick, above='F_s', below=-2.5)
    """

    signal: Signal
    above: Value | None = field(default=None, kw_only=True)
    below: Value | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        """Refuse a condition without a signal or a level, and levels that are no numbers."""
        if not isinstance(self.signal, str) and not getattr(self.signal, "free_symbols", None):
            raise UnusableInput(
                f"When({self.signal!r}): give the name of a sensor, or an expression of signals "
                "such as effort('k')"
            )
        if self.above is None and self.below is None:
            raise UnusableInput(f"When({self.signal!r}): give a level, above= or below=")
        for name, level in (("above", self.above), ("below", self.below)):
            if level is not None and not isinstance(level, str | sp.Basic):
                real_number(f"When({self.signal!r}): {name}", level)

    def __repr__(self) -> str:
        """Only what is given."""
        given = (("above", self.above), ("below", self.below))
        levels = "".join(f", {n}={v!r}" for n, v in given if v is not None)
        return f"When({self.signal!r}{levels})"


@dataclass(frozen=True)
class Guard:
    """What turns a switched junction `on`, and what turns it `off`.

    Only one of them counts at a time: `on` while it is off, `off` while it is on. Where one is not
    given, nothing turns it back.

    Examples
    --------
    A diode opens where a voltage across it would drive a current, and closes where the current
    would turn back; a thermostat has two levels of one signal.

    >>> from bondgraph import effort, flow
    >>> diode = Guard("D", on=When(effort("D"), above=0.0), off=When(flow("D"), below=0.0))
    >>> heater = Guard("heater", on=When("T", below=19.0), off=When("T", above=21.0))
    """

    junction: str
    on: When | None = None
    off: When | None = None

    def __post_init__(self) -> None:
        """Refuse a guard of nothing."""
        if not isinstance(self.junction, str):
            raise GraphError(f"Guard({self.junction!r}): give the name of a switched junction")
        for name, when in (("on", self.on), ("off", self.off)):
            if when is not None and not isinstance(when, When):
                raise GraphError(f"guard of {self.junction}: {name}={when!r}; give a When(...)")
        if self.on is None and self.off is None:
            raise GraphError(f"guard of {self.junction}: give on=When(...), off=When(...) or both")


@dataclass(frozen=True)
class SwitchEvent:
    """A guard that has acted: when (s), which junction, and whether it is on from then.

    Examples
    --------
    >>> SwitchEvent(0.25, "D", on=True)
    SwitchEvent(time=0.25, junction='D', on=True)
    """

    time: float
    junction: str
    on: bool
