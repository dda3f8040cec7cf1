"""The Bouc-Wen model with exponent 1, solved exactly along every monotone move."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, final

from bondgraph.hysteresis.checks import parameter, positive
from bondgraph.hysteresis.duhem.duhem_branch import BoucWenState, check_rates
from bondgraph.support.ops import Expression


@final
@dataclass(frozen=True, slots=True)
class BoucWen(BoucWenState):
    """``y = c x + d z`` with ``dz = A dx - beta |dx| z - gamma dx |z|``.

    Exponent 1, for which each monotone branch is an exponential in x. z stays within
    ``A/(beta + gamma)``; with A without unit, z has the unit of the input. The equation is rate
    independent: neither time nor the number of samples enters.

    ``beta + gamma > 0`` and ``beta >= gamma`` is the class that is bounded from any state and,
    with c, d >= 0, dissipative at the output (`passive_port`). ``beta < gamma`` with beta > 0 is
    bounded from the states that `initial_memory` admits; it can create energy and is accepted
    without that claim.

    In piezoelectric models z is subtracted (d < 0). The output then rises with the input, as a
    numeric inverse needs, if ``c > 2 |d| A beta/(beta + gamma)`` (for beta >= gamma); it is passive
    at the input if ``c >= |d| A``.

    Parameters
    ----------
    slope : expression
        c, output per input.
    gain : expression
        d, output per z.
    growth : expression
        A > 0, z per input.
    beta, gamma : expression
        Per input; beta > 0, beta + gamma > 0.

    Raises
    ------
    BadParameter
        If A, beta or beta + gamma is not positive.

    References
    ----------
    bouc1967, wen1976, ikhouane2007, ismail2009, erlicher2004

    Examples
    --------
    >>> operator = BoucWen(slope=0.0, gain=1.0, growth=1.0, beta=0.5, gamma=0.5)
    >>> operator.run([0.0, 50.0, 50.5, 0.0])[0].round(6).tolist()
    [0.0, 1.0, 1.0, -1.0]
    """

    kind: ClassVar[str] = "bouc_wen"

    beta: Expression
    gamma: Expression

    def __post_init__(self) -> None:
        """Check and store the parameters."""
        for name in ("slope", "gain", "growth", "beta", "gamma"):
            object.__setattr__(self, name, parameter(name, getattr(self, name)))
        positive("growth", self.growth)
        check_rates("beta - gamma and beta + gamma", *self.rates(1.0))

    def rates(self, direction: Expression) -> tuple[Expression, Expression]:
        """Return ``beta - gamma`` for s z < 0 and ``beta + gamma`` for s z > 0, per input."""
        return self.beta - self.gamma, self.beta + self.gamma
