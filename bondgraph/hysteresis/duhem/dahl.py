"""Dahl's friction model with exponent 1, solved exactly along every monotone move."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, final

from bondgraph.hysteresis.checks import parameter, positive
from bondgraph.hysteresis.duhem.bouc_wen import BoucWen
from bondgraph.hysteresis.duhem.duhem_branch import DuhemBranch
from bondgraph.support.ops import Expression


@final
@dataclass(frozen=True, slots=True)
class Dahl(DuhemBranch):
    """Friction force ``dF = sigma (1 - sgn(dx) F/F_c) dx`` over a displacement.

    Dahl's exponent 1, the usual one for ductile contacts; other exponents are not offered. It is
    Bouc-Wen with gamma = 0 (`as_bouc_wen`). It dissipates at its output: F as effort, x as
    displacement.

    Parameters
    ----------
    stiffness : expression
        sigma > 0, slope at F = 0; output per input.
    coulomb : expression
        F_c > 0, limit of the force; unit of the output.

    Raises
    ------
    BadParameter
        If one of them is not positive.

    References
    ----------
    dahl1968

    Examples
    --------
    >>> operator = Dahl(stiffness=2.0, coulomb=3.0)
    >>> operator.run([0.0, 100.0, -100.0])[0].round(6).tolist()
    [0.0, 3.0, -3.0]
    """

    kind: ClassVar[str] = "dahl"

    stiffness: Expression
    coulomb: Expression

    def __post_init__(self) -> None:
        """Check and store the parameters."""
        for name in ("stiffness", "coulomb"):
            value = parameter(name, getattr(self, name))
            positive(name, value)
            object.__setattr__(self, name, value)

    @property
    def straight_slope(self) -> Expression:
        """None, 0."""
        return 0.0

    @property
    def state_gain(self) -> Expression:
        """The state is the force: 1."""
        return 1.0

    @property
    def state_growth(self) -> Expression:
        """Slope sigma where F = 0; output per input."""
        return self.stiffness

    def rates(self, direction: Expression) -> tuple[Expression, Expression]:
        """Return ``sigma/F_c`` twice: Dahl does not tell loading from unloading."""
        rate = self.stiffness / self.coulomb
        return rate, rate

    def as_bouc_wen(self) -> BoucWen:
        """Return the same operator as Bouc-Wen with gamma = 0; its memory is the same tuple.

        Returns
        -------
        BoucWen
            With z = F.

        References
        ----------
        ismail2009
        """
        return BoucWen(0.0, 1.0, self.stiffness, self.stiffness / self.coulomb, 0.0)
