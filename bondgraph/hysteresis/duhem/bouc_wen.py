"""The Bouc-Wen model with exponent 1 and Wang and Wen's skew, exact along every monotone move."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, final

from bondgraph.hysteresis.checks import parameter, positive
from bondgraph.hysteresis.duhem.duhem_branch import DuhemBranch, check_rates
from bondgraph.support.ops import Expression


@final
@dataclass(frozen=True, slots=True)
class BoucWen(DuhemBranch):
    """``y = c x + d z`` with ``dz/dx = A - |z| (gamma + beta sgn(dx z) + phi (sgn dx + sgn z))``.

    Exponent 1, for which each monotone branch is an exponential in x. The skew phi acts only while
    ``|z|`` grows: z stays between ``-A/(beta + gamma - 2 phi)`` and
    ``A/(beta + gamma + 2 phi)``. With A without unit, z has the unit of the input. The equation is
    rate independent: neither time nor the number of samples enters.

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
    skew : expression, optional
        phi, per input, ``2 |phi| < beta + gamma`` and, if beta < gamma, ``|phi| < beta``.

    Raises
    ------
    BadParameter
        If A is not positive, or beta, gamma and phi do not bound z.

    References
    ----------
    bouc1967, wen1976, ikhouane2007, ismail2009, erlicher2004, wang2000, song2006

    Examples
    --------
    >>> operator = BoucWen(slope=0.0, gain=1.0, growth=1.0, beta=0.5, gamma=0.5)
    >>> operator.run([0.0, 50.0, 50.5, 0.0])[0].round(6).tolist()
    [0.0, 1.0, 1.0, -1.0]
    >>> operator = BoucWen(0.0, 1.0, growth=1.0, beta=0.6, gamma=0.4, skew=0.25)
    >>> operator.run([0.0, 90.0, -90.0])[0].round(6).tolist()
    [0.0, 0.666667, -2.0]
    """

    kind: ClassVar[str] = "bouc_wen"

    slope: Expression
    gain: Expression
    growth: Expression
    beta: Expression
    gamma: Expression
    skew: Expression = 0.0

    def __post_init__(self) -> None:
        """Check and store the parameters."""
        for name in ("slope", "gain", "growth", "beta", "gamma", "skew"):
            object.__setattr__(self, name, parameter(name, getattr(self, name)))
        positive("growth", self.growth)
        for direction in (1.0, -1.0):
            names = f"beta - gamma and beta + gamma {'+-'[direction < 0.0]} 2 skew"
            check_rates(names, *self.rates(direction))

    @property
    def straight_slope(self) -> Expression:
        """Slope c of the part without memory; output per input."""
        return self.slope

    @property
    def state_gain(self) -> Expression:
        """Output d per unit of z."""
        return self.gain

    @property
    def state_growth(self) -> Expression:
        """Slope A of z where z = 0; z per input."""
        return self.growth

    def rates(self, direction: Expression) -> tuple[Expression, Expression]:
        """Return ``beta - gamma`` for s z < 0 and ``beta + gamma + 2 phi s`` for s z > 0."""
        grows = self.beta + self.gamma + 2.0 * self.skew * direction
        return self.beta - self.gamma, grows
