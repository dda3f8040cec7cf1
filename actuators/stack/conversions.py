"""Every structure of the stack with every operator: exact conversions, in closed form.

A force-free stack that moves slowly is an operator ``x = H[V]`` whatever its structure, and
``V = H^-1[x]`` splits into what the structure places elsewhere:

- bond graph: ``V = l E_C(p)``, ``x = T p / l``, so ``E_C(p) = H^-1[T p / l] / l``;
- lumped: ``V = V_h(q) + (k / T) x``, ``q = (T + C k / T) x``.

The inverse of weighted plays is weighted plays, and the linear part only changes the first weight.
Ang's inverse bends before its plays, so there the linear part stays beside it (`Parallel`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TypeAlias

from actuators.stack.bond_graph import stack_bond_graph
from actuators.stack.hysteresis import stack_hysteresis
from actuators.stack.lumped import stack_lumped
from actuators.stack.scaling import scaled
from bondgraph.graph.bond_graph import BondGraph
from bondgraph.hysteresis import (
    AlJanaideh,
    Ang,
    AngInverse,
    BadParameter,
    MaxwellResistiveCapacitor,
    Operator,
    Parallel,
    PrandtlIshlinskii,
)
from bondgraph.laws import Hysteretic
from bondgraph.support.errors import unknown_name

Pure: TypeAlias = PrandtlIshlinskii | AlJanaideh | Ang
"""An operator from voltage (V) to displacement (m) that has an exact inverse."""

# a linear part smaller than this share of k/T is rounding of one that cancels
_RELATIVE_ZERO = 1e-9


@dataclass(frozen=True, slots=True)
class Lumped:
    """Constants of the lumped-parameter model: C (F), T (N/V), k (N/m)."""

    capacitance: float = 1.5e-6
    transducer: float = 3.52
    stiffness: float = 65e6

    @property
    def charge_per_metre(self) -> float:
        """``q / x`` of the slow, force-free stack, ``T + C k / T``, C/m."""
        return self.transducer + self.capacitance * self.stiffness / self.transducer

    @property
    def volts_per_metre(self) -> float:
        """``V_t / x`` of the slow, force-free stack, ``k / T``, V/m."""
        return self.stiffness / self.transducer


@dataclass(frozen=True, slots=True)
class Polarised:
    """Constants of the general bond graph model: T (m/C), l (m)."""

    transducer: float = 0.0327
    length: float = 18e-3


def polarisation_operator(
    pure: Pure, constants: Polarised | None = None
) -> PrandtlIshlinskii | AngInverse:
    """Return ``E_C(p) = H^-1[T p / l] / l``, C m to V/m.

    Parameters
    ----------
    pure : PrandtlIshlinskii, AlJanaideh or Ang
        H, V to m.
    constants : Polarised, optional

    Raises
    ------
    NotInvertible
        If a slope of H is not positive.

    References
    ----------
    krejci2001, kuhnen2003
    """
    at = constants or Polarised()
    return scaled(pure.inverse(), at.transducer / at.length, 1.0 / at.length)


def pure_from_polarisation(
    operator: PrandtlIshlinskii | AngInverse, constants: Polarised | None = None
) -> PrandtlIshlinskii | Ang:
    """Return H from ``E_C``: the reverse of `polarisation_operator`.

    Raises
    ------
    NotInvertible
        If a slope of E_C is not positive.
    """
    at = constants or Polarised()
    return scaled(operator, at.length / at.transducer, at.length).inverse()


def lumped_law(pure: Pure, constants: Lumped | None = None) -> Hysteretic:
    """Return the law ``V_h(q) = H^-1[x] - (k / T) x``, ``x = q / (T + C k / T)``, C to V.

    Its full slope is what the end slope of H leaves of k/T; it may be negative, which the
    capacitance in the loop allows.

    Parameters
    ----------
    pure : PrandtlIshlinskii, AlJanaideh or Ang
        H, V to m.
    constants : Lumped, optional

    Returns
    -------
    Hysteretic
        Weighted plays, or Ang's inverse with the linear part beside it.

    Raises
    ------
    NotInvertible
        If a slope of H is not positive.
    """
    at = constants or Lumped()
    inverse = scaled(pure.inverse(), 1.0 / at.charge_per_metre)
    linear = -at.volts_per_metre / at.charge_per_metre
    if isinstance(inverse, AngInverse):
        return Hysteretic(plus_linear(inverse, linear))
    return Hysteretic(_with_linear(inverse, linear))


def pure_from_lumped(law: Hysteretic, constants: Lumped | None = None) -> PrandtlIshlinskii | Ang:
    """Return H from ``V_h``: the reverse of `lumped_law`, and the way in for Maxwell elements.

    Parameters
    ----------
    law : Hysteretic
        V_h, C to V: plays, Maxwell elements or Ang's inverse, alone or as of `plus_linear`; with
        Ang's inverse the linear part must be k/T.
    constants : Lumped, optional

    Raises
    ------
    BadParameter
        If the law is Ang's inverse and a linear part remains, or holds another operator.
    NotInvertible
        If a slope of ``H^-1`` is not positive.
    """
    at = constants or Lumped()
    back = at.volts_per_metre / at.charge_per_metre
    linear, operator = back, law.operator
    if isinstance(operator, Parallel) and isinstance(operator.second, PrandtlIshlinskii):
        if operator.second.n_memory == 0:
            linear, operator = back + float(operator.second.linear_slope), operator.first
    if isinstance(operator, AngInverse):
        if abs(linear) > _RELATIVE_ZERO * back:
            raise BadParameter(
                f"V_h is Ang's inverse less {back - linear:.6g} V/C, the structure adds "
                f"{back:.6g} V/C: the rest has no closed inverse; use the constants of its making"
            )
        return scaled(operator, at.charge_per_metre).inverse()
    if isinstance(operator, MaxwellResistiveCapacitor):
        operator = operator.as_prandtl_ishlinskii()
    if not isinstance(operator, PrandtlIshlinskii):
        raise BadParameter(
            f"V_h holds a {operator.kind}; give plays, Maxwell elements or what lumped_law returns"
        )
    return scaled(_with_linear(operator, linear), at.charge_per_metre).inverse()


def maxwell_elements(operator: PrandtlIshlinskii) -> tuple[MaxwellResistiveCapacitor, float]:
    """Return plays as Maxwell elements and a linear rest: ``k_i = -w_i``, rest ``sum w_i``.

    Raises
    ------
    BadParameter
        If a weight beyond the first is not negative: that play leads and is no spring with a slip.

    Examples
    --------
    >>> maxwell_elements(PrandtlIshlinskii((0.0, 1.0), (3.0, -2.0)))[1]
    1.0
    """
    weights, thresholds = operator.weights[1:], operator.thresholds[1:]
    for i, w in enumerate(weights, start=1):
        if not w < 0.0:
            raise BadParameter(f"weights[{i}] = {w:.6g} is not negative: no Maxwell element")
    springs = tuple(-w for w in weights)
    slips = tuple(k * r for k, r in zip(springs, thresholds, strict=True))
    return MaxwellResistiveCapacitor(springs, slips), float(operator.slope_full)


def plus_linear(operator: Operator, linear: float) -> Parallel:
    """Return ``H[s] + linear s`` as one operator."""
    return Parallel(operator, PrandtlIshlinskii((0.0,), (linear,)))


def _with_linear(operator: PrandtlIshlinskii, linear: float) -> PrandtlIshlinskii:
    first, *others = operator.weights
    return PrandtlIshlinskii(operator.thresholds, (first + linear, *others))


def _maxwell() -> Pure:
    return pure_from_lumped(Hysteretic(MaxwellResistiveCapacitor.stack_2hz()))


OPERATORS: Mapping[str, Callable[[], Pure]] = {
    "prandtl_ishlinskii": lambda: AlJanaideh.stack_2hz().as_prandtl_ishlinskii(),
    "al_janaideh": AlJanaideh.stack_2hz,
    "ang": Ang.stack_2hz,
    "maxwell": _maxwell,
}
"""The printed operators as V to m; ``maxwell`` is table 6.4 behind the constants of table 6.1."""

STRUCTURES = ("pure", "lumped", "bond_graph")


def paired(structure: str, pure: Pure) -> BondGraph:
    """Return a structure whose slow, force-free loop is that of an operator.

    Parameters
    ----------
    structure : {"pure", "lumped", "bond_graph"}
    pure : PrandtlIshlinskii, AlJanaideh or Ang
        H, V to m.

    Raises
    ------
    UnknownName
        If there is no such structure.
    """
    if structure == "pure":
        return stack_hysteresis(pure)
    if structure == "lumped":
        return stack_lumped(lumped_law(pure))
    if structure == "bond_graph":
        return stack_bond_graph(Hysteretic(polarisation_operator(pure)))
    raise unknown_name("structure", structure, "actuators.stack.conversions", STRUCTURES)
