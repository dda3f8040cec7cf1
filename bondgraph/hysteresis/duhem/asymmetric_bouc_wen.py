"""The Bouc-Wen model with Wang and Wen's skew term, solved exactly along every monotone move."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, final

from bondgraph.hysteresis.checks import parameter, positive
from bondgraph.hysteresis.duhem.duhem_branch import BoucWenState, check_rates
from bondgraph.support.ops import Expression


@final
@dataclass(frozen=True, slots=True)
class AsymmetricBoucWen(BoucWenState):
    """``y = c x + d z`` with ``dz/dx = A - |z| (gamma + beta sgn(dx z) + phi (sgn dx + sgn z))``.

    Exponent 1. The skew phi acts only while |z| grows: z saturates at ``A/(beta + gamma + 2 phi)``
    upwards and at ``-A/(beta + gamma - 2 phi)`` downwards. With phi = 0 it is `BoucWen`, whose
    conditions and claims carry over: dissipative for c, d >= 0 and beta >= gamma.

    Parameters
    ----------
    slope : expression
        c, output per input.
    gain : expression
        d, output per z.
    growth : expression
        A > 0, z per input.
    beta, gamma : expression
        Per input.
    skew : expression
        phi, per input, ``2 |phi| < beta + gamma`` and, if beta < gamma, ``|phi| < beta``.

    Raises
    ------
    BadParameter
        If A is not positive, or beta, gamma and phi do not bound z.

    References
    ----------
    wang2000, song2006

    Examples
    --------
    >>> operator = AsymmetricBoucWen(0.0, 1.0, growth=1.0, beta=0.6, gamma=0.4, skew=0.25)
    >>> operator.run([0.0, 90.0, -90.0])[0].round(6).tolist()
    [0.0, 0.666667, -2.0]
    """

    kind: ClassVar[str] = "asymmetric_bouc_wen"

    beta: Expression
    gamma: Expression
    skew: Expression

    def __post_init__(self) -> None:
        """Check and store the parameters."""
        for name in ("slope", "gain", "growth", "beta", "gamma", "skew"):
            object.__setattr__(self, name, parameter(name, getattr(self, name)))
        positive("growth", self.growth)
        for direction in (1.0, -1.0):
            names = f"beta - gamma and beta + gamma {'+-'[direction < 0.0]} 2 skew"
            check_rates(names, *self.rates(direction))

    def rates(self, direction: Expression) -> tuple[Expression, Expression]:
        """Return ``beta - gamma`` and ``beta + gamma + 2 phi s``, per input."""
        grows = self.beta + self.gamma + 2.0 * self.skew * direction
        return self.beta - self.gamma, grows
