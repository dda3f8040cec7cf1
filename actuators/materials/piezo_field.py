"""A piezoelectric body as one store with an electrical and a mechanical port: a C field.

The charge Q and the elongation x are its displacements, voltage V and force F (tension positive)
the gradient of one energy ``W(Q, x)``. Along the poling axis, with S strain, D charge density, the
four forms of the constants (IEEE Std 176; stack actuator thesis, eq. 2.1-2.7) have the energy
density

| form | constants | ``U(S, D)`` |
| --- | --- | --- |
| ``d`` | s^E, d, eps^T | ``S^2/(2 s^E) + (D - S d/s^E)^2 / (2 (eps^T - d^2/s^E))`` |
| ``e`` | c^E, e, eps^S | ``c^E S^2/2 + (D - e S)^2 / (2 eps^S)`` |
| ``g`` | s^D, g, beta^T | ``(S - g D)^2 / (2 s^D) + beta^T D^2 / 2`` |
| ``h`` | c^D, h, beta^S | ``c^D S^2/2 - h S D + beta^S D^2/2`` |

(from the law of each form by ``dU = T dS + E dD``). They are one function: after conversion all
four agree. With n layers of area A and thickness t, mechanically in series and electrically
parallel, ``W(Q, x) = n A t U(x / (n t), Q / (n A))``. Numbers and expressions are treated alike.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite
from typing import Any, final

import sympy as sp

from actuators.materials.poled_ceramic import StackConstants
from actuators.materials.uniaxial import Uniaxial, number_of
from bondgraph.graph.elements import CField
from bondgraph.graph.modulation import port_variables
from bondgraph.support.errors import UnusableInput


@final
@dataclass(frozen=True, slots=True)
class Layers:
    """Layers between electrodes: mechanically in series, electrically parallel.

    Parameters
    ----------
    area : number or expression
        A of one layer, m^2.
    thickness : number or expression
        t between two electrodes, m.
    number : int or expression
        n.

    Raises
    ------
    UnusableInput
        A number is not positive and finite.
    """

    area: Any
    thickness: Any
    number: Any = 1

    def __post_init__(self) -> None:
        """Refuse sizes that no body has."""
        for name in ("area", "thickness", "number"):
            value = number_of(getattr(self, name))
            if value is not None and not 0 < value < float("inf"):
                raise UnusableInput(
                    f"layers: {name} = {value:g} must be positive and finite; give SI units"
                )


@final
@dataclass(frozen=True, slots=True)
class Curvature:
    """Terms beyond the quadratic energy; both ports feel them, as reciprocity demands.

    Parameters
    ----------
    electrostriction : number or expression
        M, m^4/C^2: the strain ``M D^2`` beside the piezoelectric one.
    saturation : number or expression
        z, V m^5/C^3: the field ``z D^3``; the permittivity falls as the charge rises if positive.
    """

    electrostriction: Any = 0
    saturation: Any = 0

    def __post_init__(self) -> None:
        """Refuse an energy without lower bound."""
        for name in ("electrostriction", "saturation"):
            value = number_of(getattr(self, name))
            if value is not None and not (isfinite(value) and (value >= 0 or name[0] == "e")):
                raise UnusableInput(
                    f"curvature: {name} = {value:g} must be finite, and saturation 0 or more: else "
                    "the energy has no lowest value"
                )


LINEAR = Curvature()
"""No higher terms."""


def energy_density(constants: Uniaxial, strain: Any, charge: Any) -> Any:
    """Return ``U(S, D)``, J/m^3, from the three constants of their own form (table above)."""
    a, k, b = constants.values
    if constants.form == "d":
        clamped = b - k**2 / a
        return strain**2 / (2 * a) + (charge - strain * k / a) ** 2 / (2 * clamped)
    if constants.form == "e":
        return a * strain**2 / 2 + (charge - k * strain) ** 2 / (2 * b)
    if constants.form == "g":
        return (strain - k * charge) ** 2 / (2 * a) + b * charge**2 / 2
    return a * strain**2 / 2 - k * strain * charge + b * charge**2 / 2


def field_energy(constants: Uniaxial, layers: Layers, curvature: Curvature = LINEAR) -> sp.Expr:
    """Return ``W(q1, q2)``, J, of the charge ``q1`` (C) and the elongation ``q2`` (m).

    ``W = n A t [U(x/(n t) - M D^2, D) + z D^4/4]`` with ``D = q1/(n A)``: electrostriction shifts
    the strain, so the energy stays bounded whatever M is.

    Examples
    --------
    >>> c, h, b, area, t, n = sp.symbols("c h b A t n", positive=True)
    >>> sp.expand(field_energy(Uniaxial("h", c, h, b), Layers(area, t, n)))
    A*c*q2**2/(2*n*t) - h*q1*q2/n + b*q1**2*t/(2*A*n)
    """
    q, x = port_variables("q", 2)
    area, t, n = layers.area, layers.thickness, layers.number
    volume, charge = n * area * t, q / (n * area)
    w = sp.hessian(sp.sympify(volume * energy_density(constants, x / (n * t), charge)), (q, x))
    free = x - n * t * curvature.electrostriction * charge**2
    energy: sp.Expr = _tidy(w[0, 0]) * q**2 / 2 + _tidy(w[0, 1]) * q * free
    energy += _tidy(w[1, 1]) * free**2 / 2 + volume * curvature.saturation * charge**4 / 4
    return energy


def piezo_field(
    name: str, constants: Uniaxial, layers: Layers, curvature: Curvature = LINEAR
) -> CField:
    """Return the store: bond its electrical port first, then its mechanical one.

    Expressions have to be written in parameters declared in the graph.

    Examples
    --------
    >>> from bondgraph import BondGraph, One, Se
    >>> from bondgraph.equations.derivation import equations
    >>> bar = Uniaxial("d", 20e-12, 400e-12, 1.5e-8)
    >>> with BondGraph("free_stack") as g:
    ...     stack = piezo_field("stack", bar, Layers(25e-6, 50e-6, 360))
    ...     loop, tip = One("loop"), One("tip")
    ...     _ = Se("V_in", unit="V") >> loop >> stack
    ...     _ = Se("F_e", unit="N") >> tip >> stack
    >>> stroke = equations(g).signal("q_stack2").coeff(sp.Symbol("V_in", real=True))
    >>> round(float(stroke) / 400e-12)  # n d33 a volt
    360
    """
    energy = field_energy(constants, layers, curvature)
    return CField(name, energy=energy, units=("V", "N"))


def small_signal(energy: sp.Expr, charge: Any = 0, elongation: Any = 0) -> StackConstants:
    """Return the constants of a two-port from the Hessian of its energy at a state.

    ``C = 1/W_qq`` (clamped), ``k = W_xx - W_qx^2/W_qq`` (short circuit), ``T = -W_qx/W_qq``; the
    rest follows there: free capacitance, open stiffness, ``k^2 = W_qx^2/(W_qq W_xx)``, free stroke
    ``T V/k`` and blocking force ``T V``.

    Parameters
    ----------
    energy : sympy.Expr
        In ``q1`` (charge) and ``q2`` (elongation), such as `field_energy`.
    charge, elongation : number or expression
        C and m.

    Raises
    ------
    UnusableInput
        The numbers are those of no stable store (the coupling factor reaches 1).
    """
    q, x = port_variables("q", 2)
    hessian = sp.hessian(energy, (q, x)).subs({q: charge, x: elongation})
    w_qq, w_qx, w_xx = hessian[0, 0], hessian[0, 1], hessian[1, 1]
    found = (w_xx - w_qx**2 / w_qq, 1 / w_qq, -w_qx / w_qq)
    k, c, t = (v if (f := number_of(v)) is None else f for v in map(_tidy, found))
    return StackConstants(k, c, t)


def _tidy(value: sp.Expr) -> sp.Expr:
    return value if value.is_number else sp.factor(value)
